"""Numerics without physics: kernel function, MLS, grid hash, visibility."""

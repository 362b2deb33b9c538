"""Readers of mesh files, one file per format. Each gives a `Raw`: what the file says, with the file's own numbers. NumPy only."""

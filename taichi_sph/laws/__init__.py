"""Physics at a point: Taichi functions, numbers in, numbers out, one file per law."""

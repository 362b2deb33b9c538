"""Smoothed-particle shells that break: `taichi-sph --help`, or `from taichi_sph import scene`.

Importing the package starts neither Taichi nor VTK; both wait until a run or a picture needs them.
"""

__version__ = "0.1.0"

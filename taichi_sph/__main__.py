"""`python -m taichi_sph`: the command line where scripts are not on the path."""

from .cli import main

main()

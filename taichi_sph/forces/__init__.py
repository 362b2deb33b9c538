"""The terms of the equations of motion, one file each: formula, kernels, launcher."""

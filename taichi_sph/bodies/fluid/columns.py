"""Columns of the constants of a fluid (FluidParticles.constants).

Kernels read them in this order; the sums of `pairs._act` round by it: rho_0 c^2 [Pa]; gamma; least pressure [Pa]; rho_0; D_0 and 1 / 2h_0
of the group; rho_0 alpha c h [Pa s] or rho_0 c [Pa s/m]; rho_0 beta h^2 [kg/m] or 3 rho_0 [kg/m3]; eps^2 [m2] of the group; diffusion
[1/Pa s]; c^2; own D_0 [m]; gravity (3) [m/s2]; the place (3) [m] to which the records of the group are relative.
"""

STIFFNESS, GAMMA, LEAST, DENSITY, SPACING, INVERSE, LINEAR, QUADRATIC, EPS2, DIFFUSION, SOUND2, OWN = range(12)
GRAVITY, ORIGIN, COUNT = 12, 15, 18

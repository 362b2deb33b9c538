"""Rupture strain of a cell that is wider than the sheet is thick.

A sheet in tension first stretches evenly, up to the strain eps_u at which its hardening no longer makes up for its
thinning (Considere: d sigma_y / d eps = sigma_y), then necks over a length of about its thickness e. The tabulated
rupture strain is that of the neck. A cell of width D > e holds the neck and sheet that has stopped at eps_u, so that it
breaks at the mean

    eps_r(D) = eps_u + (eps_r - eps_u) e / D

(Barba 1880 for bars; the form of the length-dependent rupture strains of ship collisions, Scharrer et al. 2002).
Without it the work to tear a metre of crack grows in proportion to the cells: at D = 6 e a crack costs several times
what it should, and stops.
"""

from __future__ import annotations

from typing import Any

from .hardening import at


def uniform_strain(strength: Any) -> float:
    """eps_u: plastic strain at which a sheet in tension starts to neck; 0 where it does at once."""
    low, high = 0.0, 10.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        stress, slope = at(strength, middle)
        low, high = (middle, high) if slope > stress else (low, middle)
    return low


def rupture_strain(material: Any, width: float, thickness: float) -> float:
    """eps_r of a cell of that width [m] in a sheet of that thickness [m]: that of the point, unless the material necks."""
    damage = material.damage
    if not damage.necks or width <= thickness:
        return damage.rupture
    even = uniform_strain(material.strength)
    if even >= damage.rupture:
        return damage.rupture
    return even + (damage.rupture - even) * thickness / width

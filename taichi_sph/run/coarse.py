"""Shells that may rupture and whose nodes are far apart beside what strikes them, or beside their holes: what `validate` and the plan say
of them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..bodies.rigid.solid import Solid
from ..geometry.solids import SolidMesh
from ..scene import Scene, Shell
from ..scene.units import show

ACROSS = 3.0  # spacings over a striker or a hole, below which rupture hangs on the spacing
ROUNDING = 1e-9


def across(points: np.ndarray, radii: np.ndarray | float, flight: np.ndarray) -> float:
    """Width [m] of balls of some radii at points (N, 3), seen along a flight (3,): twice the farthest reach from their middle."""
    d = flight / np.linalg.norm(flight)
    away = points - 0.5 * (points.min(axis=0) + points.max(axis=0))
    return 2 * float((np.linalg.norm(away - np.outer(away @ d, d), axis=1) + radii).max())


def strikers(scene: Scene, rigids: Mapping[str, Solid], solids: Mapping[str, SolidMesh]) -> dict[str, float]:
    """By the names of the bodies that fly at the start, how wide they are [m]: rigid ones, and solids whose mesh is there."""
    flying = [rigid for rigid in rigids.values() if any(rigid.said.velocity)]
    found = {rigid.name: across(rigid.places, rigid.radii, np.asarray(rigid.said.velocity)) for rigid in flying}
    for thrown in scene.initial:
        for name in [thrown.body] if thrown.body is not None else list(solids):
            if name in solids and thrown.velocity is not None and any(thrown.velocity):
                found[name] = across(solids[name].points, 0.0, np.asarray(thrown.velocity))
    return found


def too_coarse(scene: Scene, rigids: Mapping[str, Solid], solids: Mapping[str, SolidMesh]) -> list[str]:
    """A sentence for each shell that may rupture and has fewer than ACROSS spacings over its smallest striker, or its smallest hole."""
    flying, found = strikers(scene, rigids, solids), []
    for shell in scene.shells:
        if shell.material.damage is None:
            continue
        spacing, key = _spacing(scene, shell)
        meets = {f"'{name}'": wide for name, wide in flying.items() if scene.met(name, shell.name).meet}
        holes = {f"holes[{k}]": 2 * hole.radius for k, hole in enumerate(getattr(shell.surface, "holes", ()))}
        for sizes in (meets, holes):
            if not sizes:
                continue
            name = min(sizes, key=lambda one: sizes[one])
            if ACROSS * spacing > sizes[name] * (1 + ROUNDING):
                found.append(
                    f"nodes of '{shell.name}' are {show(spacing, 'm')} apart, {sizes[name] / spacing:.2g} spacings over {name} "
                    f"({show(sizes[name], 'm')}): below {ACROSS:g}, whether it ruptures there and how far may hang on the spacing; "
                    f"compare with {key} = {show(_below(sizes[name] / ACROSS), 'm')} or less"
                )
    return found


def _below(length: float) -> float:
    """The next number of two digits that is not above it."""
    step = 10.0 ** (math.floor(math.log10(length)) - 1)
    return math.floor(length / step + 1e-6) * step


def _spacing(scene: Scene, shell: Shell) -> tuple[float, str]:
    """How far apart [m] the nodes are where it may rupture, and the key that says so."""
    own = scene.key_of(shell)
    if shell.patch is not None:
        return shell.patch.spacing or scene.numerics_of(shell).spacing, f"{own}.patch.spacing"
    return scene.numerics_of(shell).spacing, f"{own}.spacing" if shell.spacing else "numerics.spacing"

"""Openings that water finds at the end of a run, and those too narrow for its particles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...bodies.fluid.narrow import FLOWS, SHUT, narrow
from ..folder import RunFolder
from . import fragments


def torn(run: RunFolder, shell: str) -> float:
    """Widest of the holes (within their lips) and cracks (between theirs) of a shell at the end [m]; 0 without one."""
    body = run.frames(run.torn(shell)).body(-1)
    if "broken" not in body.cell_data:
        return 0.0
    f = fragments.fragments(body, run.scene)
    found = fragments.holes(f)
    seen = [across for across, compact in (fragments.lips(f, hole) for hole in found) if compact]
    return max([fragments.widest(body), *(hole.diameter for hole in found), *seen])


def gap(run: RunFolder, shell: str, fluid: str, spacing: float) -> tuple[float, int] | None:
    """Between the border of a shell that lay on a wall of the fluid at the start and that wall now: the widest [m], number of the wall.
    None: it lies on none, or still does."""
    file = run.frames(shell)
    first, last = file.body(0), file.body(-1)
    ends = np.sort(np.concatenate([first.cells[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1)
    three = first.cells[:, 3] < 0
    ends = np.concatenate([ends[(ends >= 0).all(axis=1)], np.sort(first.cells[three][:, [2, 0]], axis=1)])
    sides, times = np.unique(ends, axis=0, return_counts=True)
    border = np.unique(sides[times == 1])
    if not len(border):
        return None
    widest: tuple[float, int] | None = None
    for number, wall in enumerate(run.scene.walls):
        if not wall.holds(fluid):
            continue
        normal = np.asarray(wall.normal) / np.linalg.norm(wall.normal)
        before, now = ((body.points[border] - np.asarray(wall.point)) @ normal for body in (first, last))
        on = np.abs(before) < SHUT * spacing
        if on.any() and (most := float(now[on].max())) > SHUT * spacing and (widest is None or most > widest[0]):
            widest = most, number
    return widest


def too_narrow(run: RunFolder, show: Callable[[float, str], str]) -> list[str]:
    """A sentence for each opening that there is at the end and that water can hardly pass."""
    found = []
    vessels = {fluid.name: getattr(fluid.fill, "shell", None) for fluid in run.scene.fluids}
    for fluid in run.scene.fluids:
        spacing = run.scene.numerics_of(fluid).spacing / 2**fluid.halvings
        own = vessels[fluid.name]
        for shell in run.scene.shells:
            if shell.name not in run.bodies() or not run.scene.met(shell.name, fluid.name).meet:
                continue
            if own is not None and shell.name != own and shell.name in vessels.values():
                continue  # the tank of another fluid
            width = torn(run, shell.name)
            if SHUT * spacing < width < FLOWS * spacing:
                found.append(narrow(f"the widest opening in '{shell.name}', between its lips,", width, fluid.name, spacing, show))
            slot = gap(run, shell.name, fluid.name, spacing)
            if slot is not None and slot[0] < FLOWS * spacing:
                found.append(narrow(f"the gap between '{shell.name}' and walls[{slot[1]}]", slot[0], fluid.name, spacing, show))
    return [f"{text[0].upper()}{text[1:]}." for text in found]

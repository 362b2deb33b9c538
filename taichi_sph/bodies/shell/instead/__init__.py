"""What a scene may have of shells in place of motion: equilibrium, modes, the limit of the time step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from .limit import LimitSearch
from .modes import ModeSearch
from .statics import Statics

if TYPE_CHECKING:
    from ...body import Clocked
    from ..group import ShellGroup


def in_place(world: Clocked, groups: Sequence[ShellGroup]) -> Statics | ModeSearch | LimitSearch | None:
    """What the scene asks of its groups of shells; None where they move."""
    scene = groups[0].scene
    if scene.static is not None:
        return Statics(world, groups, scene.static)
    if scene.modes is not None:
        (group,) = groups
        return ModeSearch(world, group, scene.modes.count)
    if scene.limit is not None:
        (group,) = groups
        return LimitSearch(world, group, scene.limit.steps, scene.limit.resolution)
    return None

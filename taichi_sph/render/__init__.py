"""Pictures of a run, from its files only: stills, plots, a movie. `render_run(folder)` makes them all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .pictures import alike, reduced, render_compare, render_run, render_targets

__all__ = ["alike", "reduced", "render_compare", "render_run", "render_targets"]


def __getattr__(name: str) -> Any:
    """matplotlib and VTK are loaded when the first picture is asked for."""
    if name in __all__:
        from . import pictures

        return getattr(pictures, name)
    raise AttributeError(name)

"""Pictures of a run, where the drawing packages are there."""

from __future__ import annotations

from pathlib import Path

from .progress import Progress


def draw(out: Path, progress: Progress | None = None, movie: bool = False) -> list[Path]:
    """Pictures of a run, from its files, or its movie alone; without the drawing packages a line that says how to get them."""
    from ..output.folder import RunFolder

    progress = progress or Progress()
    with RunFolder(out) as folder:
        folder.frames()  # a sentence where there is nothing to draw
    if not can_draw(progress):
        return []
    from ..render import render_run

    return render_run(out, progress.say, movie)


def can_draw(progress: Progress) -> bool:
    """Whether the drawing packages are there; says how to get them where not."""
    from importlib.util import find_spec

    missing = [name for name in ("matplotlib", "PIL") if find_spec(name) is None]  # without pyvista matplotlib draws
    if missing:
        progress.say(f"no pictures: {missing[0]} is missing; get it with: pip install 'taichi-sph[render]'")
    return not missing

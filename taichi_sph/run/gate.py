"""What stops a run before it begins: a scene that this machine cannot hold, a folder that cannot take it."""

from __future__ import annotations

import math
import os
import shutil
from pathlib import Path

from ..errors import SceneError
from ..output import files
from ..output.lock import LOCK_FILE
from ..scene import Scene, Study
from ..scene.units import show
from . import speed
from .plan import Plan, plan
from .progress import bytes_text

SCENE_FILE, SUMMARY_FILE, LOG_FILE, STOPPED = "scene.json", "summary.json", "log.txt", "stopped"


def default_out(scene: Scene | Study) -> Path:
    """runs/<scene>-<quality>; of a scene with specimens runs/<scene>-<specimen>-<quality>."""
    parts = (scene.name, scene.parameters.get("specimen"), scene.quality)
    return Path("runs") / "-".join(str(part) for part in parts if part)


def checked_plan(scene: Scene, arch: str, large: float = math.inf) -> Plan:
    """The plan, refused where this machine cannot hold the run; large: as in `plan`."""
    from ..output.measures import check_quantities

    check_quantities(scene)
    p = plan(scene, speed.recall(scene, arch), large)
    available = files.memory()
    if available is not None and p.memory > available:
        raise SceneError(
            f"numerics.spacing {show(scene.numerics.spacing, 'm')} gives {p.nodes} nodes and needs about "
            f"{bytes_text(p.memory)} of memory; this machine has {bytes_text(available)}"
        )
    return p


def check_out(out: Path, need: int, mark: str = SCENE_FILE) -> None:
    """`out` must be new, empty or an earlier run (or study, by its `mark`), writable, and on a disk with room."""
    if out.exists() and not out.is_dir():
        raise SceneError(f"--out '{out}' is a file; give a folder")
    known = (mark, mark + ".tmp", LOCK_FILE)  # what a run that was killed at its very start may leave
    if out.is_dir() and {p.name for p in out.iterdir()} - set(known) and not (out / mark).is_file():
        raise SceneError(f"--out '{out}' holds files that are not of a run; give a new or empty folder")
    if out.is_dir():
        files.check_links(out, (*files.RUN, *files.STUDIES))
    there = out
    while not there.exists():
        there = there.parent
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise SceneError(f"--out '{out}' cannot be written: no permission in '{there}'")
    free = shutil.disk_usage(there).free
    if need > free:
        raise SceneError(f"--out '{out}' needs about {bytes_text(need)}; the disk has {bytes_text(free)} free")


def spare(out: Path) -> None:
    """SceneError where `out` holds what a run would destroy: an earlier one, finished or not."""
    if not (out / SCENE_FILE).is_file():
        return
    if (out / SUMMARY_FILE).is_file():
        raise SceneError(f"'{out}' holds a finished run; replace it with --overwrite, or give another folder with --out")
    if any((out / "checkpoints").glob("*.checkpoint")):
        raise SceneError(f"'{out}' holds an interrupted run; go on with: taichi-sph resume {out}, or replace it with --overwrite")

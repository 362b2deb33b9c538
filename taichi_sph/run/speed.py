"""How fast this machine was: node-steps per second of earlier runs, and what they took beside, kept in the user's cache for estimates.

A run is estimated by the last one of the same scene, of whatever quality; without one by the last one of its formulation and precision.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

from ..scene.schema import Scene

ASSUMED = 1.0e6  # node-steps/s on two cores, before anything was measured


def cache_folder() -> Path:
    """The folder for what can be lost: TAICHI_SPH_CACHE, else the user's cache folder."""
    if "TAICHI_SPH_CACHE" in os.environ:
        return Path(os.environ["TAICHI_SPH_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "taichi_sph"


BESIDE = "beside the steps"


def _key(scene: Scene, arch: str) -> str:
    return f"{arch} {scene.formulations} {scene.numerics.precision}"


def _load() -> dict[str, float]:
    try:
        return {k: float(v) for k, v in json.loads((cache_folder() / "speed.json").read_text()).items()}
    except (OSError, ValueError, AttributeError, TypeError):
        return {}  # an estimate is not worth an error


def recall(scene: Scene, arch: str) -> float:
    """Node-steps per second to expect; a body with steps of its own counts as often as it takes one."""
    known, key = _load(), _key(scene, arch)
    return max(known.get(f"{key} {scene.name}", known.get(key, ASSUMED)), 1.0)


def beside(scene: Scene, arch: str) -> float | None:
    """What the last run of this scene that drew pictures took beside its steps [s]; None without one."""
    return _load().get(f"{_key(scene, arch)} {scene.name}, {BESIDE}")


def remember(scene: Scene, arch: str, node_steps_per_second: float, beside: float | None = None) -> None:
    """Keeps what a run measured; beside [s]: what it took beside its steps, of one with pictures."""
    key = _key(scene, arch)
    measured = {key: node_steps_per_second, f"{key} {scene.name}": node_steps_per_second}
    if beside is not None:
        measured[f"{key} {scene.name}, {BESIDE}"] = beside
    path = cache_folder() / "speed.json"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(".tmp")
        temporary.write_text(json.dumps(_load() | measured, indent=1))
        os.replace(temporary, path)
    except OSError:
        return

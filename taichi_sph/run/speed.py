"""How fast this machine was: node-steps per second of earlier runs, kept in the user's cache for estimates."""

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


def _key(scene: Scene, arch: str) -> str:
    return f"{arch} {scene.formulations} {scene.numerics.precision}"


def _load() -> dict[str, float]:
    try:
        return {k: float(v) for k, v in json.loads((cache_folder() / "speed.json").read_text()).items()}
    except (OSError, ValueError, AttributeError, TypeError):
        return {}  # an estimate is not worth an error


def recall(scene: Scene, arch: str) -> float:
    """Node-steps per second to expect."""
    return max(_load().get(_key(scene, arch), ASSUMED), 1.0)


def remember(scene: Scene, arch: str, node_steps_per_second: float) -> None:
    """Keeps what a run measured."""
    path = cache_folder() / "speed.json"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(".tmp")
        temporary.write_text(json.dumps(_load() | {_key(scene, arch): node_steps_per_second}, indent=1))
        os.replace(temporary, path)
    except OSError:
        return

"""The run record: what is needed to run the same again and to tell whether it came out the same."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import platform
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..scene import Scene, Study
from ..scene.schema import LOADS
from .checkpoint import state_hash
from .folder import write_json

PACKAGES = ("taichi-sph", "taichi", "numpy", "scipy", "pydantic", "h5py", "vtk", "pyvista", "matplotlib")
# Keys of a scene that change no result; quality and parameters act through the other keys.
SHOWN_ONLY = ("title", "source", "output", "quality", "parameters")


def scene_hash(scene: Scene | Study) -> str:
    """sha256 of the scene, or of the scenes of a study, but for titles and for what is kept of them."""
    if isinstance(scene, Study):
        data: Any = {name: scene_hash(case) for name, case in scene.cases.items()}
    else:
        data = _said(scene.model_dump(mode="json", exclude=set(SHOWN_ONLY)))
        for load in (load for key in LOADS for load in data.get(key, ())):
            load["shell"] = load.pop("body")  # what loads called their body before there were several: old hashes stay
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _said(data: Any) -> Any:
    """Without what is None or empty: a key that a scene does not use changes no hash when it comes into being."""
    if isinstance(data, dict):
        return {k: _said(v) for k, v in data.items() if v is not None and v != [] and v != {}}
    return [_said(v) for v in data] if isinstance(data, list) else data


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that take part; nothing is imported for it."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def machine() -> dict[str, Any]:
    """Processor, cores and memory; nothing that names the machine or its user."""
    model = platform.processor() or platform.machine()
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    except OSError:
        pass  # not Linux
    found: dict[str, Any] = {"system": f"{platform.system()} {platform.machine()}", "processor": model}
    found["cores"] = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        found["memory_bytes"] = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        pass
    return found


def commit() -> str | None:
    """Commit of the source tree, with "+" when its code was changed since; None for an installed package."""
    here = Path(__file__).resolve().parents[2]
    if not (here / ".git").exists():
        return None
    try:
        git = ["git", "-C", str(here)]
        name = subprocess.run([*git, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True)
        changed = subprocess.run(
            [*git, "status", "--porcelain", "--untracked-files=no", "--", "taichi_sph", "scenes"],
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return name.stdout.strip() + ("+" if changed.stdout.strip() else "")


def write_record(
    folder: Path | str,
    scene: Scene,
    *,
    command: str,
    arch: str,
    threads: int,
    steps: int,
    seconds: Mapping[str, float],
    state: Mapping[str, np.ndarray],
) -> dict[str, Any]:
    """Writes record.json. `result_hash` is over the bytes of the final state, all arrays of it."""
    record = {
        "scene": scene.model_dump(mode="json"),
        "scene_hash": scene_hash(scene),
        "command": command,
        "commit": commit(),
        "versions": versions(),
        "machine": machine(),
        "arch": arch,
        "threads": threads,
        "steps": steps,
        "seconds": dict(seconds),
        "result_hash": state_hash(dict(state)),
    }
    write_json(Path(folder) / "record.json", record)
    return record

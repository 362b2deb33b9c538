"""`taichi-sph doctor`: what a run needs of this machine, checked one by one, each with its mend.

Taichi and the drawing run in processes of their own: where they crash, the doctor survives to say so.
"""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..scene import Scene
from .progress import bytes_text, duration_text
from .speed import cache_folder

PYTHONS = ((3, 11), (3, 13))
FREE = 2e9  # bytes of disk that runs of these scenes want

TAICHI = """
import sys, time
began = time.time()
from taichi_sph import runtime
from taichi_sph.runtime import ti
runtime.start(sys.argv[1], "f32" if sys.argv[1] == "vulkan" else "f64", None)
@ti.kernel
def total(n: ti.i32) -> ti.f64:
    s = ti.cast(0.0, ti.f64)
    for i in range(n):
        s += 0.5 * i
    return s
assert abs(total(1001) - 250250) < 1e-6, "a sum came out wrong"
version = ti.__version__ if isinstance(ti.__version__, str) else ".".join(map(str, ti.__version__))
print(f"{version}, first kernel after {time.time() - began:.1f} s")
"""

PICTURE = """
import matplotlib, PIL
from taichi_sph.render.backend import choose
backend = choose()
if backend.name == "vtk":
    import pyvista
    print(f"drawn off-screen by PyVista {pyvista.__version__}, {backend.window}; movies by Pillow {PIL.__version__}")
else:
    print(backend.notice)
"""


@dataclass(frozen=True)
class Finding:
    """`mend` is empty where all is well; a finding that is not `needed` does not stop a run."""

    what: str
    said: str
    mend: str = ""
    needed: bool = True


def examine(arch: str = "cpu", say: Callable[[str], None] = print) -> bool:
    """Prints all findings; True when a run can start."""
    well = True
    for check in (_python, _packages, lambda: _taichi(arch), _threads, _pictures, _cache, _disk):
        finding = check()
        mark = "ok  " if not finding.mend else ("BAD " if finding.needed else "note")
        say(f"{mark} {finding.what}: {finding.said}")
        if finding.mend:
            say(f"     mend: {finding.mend}")
            well &= not finding.needed
    say("all is well" if well else "a run cannot start before what is marked BAD is mended")
    return well


def requirements(scene: Scene, arch: str = "cpu") -> dict[str, Any]:
    """What a scene takes on the way to the end of its first step: nodes, stress_points, fields (name -> bytes), kernels (names), seconds to
    build and compile, seconds of the first step."""
    from .. import runtime
    from ..world.world import World

    sim = World(scene, arch=arch)
    began = time.perf_counter()
    sim.advance(1)
    return {
        "nodes": sim.n_nodes,
        "stress_points": sim.stress_points,
        "fields": runtime.current().fields,
        "kernels": runtime.kernels(),
        "built": sim.compile_seconds,
        "first_step": time.perf_counter() - began,
    }


def account(scene: Scene, arch: str = "cpu", say: Callable[[str], None] = print) -> None:
    """Prints what a scene takes: fields and bytes by their kind, kernels by their module, seconds to the first step."""
    takes = requirements(scene, arch)
    say(f"{scene.title} ({scene.name}, {scene.quality}): {takes['nodes']} nodes, {takes['stress_points']} stress points")
    for title, sizes in (("fields", takes["fields"]), ("kernels", dict.fromkeys(takes["kernels"], 0))):
        kinds: dict[str, list[int]] = {}
        for name, size in sizes.items():
            kinds.setdefault(name.rpartition(".")[0], []).append(size)
        total = (
            f", {bytes_text(sum(sizes.values()))}, {sum(sizes.values()) / max(takes['nodes'], 1):.0f} B per node"
            if any(sizes.values())
            else ""
        )
        say(f"{len(sizes)} {title}{total}")
        for kind, own in sorted(kinds.items(), key=lambda entry: -sum(entry[1])):
            say(f"  {kind}: {len(own)}" + (f", {bytes_text(sum(own))}" if any(own) else ""))
    say(f"built and compiled in {duration_text(takes['built'])}, the first step in {duration_text(takes['first_step'])}")


def _python() -> Finding:
    said = f"{platform.python_version()} ({platform.system()} {platform.machine()})"
    low, high = PYTHONS
    mend = ""
    if not low <= sys.version_info[:2] <= high:
        mend = "use Python 3.11, 3.12 or 3.13: python3.12 -m venv .venv"
    elif sys.maxsize < 2**32:
        mend = "use a 64-bit Python; Taichi has no other"
    return Finding("Python", said, mend)


def _packages() -> Finding:
    missing = []
    for requirement in importlib.metadata.requires("taichi-sph") or []:
        name = requirement.split(";")[0].split(">")[0].split("<")[0].split("=")[0].strip()
        if "extra ==" in requirement:
            continue
        try:
            importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            missing.append(name)
    said = f"{', '.join(missing)} missing" if missing else "all there"
    return Finding("packages", said, "pip install -c requirements.lock -e '.[render,test]'" if missing else "")


def _apart(code: str, *arguments: str) -> tuple[bool, str]:
    """Runs a piece of Python by itself; what it printed last, or why it failed."""
    paths = [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "check.py"  # a file, for Taichi reads the source of its kernels
        script.write_text(code, encoding="utf-8")
        try:
            done = subprocess.run(
                [sys.executable, str(script), *arguments],
                capture_output=True,
                text=True,
                timeout=120,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
            )
        except subprocess.TimeoutExpired:
            return False, "no answer within 120 s"
    lines = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
    if done.returncode < 0:
        return False, f"it crashed (signal {-done.returncode})"
    return done.returncode == 0, lines[-1][:200] if lines else f"exit code {done.returncode}"


def _taichi(arch: str) -> Finding:
    well, said = _apart(TAICHI, arch)
    if well:
        return Finding(f"Taichi on {arch}", said)
    if arch != "cpu":
        return Finding(f"Taichi on {arch}", said, "install the driver of the device, or run with --arch cpu")
    return Finding("Taichi on cpu", said, "pip install --force-reinstall taichi==1.7.4 (wheels exist for 64-bit Linux, Windows, macOS)")


def _threads() -> Finding:
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    said = f"{usable} of {os.cpu_count()} usable"
    if usable < (os.cpu_count() or 1):
        return Finding("threads", said, f"run with --threads {usable}, or widen the affinity (taskset, cpuset)", needed=False)
    return Finding("threads", said)


def _pictures() -> Finding:
    well, said = _apart(PICTURE)
    mend = ""
    if not well or "installed" in said:
        mend = "pip install 'taichi-sph[render]', or run with --no-pictures"
    elif "OpenGL" in said:
        mend = "optional, pictures look almost the same: apt install libegl1 libgl1 (Debian, Ubuntu)"
    return Finding("pictures", said, mend, needed=False)


def _cache() -> Finding:
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        return Finding(
            "cache", f"{folder}: {error.strerror}", "point TAICHI_SPH_CACHE and XDG_CACHE_HOME at a folder you may write", needed=False
        )
    return Finding("cache", f"{folder} can be written")


def _disk() -> Finding:
    free = shutil.disk_usage(Path.cwd()).free
    writable = os.access(Path.cwd(), os.W_OK)
    said = f"{bytes_text(free)} free here" + ("" if writable else ", but this folder cannot be written")
    if not writable:
        return Finding("disk", said, "change to a folder of yours, or give --out", needed=False)
    return Finding("disk", said, "" if free > FREE else "free some space, or give --out on another disk", needed=False)

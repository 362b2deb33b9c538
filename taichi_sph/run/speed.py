"""How long a run takes: seconds of this machine by what there is in a scene, set right by what earlier runs took, which the user's cache
keeps."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..scene.schema import Scene

if TYPE_CHECKING:
    from .plan import Plan

# measured on two cores that other programs shared: seconds a node and step, by what the body is
RATE = {
    "plane": 0.25e-6, "free": 0.4e-6, "metal": 0.7e-6, "fluid": 1.2e-6, "trilinear": 0.3e-6, "particles": 0.9e-6, "concrete": 1.5e-6,
}  # fmt: skip
OTHER = 0.5e-6  # of kinds that are not known here
EACH, CONTACT, OVERLAP = 0.6e-3, 2e-3, 5e-3  # s a step: of each body, of contact, of a tie of elements and particles
BEGIN = 4.0  # s: Python, imports, meshes, summary
ANEW = 12.0  # s to compile what belongs to a body or coupling, for the first time
GROWTH = 1.0  # s that each growth of a patch takes; GROWTHS of them, as far as one knows
GROWTHS = 10
SAMPLE, FRAME = 6e-3, 0.02  # s to write one, and of a frame a node PER_NODE
PER_NODE = 0.4e-6
PAGE, PANEL, STILL = 14.0, 1e-4, 4.0  # s to draw a run that strikes or leaks, and each node of it; a run of shells alone
FRAME_DRAWN = 0.3  # s of a frame of its movie


@dataclass(frozen=True)
class Costs:
    """What runs like a scene took before: of stepping, writing and drawing the ratio to what is estimated here; of compiling the seconds,
    None where there was none."""

    pace: float = 1.0
    write: float = 1.0
    draw: float = 1.0
    compile: float | None = None


def couplings(scene: Scene) -> list[str]:
    """What takes time beside the bodies: contact, ties of elements and particles, water on what it wets."""
    patched = [one for one in (*scene.shells, *scene.solids) if getattr(one, "patch", None) is not None]
    touches = (
        bool(scene.rigids) or any(shell.self_contact for shell in scene.shells) or len({b.name for b in scene.bodies if not b.soft}) > 1
    )
    wetted = scene.fluids and (scene.shells or scene.rigids or scene.solids)
    return [*(["contact"] if touches else []), *(["overlap"] * len(patched)), *(["wetted"] if wetted else [])]


def stepping(scene: Scene, bodies: Any, steps: float) -> float:
    """Seconds of `steps` evaluations of the forces of planned bodies."""
    nodes = sum(body.nodes * body.rate / body.every for body in bodies)
    extra = {"contact": CONTACT, "overlap": OVERLAP, "wetted": EACH}
    return steps * (nodes + EACH * len(bodies) + sum(extra[one] for one in couplings(scene)))


def writing(scene: Scene, nodes: int, steps: int) -> float:
    """Seconds that samples and frames take."""
    frames = min(scene.output.frames, steps)
    return SAMPLE * min(scene.output.samples, steps) + frames * (FRAME + PER_NODE * nodes)


def drawing(scene: Scene, nodes: int) -> float:
    """Seconds that pictures take."""
    if scene.rigids or scene.fluids:
        return PAGE + PANEL * nodes
    return STILL + FRAME_DRAWN * min(scene.output.frames, 60) * (1 + 1e-5 * nodes)


def compiling(scene: Scene, costs: Costs) -> float:
    """Seconds to build and compile; from nothing where no run like it is known."""
    parts = len(scene.bodies) - len(scene.rigids) + len(couplings(scene)) + sum(s.patch is not None for s in scene.shells)
    grown = GROWTH * GROWTHS * sum(s.patch is not None and s.patch.grows for s in scene.shells)
    return costs.compile if costs.compile is not None else ANEW * max(parts, 1) + grown


def cache_folder() -> Path:
    """The folder for what can be lost: TAICHI_SPH_CACHE, else the user's cache folder."""
    if "TAICHI_SPH_CACHE" in os.environ:
        return Path(os.environ["TAICHI_SPH_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "taichi_sph"


def _keys(scene: Scene, arch: str) -> tuple[str, str]:
    """Of the very same scene, and of scenes that have the same in them."""
    given = ", ".join(f"{k}={v}" for k, v in sorted(scene.parameters.items()))
    laws = sorted({kind_of(body) for body in (*scene.shells, *scene.solids)} | ({"fluid"} if scene.fluids else set()))
    alike = " ".join([arch, scene.formulations, scene.numerics.precision, *laws, *sorted(set(couplings(scene)))])
    return f"{arch} {scene.name} {scene.quality} {scene.numerics.spacing:g} {given}", alike


def kind_of(body: Any) -> str:
    """What a shell or solid is, as RATE names it."""
    metal = body.material.strength is not None
    if not hasattr(body, "thickness"):
        concrete = getattr(body.material.damage, "kind", "") == "concrete"
        return "concrete" if concrete else "particles" if body.formulation.kind == "particles" else "trilinear"
    return "metal" if metal else "free" if body.motion == "free" else "plane"


def _load() -> dict[str, dict[str, float]]:
    try:
        return {k: {n: float(x) for n, x in v.items()} for k, v in json.loads((cache_folder() / "seconds.json").read_text()).items()}
    except (OSError, ValueError, AttributeError, TypeError):
        return {}  # an estimate is not worth an error


def recall(scene: Scene, arch: str) -> Costs:
    """What to expect of a run, from the same scene before, else from one that has the same in it, else from nothing."""
    known = _load()
    same, alike = _keys(scene, arch)
    found = known.get(alike, {}) | known.get(same, {})
    told = {f.name: found[f.name] for f in fields(Costs) if f.name in found and math.isfinite(found[f.name]) and found[f.name] > 0}
    return Costs(**told)


def remember(scene: Scene, arch: str, planned: Plan, took: dict[str, float]) -> None:
    """Keeps what a run took, in seconds: advance, compile, write, and draw where there were pictures. planned: without corrections."""
    estimated = {"pace": planned.seconds, "write": planned.writing, "draw": planned.drawing}
    named = {"pace": "advance", "write": "write", "draw": "draw"}
    new = {key: took[named[key]] / estimated[key] for key in named if took.get(named[key], 0.0) > 0 and estimated[key] > 0}
    if took.get("compile", 0.0) > 0:
        new["compile"] = took["compile"]
    _keep(dict.fromkeys(_keys(scene, arch), new))


def _keep(new: dict[str, dict[str, float]]) -> None:
    path, known = cache_folder() / "seconds.json", _load()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(".tmp")
        temporary.write_text(json.dumps(known | {key: known.get(key, {}) | values for key, values in new.items()}, indent=1))
        os.replace(temporary, path)
    except OSError:
        return

"""summary.json: what a run cost and what it found, against what was expected."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..scene import Quantity, Scene
from .folder import RunFolder, write_json
from .histories import write_history
from .measures import measure
from .measures.cracks import body_pattern, tip_history
from .measures.fragments import UNITS as FRAGMENT_UNITS
from .measures.fragments import write_fragments
from .record import commit, machine, scene_hash

TIP_UNITS = {"time": "s", "x_front": "m", "y_front": "m", "ahead": "m", "speed": "m/s"}


def judged(quantity: Quantity, value: float | None) -> dict[str, Any]:
    """A quantity beside its target; `met` is None where there is none."""
    met = None
    if quantity.value is not None and quantity.tolerance is not None:
        # a tolerance of 0 on a count: allow the rounding of a sum
        room = quantity.tolerance + 1e-9 * max(abs(quantity.value), abs(quantity.tolerance))
        met = value is not None and abs(value - quantity.value) <= room
    return {
        "value": value,
        "unit": quantity.unit,
        "target": quantity.value,
        "tolerance": quantity.tolerance,
        "source": quantity.source,
        "met": met,
    }


def quantity_names(scene: Scene) -> list[tuple[str, Quantity]]:
    """The quantities of a scene by name; one that is asked twice carries its options in its name."""
    names = [q.name for q in scene.quantities]
    found = []
    for quantity in scene.quantities:
        name = quantity.name
        if names.count(name) > 1:
            name += "(" + ", ".join(f"{k}={v}" for k, v in quantity.options.items()) + ")"
        found.append((name, quantity))
    return found


def measured(run: RunFolder, scene: Scene) -> dict[str, dict[str, Any]]:
    """All quantities of the scene."""
    return {name: judged(q, measure(q.name, run, q.options)) for name, q in quantity_names(scene)}


def derived(scene: Scene) -> dict[str, dict[str, str]]:
    """name -> columns with their units, of the histories that follow from the frames of a finished run."""
    cut = [shell.name for shell in scene.shells if shell.cuts and shell.material.critical_damage is not None]
    torn = [shell.name for shell in scene.shells if shell.material.critical_damage is not None]
    tips = {"crack_tip" if len(cut) == 1 else f"crack_tip_{body}": TIP_UNITS for body in cut}
    pieces = {"fragments" if len(scene.shells) == 1 else f"fragments_{body}": FRAGMENT_UNITS for body in torn}
    return tips | pieces


def write_crack_tips(run: RunFolder, scene: Scene) -> list[str]:
    """histories/crack_tip.csv (crack_tip_<body>.csv where several bodies crack); returns the names."""
    names = []
    cut = [shell.name for shell in scene.shells if shell.cuts and shell.material.critical_damage is not None]
    for body in cut:
        p = body_pattern(run, scene, body)
        tip = tip_history(p)
        if tip is None:
            continue
        name = "crack_tip" if len(cut) == 1 else f"crack_tip_{body}"
        normal = abs(p.direction[::-1])
        columns = {
            "time": tip.time,
            "x_front": p.tip[0] + tip.along * p.direction[0] + tip.across * normal[0],
            "y_front": p.tip[1] + tip.along * p.direction[1] + tip.across * normal[1],
            "ahead": tip.along,
            "speed": tip.speed,
        }
        write_history(run.path / "histories" / f"{name}.csv", TIP_UNITS, columns)
        names.append(name)
    return names


def write_summary(
    run: RunFolder,
    *,
    command: str,
    arch: str,
    threads: int,
    nodes: int,
    stress_points: int,
    steps: int,
    seconds: Mapping[str, float],
    processor: float = 0.0,
    bytes: int = 0,
    contact: Mapping[str, float] | None = None,
    overlap: Mapping[str, float] | None = None,
) -> dict[str, Any]:
    """Writes histories/crack_tip.csv, histories/fragments.csv and summary.json of a finished run.

    seconds: by name, "advance" the time loop without output and compilation. `node_steps_per_second`
    counts nodes over that time; stress points are not counted. processor: seconds of all threads in the time loop; bytes: of
    all fields. contact: what its solver reports (couplings.contact.multipliers); overlap: what ties of elements and
    particles report (couplings.arlequin.coupling).
    """
    scene = run.scene
    write_crack_tips(run, scene)
    write_fragments(run, scene)
    energies = run.history("energies")

    def largest(name: str) -> float | None:
        """Of the whole run, with its sign (T 2.110 asks for the largest), once a hundredth of the energy was given."""
        if name not in energies.columns or not len(energies):
            return None
        given = np.abs(sum(energies[k] for k in ("external", "injected") if k in energies.columns) + np.zeros(len(energies)))
        value = np.where(given >= 0.01 * given.max(), energies[name], 0.0)
        return float(value[np.argmax(np.abs(value))])

    advance = seconds.get("advance", 0.0)
    summary = {
        "scene": scene.name,
        "title": scene.title,
        "quality": scene.quality,
        "settings": {
            **scene.parameters,
            "formulation": scene.formulations,
            "spacing": scene.numerics.spacing,
            "precision": scene.numerics.precision,
            "arch": arch,
            "threads": threads,
        },
        "command": command,
        "scene_hash": scene_hash(scene),
        "commit": commit(),
        "machine": machine(),
        "nodes": nodes,
        "stress_points": stress_points,
        "steps": steps,
        "seconds": dict(seconds),
        "processor_seconds": processor,
        "bytes": bytes,
        "node_steps": nodes * steps,
        "node_steps_per_second": nodes * steps / advance if advance > 0 else None,
        "B_percent": largest("B_percent"),
        "closed_residual_percent": largest("closed_residual_percent"),
        **({} if contact is None else {"contact": dict(contact)}),
        **({} if overlap is None else {"overlap": dict(overlap)}),
        "quantities": measured(run, scene),
    }
    write_json(run.path / "summary.json", summary)
    return summary

"""The knobs of a scene, each turned by itself: which settings are worth a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ...bodies.fluid.said import Fluid
from ...errors import SceneError
from ...scene import MeshFile, Scene, Shell
from .. import sweep

BASE, THESIS, PAPER = "as it is", "thesis", "quality paper"

Settings = dict[str, Any]


def knobs(scene: Scene, options: Sequence[str] = ()) -> dict[str, Settings]:
    """name -> settings of every knob that this scene has, one at a time. options: parameters of its script.

    What several shells or fluids have each, is turned for each, and its name says whose it is.
    """
    n = scene.numerics
    formulation = "formulation" if "formulation" in options else "numerics.formulation"
    metal = any(shell.material.strength is not None for shell in scene.shells)
    found: dict[str, Settings] = {BASE: {}}
    if "quality" in options:
        found |= {f"quality {q}": {"quality": q} for q in ("draft", "standard", "paper") if q != scene.quality}
        pinballs: Settings = {f"fluids.{fluid.name}.contact": "pinballs" for fluid in scene.fluids}  # T 3.3
        if "drag" in options:
            pinballs["drag"] = 0  # no law: the water resists by them
        if scene.shells and not metal:
            found[THESIS] = {"quality": "paper", formulation: "collocation", **pinballs}
        elif necks := {f"shells.{s.name}.material.damage.necks": False for s in scene.shells if getattr(s.material.damage, "necks", False)}:
            found[THESIS] = {"quality": "paper", **necks, **pinballs}
    if not scene.shells:
        found |= {f"spacing x {f:.3g}": {key: value * f for key, value in _spacings(scene).items()} for f in (1.5, 2 / 3)}
    if any(not isinstance(shell.surface, MeshFile) for shell in scene.shells):
        found |= {f"spacing x {f:.3g}": {key: value * f for key, value in _spacings(scene).items()} for f in (2.0, 1.5, 2 / 3)}
        other = "triangle" if n.cells == "quad" else "quad"
        found[f"cells {other}"] = {"cells" if "cells" in options else "numerics.cells": other}
    if any(shell.formulation is None for shell in scene.shells):
        found |= _of_the_form([shell for shell in scene.shells if shell.formulation is None], n.formulation, formulation, "")
    for shell in scene.shells:
        if shell.formulation is not None:
            found |= _of_the_form([shell], shell.formulation, f"shells.{shell.name}.formulation", _of(scene.shells, shell))
    found["precision f32"] = {"numerics.precision": "f32"}
    bends = any(shell.motion == "free" for shell in scene.shells)
    if scene.increments is None:
        found |= {f"time_step_safety {s:g}": {"numerics.time_step_safety": s} for s in (0.5, 0.98) if s != n.time_step_safety}
        if bends and n.raised_inertia:
            found["raised_inertia off"] = {"numerics.raised_inertia": False}
    elif scene.static is not None:
        found |= {f"residual x {f:g}": {"static.residual": scene.static.residual * f} for f in (100.0, 10.0)}
    for shell in scene.shells:
        found |= _of_the_shell(scene, shell)
    if scene.rigids or (scene.fluids and scene.shells) or any(shell.self_contact for shell in scene.shells):
        found |= {f"contact tolerance {t:g}": {"numerics.contact": {"tolerance": t}} for t in (1e-2, 1e-6)}
    for fluids in _pools(scene):
        found |= _of_the_fluid(fluids, bool(scene.shells))
    return found


def _of(bodies: Sequence[Any], body: Any) -> str:
    """The end of a knob's name: whose it is, where there are several."""
    return f" of {body.name}" if len(bodies) > 1 else ""


def _spacings(scene: Scene) -> dict[str, float]:
    """Key -> spacing [m] of the scene and of the bodies that have their own: a fluid has to fit its tank."""
    own = [(f"shells.{b.name}.spacing", b) for b in scene.shells] + [(f"fluids.{b.name}.spacing", b) for b in scene.fluids]
    return {"numerics.spacing": scene.numerics.spacing} | {key: body.spacing for key, body in own if body.spacing is not None}


def _pools(scene: Scene) -> Iterator[list[Fluid]]:
    """The fluids, those that can meet together: what is turned of one has to be turned of all of them."""
    left = list(scene.fluids)
    while left:
        pool = [left.pop(0)]
        while near := [f for f in left if any(scene.met(f.name, g.name).meet for g in pool)]:
            pool += near
            left = [f for f in left if f not in near]
        yield pool


def _of_the_form(shells: Sequence[Shell], f: Any, key: str, whose: str) -> dict[str, Settings]:
    """Knobs of the formulation of some shells, and the other formulation where their materials allow it."""
    inside = "numerics.formulation" if key == "formulation" else key
    found: dict[str, Settings] = {}
    if f.kind == "elements":
        found[f"points {5 - f.points}{whose}"] = {f"{inside}.points": 5 - f.points}
        if any(shell.motion == "free" for shell in shells):
            found |= {f"shear_bound {a:g}{whose}": {f"{inside}.shear_bound": a} for a in (0.0, 0.3) if a != f.shear_bound}
        return found
    found |= {f"support {s:g}{whose}": {f"{inside}.support": s} for s in (1.0, 1.5) if s != f.support}
    if all(shell.material.strength is None for shell in shells):
        other = "collocation" if f.kind == "galerkin" else "galerkin"
        found[f"{other}{whose}"] = {key: other}
    if any(shell.motion == "free" for shell in shells):
        found |= {f"shear_bound {a:g}{whose}": {f"{inside}.shear_bound": a} for a in (0.0, 0.3) if a != f.shear_bound}
    if f.kind == "galerkin":
        return found | {f"stabilisation {g:g}{whose}": {f"{inside}.stabilisation": g} for g in (0.05, 0.5)}
    found |= {f"viscosity alpha {a:g}{whose}": {f"{inside}.viscosity.alpha": a} for a in (0.0, 0.2)}
    return found | {f"no filters{whose}": {f"{inside}.edge_filter": 0.0, f"{inside}.spin_filter": 0.0}}


def _of_the_fluid(fluids: Sequence[Fluid], wets: bool) -> dict[str, Settings]:
    """Spacing, support, viscosity and diffusion of some fluids that go together; where they wet a shell, their contact and how often they
    act. A knob starts from the first of them."""
    fluid, name = fluids[0], ", ".join(f.name for f in fluids)

    def turned(key: str, value: Any) -> Settings:
        return {f"fluids.{f.name}.{key}": value for f in fluids}

    found: dict[str, Settings] = {}
    if fluid.spacing is not None:
        found |= {f"{name} spacing x {f:g}": turned("spacing", fluid.spacing * f) for f in (1.3, 0.8)}
    found |= {f"{name} support {s:g}": turned("support", s) for s in (1.05, 1.3) if s != fluid.support}
    found |= {f"{name} alpha {a:.3g}": turned("alpha", a) for a in (fluid.alpha / 3, fluid.alpha * 3) if 0.0 < a <= 3.0}
    found |= {f"{name} delta {d:g}": turned("delta", d) for d in (0.0, 0.1) if d != fluid.delta}
    if wets:
        found |= {f"{name} every {k}": turned("every", k) for k in (1, 2, 4) if k != (fluid.every or 1)}
        if fluid.contact is None:
            found[f"{name} contact pinballs"] = turned("contact", "pinballs")
    return found


def _of_the_shell(scene: Scene, shell: Shell) -> dict[str, Settings]:
    """Layers or the global form through the thickness, the delay of damage; of one of several its own spacing, with that of what fills
    it, and its own step."""
    whose, inside = _of(scene.shells, shell), f"shells.{shell.name}.material"
    found: dict[str, Settings] = {}
    strength, delay = shell.material.strength, shell.material.delay
    if strength is not None and shell.motion == "free":
        if strength.layers is None:
            found |= {f"layers {k}{whose}": {f"{inside}.strength.kappa": 0.0, f"{inside}.strength.layers": k} for k in (3, 5)}
        else:
            found[f"global form{whose}"] = {f"{inside}.strength.layers": None}
    if delay is not None:
        found |= {f"delay x {f:g}{whose}": {f"{inside}.delay.tau_c": delay.tau_c * f} for f in (3.0, 1 / 3)}
    if whose and not isinstance(shell.surface, MeshFile):
        spacing = scene.numerics_of(shell).spacing
        found |= {f"spacing x {f:.3g}{whose}": {f"shells.{shell.name}.spacing": spacing * f} for f in (1.5, 2 / 3)}
        found |= {f"every 2{whose}": {f"shells.{shell.name}.every": 2}} if scene.increments is None and shell.every is None else {}
    return found


def together(path: Path, scene: Scene, texts: Sequence[str]) -> dict[str, Settings]:
    """name -> settings of points that turn several knobs: ['spacing=5mm,precision=f32']."""
    found = {}
    for text in texts:
        settings = {}
        for part in sweep.parts(text):
            name, equals, value = part.partition("=")
            if not equals or not name.strip() or not value.strip():
                raise SceneError(f"--also '{text}' is not of the form key=value,key=value")
            settings[sweep.setting_of(path, scene, name.strip())] = value.strip()
        found[", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in settings.items())] = settings
    return found

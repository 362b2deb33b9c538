"""A small valid scene as plain data, and how tests spoil it."""

from __future__ import annotations

import copy
from enum import Enum
from typing import Any

DELETE = Enum("Sign", "DELETE").DELETE

GOOD: dict[str, Any] = {
    "name": "small",
    "title": "A small plate",
    "source": "tests",
    "duration": "20 us",
    "numerics": {"spacing": "2 mm"},
    "shells": [
        {
            "name": "plate",
            "surface": {"kind": "plate", "length": "40 mm", "width": "20 mm"},
            "thickness": "4 mm",
            "material": {
                "name": "concrete",
                "young": "32 GPa",
                "poisson": 0.2,
                "density": 2450,
                "damage": {"threshold": 8.5e-5, "A": 1, "B": 7300},
                "delay": {"a": 10, "tau_c": "1 us"},
                "critical_damage": 0.99,
            },
            "cuts": [{"start": [0, 0.01, 0], "end": [0.02, 0.01, 0]}],
        }
    ],
    "forces": [{"shell": "plate", "where": {"kind": "box", "lo": [None, 0.019, None]}, "total": [0, 160, 0]}],
    "motions": [{"shell": "plate", "where": {"kind": "box", "hi": [None, 0.001, None]}, "velocity": [None, 0, None]}],
    "output": {"frames": 4, "samples": 8, "checkpoints": 2},
}


def spoiled(key: str = "", value: Any = None) -> dict[str, Any]:
    """GOOD with the value at a dotted key replaced, added, or (DELETE) taken away."""
    data = copy.deepcopy(GOOD)
    if not key:
        return data
    here: Any = data
    *parents, last = key.split(".")
    for part in parents:
        here = here[int(part) if isinstance(here, list) else part]
    place = int(last) if isinstance(here, list) else last
    if value is DELETE:
        del here[place]
    else:
        here[place] = value
    return data


def everything() -> dict[str, Any]:
    """What no shipped scene says: elements, holes, steps of bodies' own, driven bodies, springs, meetings, regions, histories."""
    steel = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7800.0}
    plate = {"kind": "plate", "length": 0.1, "width": 0.1, "holes": [{"centre": [0.05, 0.05, 0.0], "radius": 0.015}]}
    wall = {"kind": "plate", "length": 0.1, "width": 0.1, "origin": [0.0, 0.0, 0.05]}
    cut = {"start": [0.0, 0.052, 0.05], "end": [0.03, 0.052, 0.05]}
    edge = {"kind": "box", "lo": [None, None, None], "hi": [0.001, None, None]}
    ball = {"kind": "ball", "centre": [0.05, 0.05, 0.05], "radius": 0.02}
    pinball = {"centre": [0.05, 0.05, 0.02], "radius": 0.008}
    return {
        "name": "everything", "title": "All sorts", "source": "tests",
        "shells": [
            {"name": "low", "surface": plate, "thickness": 2e-3, "material": steel, "motion": "free", "spacing": 5e-3, "every": 2,
             "formulation": {"kind": "elements", "points": 1}},
            {"name": "high", "surface": wall, "thickness": 1e-3, "material": steel, "motion": "free", "cuts": [cut], "sound": [ball],
             "self_contact": True, "cells": "triangle", "irregularity": 0.1, "seed": 3},
        ],
        "rigids": [
            {"name": "hammer", "mass": 0.01, "pinballs": [pinball],
             "driven": {"velocity": [0, 0, -10.0], "spin": [0, 1.0, 0], "history": {"kind": "half_sine", "duration": 1e-4}}},
            {"name": "shot", "mass": 0.02, "pinballs": [{**pinball, "centre": [0.05, 0.05, 0.08]}], "velocity": [0, 0, -5.0],
             "restitution": 0.5},
        ],
        "fluids": [{"name": "water", "fill": {"kind": "box", "lo": [0.2, 0, 0], "hi": [0.24, 0.04, 0.04]}, "every": 2,
                    "water": {"law": {"kind": "tait"}}}],
        "walls": [{"point": [0.2, 0, 0], "normal": [0, 0, 1], "hole": {"centre": [0.22, 0.02, 0], "radius": 0.01}, "fluids": ["water"]}],
        "meetings": [{"between": ["hammer", "shot"], "restitution": 0.3}, {"between": ["low", "water"], "meet": False}],
        "springs": [
            {"name": "s", "between": ["low", "high"], "points": [[0.1, 0.1, 0], [0.1, 0.1, 0.05]], "stiffness": 1e4, "damping": 1.0,
             "preload": 5.0, "only": "pull", "radius": 0.01},
            {"name": "t", "between": ["shot", None], "points": [[0.05, 0.05, 0.08], [0.05, 0.05, 0.2]], "stiffness": 1e3, "length": 0.1},
        ],
        "forces": [{"body": "high", "where": {"kind": "outside", "of": ball}, "total": [0, 0, 10.0],
                    "history": {"kind": "table", "points": [[0, 0], [5e-5, 1], [1e-4, 0]]}}],
        "moments": [{"body": "low", "where": edge, "total": [0, 1.0, 0], "history": {"kind": "ramp", "rise": 1e-5}}],
        "pressures": [{"body": "high", "value": 1e4, "where": ball, "kind": "dead"}],
        "motions": [{"body": "low", "where": edge, "velocity": [0, 0, None], "spin": [0, 0, 0]}],
        "initial": [{"body": "high", "where": {"kind": "box"}, "velocity": [0, 0, 1.0]}],
        "gravity": [0, 0, -9.81], "duration": 2e-4, "numerics": {"spacing": 4e-3, "contact": {"iterations": 200}},
        "output": {"frames": 3, "samples": 10, "probes": [{"name": "p", "body": "high", "point": [0.05, 0.02, 0.05]}]},
    }  # fmt: skip


def more() -> dict[str, Any]:
    """What neither says: a patch, solids, welds, sections, gas, a rigid surface, the Riemann dissipation."""
    steel = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7800.0}
    rubber = {"name": "rubber", "young": 2e6, "poisson": 0.3, "density": 1100.0}
    copper = {
        "name": "copper",
        "young": 117e9,
        "poisson": 0.35,
        "density": 8930.0,
        "strength": {"kind": "power", "A": 118e6, "B": 484e6, "n": 0.74},
    }
    upright = {"kind": "plate", "length": 0.1, "width": 0.04, "origin": [0.0, 0.05, -0.2], "normal": [0, -1, 0], "along": [1, 0, 0]}
    return {
        "name": "more", "title": "All other sorts", "source": "tests",
        "shells": [
            {"name": "panel", "surface": {"kind": "plate", "length": 0.1, "width": 0.1}, "thickness": 2e-3, "material": steel,
             "motion": "free", "formulation": {"kind": "elements", "points": 1}, "spacing": 1e-2,
             "patch": {"where": [{"kind": "ball", "centre": [0.05, 0.05, 0.0], "radius": 0.03}], "spacing": 5e-3}},
            {"name": "base", "surface": {"kind": "plate", "length": 0.1, "width": 0.1, "origin": [0.0, 0.0, -0.2]}, "thickness": 2e-3,
             "material": steel, "motion": "free", "sections": [{"where": {"kind": "box", "lo": [0.05, None, None]}, "thickness": 1e-3}]},
            {"name": "rib", "surface": upright, "thickness": 2e-3, "material": steel, "motion": "free"},
            {"name": "balloon", "surface": {"kind": "sphere", "radius": 0.03, "origin": [0.3, 0.0, 0.0]}, "thickness": 1e-3,
             "material": rubber, "motion": "free"},
        ],
        "solids": [{"name": "bar", "shape": {"kind": "rod", "radius": 6e-3, "length": 2e-2, "origin": [0.05, 0.05, 1.2e-3]},
                    "material": copper, "spacing": 3e-3}],
        "rigids": [{"name": "die", "surface": {"kind": "sphere", "radius": 0.02, "origin": [0.05, 0.02, -0.1785]},
                    "velocity": [0, 0, -20.0], "density": 7800.0}],
        "fluids": [{"name": "water", "fill": {"kind": "box", "lo": [0.5, 0, 0], "hi": [0.54, 0.04, 0.04]}, "dissipation": "riemann",
                    "finer": [{"within": {"kind": "box", "lo": [0.52, None, None]}}]}],
        "walls": [{"point": [0.5, 0, 0], "normal": [0, 0, 1]}],
        "welds": [{"between": ["base", "rib"]}],
        "gases": [{"body": "balloon", "pressure": 1.2e5, "outside": 1e5}],
        "initial": [{"body": "bar", "velocity": [0, 0, -50.0]}, {"body": "balloon", "radial": {"speed": 1.0}}],
        "meetings": [{"between": ["panel", "water"], "meet": False}, {"between": ["bar", "water"], "meet": False}],
        "gravity": [0, 0, -9.81], "duration": 1e-4, "numerics": {"spacing": 1e-2},
        "output": {"frames": 3, "samples": 10},
    }  # fmt: skip


def at_rest(method: str) -> dict[str, Any]:
    """A plate in equilibrium, by that method."""
    scene = {key: value for key, value in everything().items() if key in ("title", "source", "shells", "motions")}
    scene["shells"] = [{key: value for key, value in scene["shells"][0].items() if key != "every"}]
    return scene | {
        "name": method, "duration": 1.0, "static": {"method": method, "increments": 4, "max_steps": 1000},
        "pressures": [{"body": "low", "value": 1e3}], "output": {"frames": 3, "samples": 10},
        "numerics": {"spacing": 4e-3},
    }  # fmt: skip

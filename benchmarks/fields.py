"""Writes docs/fields.md: every field of the package, as its pool was told what it is.

    python benchmarks/fields.py

Scenes that together ask for all kinds of bodies, formulations, laws and couplings are built, at draft, and their pools are read. One scene
alone: taichi-sph doctor --scene SCENE --fields
"""

from __future__ import annotations

from pathlib import Path

from taichi_sph.run.fields import Row, markdown, rows
from taichi_sph.scene.script import load_scene
from taichi_sph.world.world import World

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "fields.md"
METAL = {"shells.0.material.strength.kappa": 0.0, "shells.0.material.strength.layers": 3}
SCENES = (
    ("tank_leak", {"fluids.0.every": 2}),
    ("dam_break", {}),
    ("plate_perforation", METAL),
    ("crack_branching", {"formulation": "collocation"}),
    ("plate_burst", {}),
    ("piston", {"specimen": "TF", "cells": "0.8 mm", "shells.0.material.damage.spread": True}),
    ("clamped_plate", {"slenderness": 0.1, "nodes": "regular", "cells": "quad"}),
    ("arlequin_bending", {"form": "coupled"}),
    ("plate_modes", {"edges": "free", "nodes": "regular"}),
    ("clamped_plate", {"slenderness": 0.1, "nodes": "regular", "cells": "quad", "formulation": "elements"}),
    ("taylor_bar", {}),
    ("exploding_cylinder", {}),
    ("sphere_entry", {}),
    ("slab_penetration", {}),
    ("plate_perforation", METAL | {"numerics.formulation": {"kind": "elements", "points": 1}, "shells.0.material.critical_damage": None}),
)
HEAD = """# Fields

Every field of a run, by its pool. `python benchmarks/fields.py` writes this page from what the pools are told when they allocate. A scene
allocates only what it asks for; a second group of a kind has pools with a number behind their names (`nodes_2`). "Kept" fields are in a
checkpoint. "In frames" is the name that frames, and so ParaView, show.
"""


def main() -> None:
    found: list[Row] = []
    for name, settings in SCENES:
        world = World(load_scene(ROOT / "scenes" / f"{name}.py", {"quality": "draft", **settings}))
        found += rows(world.pools)
    PAGE.write_text(HEAD + markdown(found), encoding="utf-8")
    print(f"written: {PAGE}, {len({(row.pool, row.name) for row in found})} fields")


if __name__ == "__main__":
    main()

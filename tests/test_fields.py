"""Every field says what it is, and docs/fields.md shows it."""

from __future__ import annotations

from pathlib import Path

import pytest

from taichi_sph import runtime
from taichi_sph.run.fields import markdown, rows
from taichi_sph.scene.script import load_scene
from taichi_sph.world.world import World

ROOT = Path(__file__).parents[1]
SCENES = [("dam_break", {}), ("crack_branching", {}), ("plate_perforation", {})]


@pytest.mark.parametrize("scene, settings", [SCENES[0], *[pytest.param(*one, marks=pytest.mark.long) for one in SCENES[1:]]])
def test_every_field_says_what_it_is(scene, settings):
    """If the page lacks one: python benchmarks/fields.py"""
    world = World(load_scene(ROOT / "scenes" / f"{scene}.py", {"quality": "draft", **settings}), threads=1)
    found = rows(world.pools)
    assert len(found) > 20
    assert [f"{row.pool}.{row.name}" for row in found if not row.meaning] == []
    page = (ROOT / "docs" / "fields.md").read_text(encoding="utf-8")
    for row in found:
        section = page.partition(f"\n## {row.pool}\n")[2].partition("\n## ")[0]
        assert f"| `{row.name}` |" in section, f"{row.pool}.{row.name} is not in docs/fields.md"
    named = {f"{pool.name}.{name}" for pool in world.pools for name in pool.fields}
    scratch = runtime.current().fields.keys() - named
    assert all("reduce" in name or ".grid." in name for name in scratch), scratch


def test_the_table():
    runtime.start("cpu", "f64", 1)
    from taichi_sph.pool import Pool

    pool = Pool("nodes_2")
    pool.field("u", 3, 3, unit="m", doc="displacement |u|", keeps=True, shown="moved")
    text = markdown(rows([pool]))
    assert "## nodes\n" in text
    assert "| `u` | 3 | m | displacement \\|u\\| | yes | `moved` |" in text

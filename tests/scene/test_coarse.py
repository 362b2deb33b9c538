"""What the plan says of a spacing that is coarse beside a striker or a hole."""

from __future__ import annotations

from pathlib import Path

import pytest

from taichi_sph.run.plan import plan
from taichi_sph.run.progress import Progress
from taichi_sph.run.tell import tell_plan
from taichi_sph.scene import (
    Disc,
    HoleIn,
    Meeting,
    Numerics,
    Pinball,
    Rigid,
    Scene,
    Shell,
    load_scene,
    material,
)  # fmt: skip

TANK = Path(__file__).parents[2] / "scenes/empty_tank.py"


def disc(spacing: float, balls: tuple[float, ...] = (9e-3,), **more) -> Scene:
    """A steel disc of 200 mm, and balls of those radii [m] that fly at it."""
    holes = [HoleIn(centre=(0.05 - 0.1 * k, 0, 0), radius=radius) for k, radius in enumerate(more.pop("holes", ()))]
    shell = Shell(name="disc", surface=Disc(radius=0.1, holes=holes), thickness=1e-3, material=material("steel, tank"), motion="free")
    rigids = [
        Rigid(name=f"ball{k}", mass=0.03, pinballs=[Pinball(centre=(0, 0, 0.03 + 0.05 * k), radius=radius)], velocity=(0, 0, -100))
        for k, radius in enumerate(balls)
    ]
    return Scene(
        name="d", title="t", source="tests", shells=[shell], rigids=rigids, duration=1e-5, numerics=Numerics(spacing=spacing), **more
    )


@pytest.mark.parametrize(
    "given, said",
    [
        ({"spacing": 7e-3}, ["2.6 spacings over 'ball0' (18 mm): below 3", "compare with numerics.spacing = 6 mm or less"]),
        ({"spacing": 6e-3}, []),
        ({"spacing": 5e-3, "balls": (9e-3, 6e-3)}, ["over 'ball1' (12 mm)"]),
        ({"spacing": 5e-3, "balls": (9e-3, 6e-3), "meetings": [Meeting(between=("ball1", "disc"), meet=False)]}, []),
        (
            {"spacing": 5e-3, "balls": (), "holes": (0.02, 7e-3)},
            ["2.8 spacings over holes[1] (14 mm)", "numerics.spacing = 4.6 mm or less"],
        ),
        ({"spacing": 5e-3, "balls": (), "holes": (0.02,)}, []),
    ],
)
def test_fewer_than_three_spacings_are_told(given: dict, said: list[str]) -> None:
    planned = plan(disc(**given))
    assert len(planned.warnings) == bool(said)
    for words in said:
        assert words in planned.warnings[0]


def test_validate_and_run_print_it(capsys: pytest.CaptureFixture) -> None:
    scene = load_scene(TANK, {"quality": "draft", "coupled": True})
    tell_plan(scene, plan(scene), Progress())
    out = capsys.readouterr().out
    assert "beware: nodes of 'tank' are 10 mm apart" in out and "shells[0].patch.spacing = 6 mm or less" in out
    assert plan(load_scene(TANK, {"quality": "standard"})).warnings == ()


def test_what_cannot_rupture_is_not_told() -> None:
    scene = disc(0.02)
    elastic = scene.shells[0].model_copy(update={"material": scene.shells[0].material.model_copy(update={"damage": None})})
    assert plan(scene).warnings and not plan(scene.model_copy(update={"shells": (elastic,)})).warnings

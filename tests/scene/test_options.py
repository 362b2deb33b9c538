"""Options of scenes that are not the piston's: what they refuse, and what their tanks take."""

from __future__ import annotations

from pathlib import Path

import pytest

from taichi_sph.errors import SceneError
from taichi_sph.scene import Scene, load_scene

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.mark.parametrize(
    "name, wrong, said",
    [
        *(
            (f"arlequin_{of}", {"form": "coupled", "particles": "0"}, "particles = 0 must be at least 1")
            for of in ("bar", "beam", "wave", "traction", "bending")
        ),
        ("arlequin_bar", {"width": "1 mm"}, "form = 'all' chooses particles and width by itself"),
        ("arlequin_bar", {"particles": "2"}, "form = 'all' chooses particles and width by itself"),
        ("arlequin_beam", {"particles": "3"}, "form = 'all' chooses particles by itself"),
        ("arlequin_beam", {"form": "elements", "particles": "3"}, "form = 'elements' has no particles"),
        ("arlequin_wave", {"particles": "3"}, "form = 'all' chooses particles, weight, multipliers and reach by itself"),
        ("arlequin_wave", {"weight": "cubic"}, "form = 'all' chooses particles, weight, multipliers and reach by itself"),
        ("arlequin_wave", {"form": "coupled", "reach": "1"}, "reach = 1 is of T's coupling"),
        ("arlequin_traction", {"weight": "cubic"}, "form = 'all' chooses particles, weight and multipliers by itself"),
        ("arlequin_traction", {"form": "particles", "multipliers": "volume"}, "form = 'particles' ties nothing"),
        ("arlequin_bending", {"slenderness": "0.01"}, "form = 'all' chooses slenderness, weight and directors by itself"),
        ("arlequin_bending", {"directors": "false"}, "form = 'all' chooses slenderness, weight and directors by itself"),
        ("arlequin_bending", {"form": "elements", "particles": "3"}, "form = 'elements' has no particles"),
        ("empty_tank", {"up": "2"}, "spacings from the middle, each from -1 to 1"),
        ("empty_tank", {"up": "0.5", "metal": "mild"}, "leave them or metal out"),
        ("tank_leak", {"coupled": "auto", "grows": "true"}, "set coupled = True as well, or 'auto' alone"),
    ],
)
def test_an_option_that_would_be_ignored_is_refused(name, wrong, said):
    with pytest.raises(SceneError, match=said):
        load_scene(SCENES / f"{name}.py", wrong)


def test_the_width_of_a_pulse_is_taken():
    made = load_scene(SCENES / "arlequin_bar.py", {"form": "coupled", "particles": "2", "width": "1 mm"})
    assert isinstance(made, Scene) and made.initial[0].pulse.width == 1e-3
    assert made.solids[0].patch.spacing == 0.5e-3


def test_a_bullet_flies_beside_the_middle():
    middle, moved = (load_scene(SCENES / "empty_tank.py", said) for said in ({}, {"across": "0.5", "up": "-0.25"}))
    assert isinstance(middle, Scene) and isinstance(moved, Scene)
    for one, two in zip(middle.rigids[0].pinballs, moved.rigids[0].pinballs, strict=True):
        assert two.centre == pytest.approx((one.centre[0], one.centre[1] + 5e-3, one.centre[2] - 2.5e-3))


@pytest.mark.parametrize("name", ["tank_leak", "tank_leak_rate"])
def test_a_filled_tank_may_begin_without_particles(name):
    made = load_scene(SCENES / f"{name}.py", {"coupled": "auto"})
    assert isinstance(made, Scene) and made.fluids
    assert made.shells[0].patch.where == () and made.shells[0].patch.grows

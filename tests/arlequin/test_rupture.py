"""Rupture inside of a patch and outside of it."""

import pytest

from taichi_sph import runtime
from taichi_sph.errors import RunStopped
from taichi_sph.scene import Box, Delay, InitialVelocity, Mazars

from ..exact import restarts_exactly
from .scenes import patched, start, tied

CONCRETE = {
    "young": 32e9,
    "poisson": 0.2,
    "density": 2450.0,
    "damage": Mazars(threshold=8.5e-5, A=1, B=7300),
    "delay": Delay(a=10, tau_c=1e-6),
    "critical_damage": 0.99,
}


def torn_at(x: float):
    """Two halves that fly apart from x on."""
    pull = [
        InitialVelocity(body="shell", where=Box(lo=(x, None, None)), velocity=(3.0, 0, 0)),
        InitialVelocity(body="shell", where=Box(hi=(x, None, None)), velocity=(-3.0, 0, 0)),
    ]
    return patched(motion="in_plane", n=4, material=CONCRETE, initial=pull, duration=2e-3)


def test_where_elements_would_break_the_run_stops():
    sim = start(torn_at(0.21))
    with pytest.raises(RunStopped, match="its patch is too small: at .* an element would break .* let the patch reach .* farther"):
        sim.advance_to(2e-3)
    assert sim.overlap_report()["damage"] >= 0.5 and sim.status()["% of D_c outside of the patch"] >= 50


@pytest.mark.long
def test_a_crack_near_the_overlap_changes_the_constraints():
    """It breaks two particles behind the overlap, whose constraints see it; velocities stay tied, and a restart is exact."""
    sim = start(torn_at(0.55))
    before = runtime.get(tied(sim).tie.coef, 200)
    steps = 0
    while not sim.status()["broken"] and steps < 400:
        sim.advance(4)
        steps += 4
    sim.advance(20)
    assert sim.status()["broken"] and (runtime.get(tied(sim).tie.coef, 200) != before).any()
    assert tied(sim).left()[0] < 1e-12
    restarts_exactly(lambda: start(torn_at(0.55)), steps + 8, 20)

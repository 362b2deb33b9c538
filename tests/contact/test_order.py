"""Devices that run no long loop of one thread (runtime.one_by_one) put pairs in order in NumPy: as the kernels do."""

from __future__ import annotations

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.couplings.contact import multipliers
from taichi_sph.couplings.contact.pairs import FACE
from taichi_sph.scene import Material, Numerics, Pinball, Plate, Rigid, Scene, Shell
from taichi_sph.world.world import World

from .test_water import can

STEEL = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)


def struck_can() -> Scene:
    """Water in a can, a ball on it."""
    ball = Rigid(name="ball", mass=1.0, velocity=(0, 0, -10.0), pinballs=[Pinball(centre=(0, 0, 0.231), radius=0.03)])
    return can(velocity=(30.0, 0, 10.0), rigids=[ball])


def sheets() -> Scene:
    """Two sheets that touch, of quadrangles and of triangles, and a ball on the upper one."""
    ball = Rigid(name="ball", mass=0.1, velocity=(0, 0, -10.0), pinballs=[Pinball(centre=(0.02, 0.02, 0.0135), radius=0.01)])
    shells = [
        Shell(
            name=name, surface=Plate(length=0.04, width=0.04, origin=(0, 0, z)), thickness=2e-3, material=STEEL, motion="free",
            cells=cells,
        )
        for name, z, cells in (("low", 0.0, "quad"), ("high", 0.0021, "triangle"))
    ]  # fmt: skip
    return Scene(name="sheets", title="s", source="tests", shells=shells, rigids=[ball], duration=1e-4, numerics=Numerics(spacing=5e-3))


@pytest.mark.parametrize("scene", [pytest.param(struck_can, marks=pytest.mark.long), sheets])
def test_pairs_are_put_in_order_in_numpy_as_in_the_kernel(scene, monkeypatch):
    sim = World(scene())
    sim.advance(5)
    pairs, port = sim.contact.pairs, sim.contact.port

    def listed():
        pairs.list_movers()
        n, who = pairs.n, pairs.n_who
        lengths = {"first": who + 1, "part": who, "a": n, "b": n, "root": port.n_bodies}
        found = {name: runtime.get(getattr(pairs, name), length).tolist() for name, length in lengths.items()}
        found["entry"] = runtime.get(pairs.entry, found["first"][-1]).tolist()
        if port.thin:
            found["corner"] = runtime.get(pairs.corner, n)[runtime.get(pairs.sort, n) == FACE].tolist()
        movers = {name: runtime.get(getattr(port, name), who).tolist() for name in ("who", "whose")}
        return found | movers | {"n": who, "bounds": np.asarray(pairs.bounds).tolist(), "turning": port.turning}

    def dropped(body):
        pairs._drop(np.array([body]))
        return [runtime.get(getattr(pairs, name), pairs.n).tolist() for name in ("ball", "other", "sort", "p")]

    def acting(list_acting):
        n = list_acting()
        moved = int(runtime.get(sim.contact.count, 2)[1])
        return n, runtime.get(sim.contact.acting, n).tolist(), runtime.get(sim.contact.moved, moved).tolist()

    runtime.put(pairs.near, (np.arange(pairs.n) % 3 == 0).astype(np.int32))
    runtime.put(sim.contact.met, (np.arange(pairs.n_who) % 4 != 1).astype(np.int32))
    by_kernel = acting(lambda: multipliers._list_acting(sim.contact))
    assert 0 < by_kernel[0] < pairs.n / 3
    assert acting(sim.contact._list_acting) == by_kernel

    state, body = sim.state(), port.names.index("ball")
    by_kernel = listed()
    assert by_kernel["n"] > 100 and set(by_kernel["root"]) == {0} and by_kernel.get("corner", True)
    kept_by_kernel = dropped(body)
    assert 0 < len(kept_by_kernel[0]) < len(by_kernel["a"])
    sim.restore(state)
    monkeypatch.setattr(runtime, "one_by_one", lambda: False)
    assert listed() == by_kernel
    assert dropped(body) == kept_by_kernel
    pairs.n = 0
    assert listed()["n"] == 0

"""What lies inside a body that may break is shown to the search, and must not cost it anything."""

import pytest

from taichi_sph import runtime
from taichi_sph.couplings.contact.pairs import _looks
from taichi_sph.numerics.cells import CUBES, beside
from taichi_sph.runtime import ti
from taichi_sph.scene import Brick, Concrete, Delay, Material, Numerics, Scene, Solid
from taichi_sph.world.world import World


@ti.kernel
def _tried(count: ti.template(), pairs: ti.template(), n: ti.i32, inverse: ti.f64, table: ti.i32):
    """Faces that each node which looks for some finds in the buckets around it."""
    for d in range(n):
        count[d] = 0
        if _looks(pairs, d) == 1:
            for k in range(CUBES):
                _, first, last = beside(pairs.face_grid, pairs.port.ball_x[pairs.port.n_many + d], k, inverse, table)
                count[d] += last - first


@pytest.mark.parametrize("spacing", [1e-2, 2e-5])
def test_what_is_not_met_costs_nothing_at_any_scale(spacing):
    """Nodes and faces inside two blocks that may break are put far away. Below a reach of 0.47 mm the cube of that place has no number, and
    all of them would be in one: half a million tries, where those of the surface are some thousand."""
    concrete = Material(name="concrete", young=10e9, poisson=0.2, density=2300.0, damage=Concrete(tension=2e6, compression=12e6, B=3100.0),
                        delay=Delay(a=1, tau_c=1e-3 * spacing), critical_damage=0.9)  # fmt: skip
    side = 8 * spacing
    blocks = [
        Solid(name=name, shape=Brick(size=(side,) * 3, origin=(0, 0, low)), material=concrete)
        for name, low in (("above", 0.01 * spacing), ("below", -side))
    ]
    world = World(
        Scene(name="b", title="B", source="tests", solids=blocks, duration=1e-3 * spacing, numerics=Numerics(spacing=spacing)), threads=1
    )
    world.advance(1)
    pairs = world.contact.pairs
    n, grid = pairs.port.n_discs + pairs.port.n_points, pairs.face_grid
    count = ti.field(ti.i32, n)
    _tried(count, pairs, n, 1.0 / grid.reach, grid.table)
    inside = 2 * 7**3
    tried = runtime.get(count, n)
    assert n == 2 * 9**3 and (tried == 0).sum() >= inside and (tried > 0).sum() >= 9 * 9
    assert tried.sum() < 300 * (n - inside), f"{tried.sum()} faces are tried"
    assert world.contact.report() is not None and pairs.n > 0

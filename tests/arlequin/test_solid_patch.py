"""Patch tests: an even strain is the answer of a solid in parts, wherever its cells stand and however skew they are."""

import numpy as np
import pytest

from taichi_sph.scene import Ball

from ..solids import start
from .scenes import tied
from .solids import BAR, INSIDE, answer, gradients, patched, skew

CASES = {
    "through a bar": BAR,
    "inside": INSIDE,
    "skew, inside": (skew((5, 5, 5)), (Ball(centre=(3.5, 2.2, 2.25), radius=0.4),)),
}
ANY = np.random.default_rng(1).standard_normal((3, 3))
STRETCH = np.array([[1.0, 0.3, -0.5], [-0.3, 0.0, 0.7], [0.5, -0.7, 0.0]])  # along the bar, and a turn


def missed(where: str, spoil=None) -> float:
    """Largest error of the gradients of elements and particles, over 1, where nodes are held at a linear field: those of the rim of a body
    with the patch inside; those of both ends of a bar, whose sides are free, for it is stretched alone and its nu is 0."""
    bar = where == "through a bar"
    coupling = tied(start(patched(*CASES[where], material={"poisson": 0.0} if bar else None)))
    if spoil is not None:
        spoil(coupling)
    X = [group.mesh.points for group in coupling.groups]
    split, wanted = coupling.split, STRETCH if bar else ANY
    on_rim = np.zeros(len(split.whole.points), bool)
    on_rim[split.whole.faces.nodes[split.whole.skin]] = True
    held = np.flatnonzero(on_rim[split.nodes]), np.zeros(0, int)
    if bar:  # moving least squares do not interpolate near the end
        held = np.flatnonzero(X[0][:, 0] < 1e-9), np.flatnonzero(X[1][:, 0] > 8 - 2.45 * split.spacing)
    found = answer(coupling, held, tuple(x @ wanted.T for x in X))
    return max(float(np.abs(gradients(group, u) - wanted).max()) for group, u in zip(coupling.groups, found))


@pytest.mark.parametrize("where", CASES)
def test_even_strains(where):
    assert missed(where) < 1e-10


def test_a_coupling_that_forgets_a_face_is_found_out():
    """Of one face of particles less the answer is wrong by more than a percent."""

    def spoil(coupling):
        split = coupling.split
        split.jumps[np.flatnonzero(split.jumps)[0]] = 0.0
        coupling.factor = coupling.factorised()

    assert missed("inside", spoil) > 1e-2


def test_constraints_do_not_see_linear_fields():
    """C (1, X) = 0 to rounding on skew cells: no rigid motion is held back. L is the factor of H."""
    coupling = tied(start(patched(*CASES["skew, inside"])))
    rows = coupling.factor.rows
    X = [np.column_stack([np.ones(len(g.mesh.points)), g.mesh.points]) for g in coupling.groups]
    assert np.abs(rows(*X)).max() < 1e-13 * np.abs(rows.elements).sum(axis=1).max() * 5
    H = rows.elements @ (rows.elements.T / coupling.mass[0][:, None]) + rows.particles @ (rows.particles.T / coupling.mass[1][:, None])
    assert np.abs(coupling.factor.dense @ coupling.factor.dense.T - H).max() < 1e-12

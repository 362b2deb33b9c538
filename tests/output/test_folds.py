"""The length of folds, on a tube that is folded by hand."""

import numpy as np
import pytest

from taichi_sph.output.measures.folds import fold_length, outward_rings

from .test_expansion import HEIGHT, RADIUS, SCENE, THICKNESS, frame, run_of


def folded(length: float, first: float, high: float = 2 * THICKNESS):
    """A run that ends with rings of that length over its whole tube, the first one that points outward at z = first."""
    return run_of([frame(lambda z: RADIUS + high * np.cos(2 * np.pi * (z - first) / length), 0.0, 0.0)], [0.0])


@pytest.mark.parametrize("length, first", [(0.05, 0.025), (0.0471, 0.0219), (0.08, 0.027)])
def test_the_length_of_folds_lies_between_nodes(length, first):
    run = folded(length, first)
    rings = outward_rings(run, SCENE)
    assert len(rings) == len(np.arange(first, HEIGHT, length)) and rings == pytest.approx(
        np.arange(first, HEIGHT, length), abs=0.05 * length
    )
    assert fold_length(run, SCENE) == pytest.approx(length, rel=0.03)


def test_a_straight_tube_between_two_stacks_does_not_count():
    def radius(z):
        folds = np.cos(2 * np.pi * (z - 0.02) / 0.04)
        return RADIUS + 2 * THICKNESS * np.where((z < 0.08) | (z > 0.12), folds, -1.0)

    run = run_of([frame(radius, 0.0, 0.0)], [0.0])
    assert np.diff(outward_rings(run, SCENE)) == pytest.approx([0.04, 0.08, 0.04], rel=5e-3)
    assert fold_length(run, SCENE) == pytest.approx(0.04, rel=5e-3)


def test_a_dimple_in_a_crest_is_no_fold():
    """5 % of a thickness deep, on the middle ring."""

    def radius(z):
        dimple = 0.05 * THICKNESS * np.exp(-(((z - 0.1) / 0.005) ** 2))
        return RADIUS + 2 * THICKNESS * np.cos(2 * np.pi * (z - 0.05) / 0.05) - dimple

    assert fold_length(run_of([frame(radius, 0.0, 0.0)], [0.0]), SCENE) == pytest.approx(0.05, rel=0.05)


def test_fewer_than_two_rings_have_no_length():
    assert fold_length(folded(0.5, 0.1), SCENE) is None
    assert fold_length(folded(0.05, 0.025, high=0.9 * THICKNESS), SCENE) is None

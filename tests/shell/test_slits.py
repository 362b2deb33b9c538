"""Slits of zero width in a mesh from a file: the lips part, and a slit along the load changes nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Box, Collocation, Galerkin, Material, MeshFile, Numerics, PrescribedVelocity, Scene, Shell
from taichi_sph.world.world import World

from ..geometry.writers import obj

N, D = 12, 0.01


def slit_plate(folder: Path) -> tuple[Path, np.ndarray, np.ndarray]:
    """A plate of N x N quadrangles, slit from x = 0 to its middle along y = middle: file, nodes of the lower lip, of the upper one."""
    x, y = np.meshgrid(np.arange(N + 1.0), np.arange(N + 1.0), indexing="ij")
    points = D * np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    k = np.arange((N + 1) ** 2).reshape(N + 1, N + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    low = k[: N // 2, N // 2]
    high = len(points) + np.arange(len(low))
    twin = dict(zip(low.tolist(), high.tolist()))
    upper = points[quads].mean(axis=1)[:, 1] > points[low[0], 1]
    quads[upper] = [[twin.get(c, c) for c in q] for q in quads[upper].tolist()]
    path = folder / "slit.obj"
    path.write_bytes(obj(np.vstack([points, points[low]]), quads))
    return path, low, high


def pulled(path: Path, axis: int, merge: bool, formulation: Galerkin | Collocation) -> tuple[np.ndarray, float]:
    """Displacements (N, dim) and elastic energy after the ends along an axis have parted with 1 m/s each."""
    velocity = [(s if axis == 0 else None, s if axis == 1 else None, None) for s in (-1.0, 1.0)]
    near, far = [None, None, None], [None, None, None]
    near[axis], far[axis] = 0.1 * D, (N - 0.1) * D
    ends = [
        PrescribedVelocity(shell="p", where=Box(hi=tuple(near)), velocity=velocity[0]),
        PrescribedVelocity(shell="p", where=Box(lo=tuple(far)), velocity=velocity[1]),
    ]
    steel = Material(name="steel", density=7800, young=2e11, poisson=0.0)
    shell = Shell(name="p", surface=MeshFile(path=path, merge=merge), thickness=2e-3, material=steel, motion="in_plane")
    numerics = Numerics(spacing=D, formulation=formulation)
    scene = Scene(name="s", title="t", source="tests", shells=[shell], motions=ends, duration=5e-5, numerics=numerics)
    world = World(scene, threads=1)
    world.advance_to(5e-5)
    nodes = world.groups[0].nodes
    return runtime.get(nodes.u, nodes.n), world.energies()["elastic"]


@pytest.mark.parametrize("formulation", [Galerkin(), pytest.param(Collocation(), marks=pytest.mark.long)], ids=lambda f: f.kind)
def test_the_lips_of_a_slit_part(tmp_path, formulation):
    path, low, high = slit_plate(tmp_path)
    u, energy = pulled(path, 1, False, formulation)
    opening = u[high, 1] - u[low, 1]
    assert (opening > 0.4 * 1e-4).all()  # of 0.1 mm between the ends
    assert np.allclose(u[high, 1], -u[low, 1], rtol=1e-6, atol=1e-12) and np.allclose(u[high, 0], u[low, 0], rtol=1e-6, atol=1e-12)
    merged, stiff = pulled(path, 1, True, formulation)
    assert np.abs(merged[low, 1]).max() < 1e-12 and energy < 0.8 * stiff
    along = [pulled(path, 0, merge, formulation) for merge in (False, True)]
    assert along[0][1] == pytest.approx(along[1][1], rel=1e-3)
    assert np.abs(along[0][0][: len(merged), 0] - along[1][0][:, 0]).max() < 3e-6  # of 0.1 mm: what a free border makes of a wave

"""Packets that cross the overlap: how much energy comes back (COUPLING 4: at most 1e-3 at 10 elements a wave, 6e-3 at 6)."""

import numpy as np
import pytest

from taichi_sph import runtime
from taichi_sph.scene import Box, Plate

from .scenes import of_nodes, patched, start, tied


def thrown_back(waves: float, from_elements: bool, n: int = 5, **more) -> float:
    """Share of the energy of a packet of `waves` elements a wave that stays on its side of a strip."""
    wide = 1.5 * waves
    half = round(6 * wide)  # elements on either side
    surface, where = Plate(length=2 * half, width=1.0), (Box(lo=(half, None, None)),)
    sim = start(patched(surface, where, 1.0, n, motion="in_plane", thickness=1.0, material={"poisson": 0.0}, duration=1.0, **more))
    coupling, sound = tied(sim), float(sim.groups[0].sound.min())
    k, way = 2 * np.pi / waves, 1.0 if from_elements else -1.0
    middle = half - 3 * way * wide
    pace = sound * (np.sin(k / 2) / (k / 2) if from_elements else 1.0)  # of the lattice of elements
    for group in sim.groups:
        s = group.mesh.points[:, 0] - middle
        envelope = 1e-7 * np.exp(-((s / wide) ** 2))
        u, v = np.zeros((2, len(s), 2))
        u[:, 0] = envelope * np.sin(k * s)
        v[:, 0] = -way * pace * envelope * (k * np.cos(k * s) - 2 * s / wide**2 * np.sin(k * s))
        runtime.put(group.nodes.u, u)
        runtime.put(group.nodes.v, v)
    sim.look = lambda: None  # nobody gave the energy of these displacements, so the watchdog would find too much
    whole = sum(float((of_nodes(group, "mass")[:, None] * of_nodes(group, "v") ** 2).sum()) for group in sim.groups)
    sim.advance_to(6.0 * wide / pace)
    own = coupling.elements if from_elements else coupling.particles
    mass, v, x = of_nodes(own, "mass"), of_nodes(own, "v"), own.mesh.points[:, 0]
    here = x < half - 1.5 if from_elements else x > half + 1.5
    return float((mass[here, None] * v[here] ** 2).sum()) / whole


@pytest.mark.long
def test_packets():
    """From elements to particles and back; T's constraints beside."""
    found = {(waves, way): thrown_back(waves, way) for waves in (10.0, 6.0) for way in (True, False)}
    print(found, "linear:", thrown_back(6.0, True, weight="linear"), "T:", thrown_back(6.0, True, weight="linear", multipliers="volume"))
    assert max(found[10.0, True], found[10.0, False]) < 1e-3
    assert max(found[6.0, True], found[6.0, False]) < 6e-3

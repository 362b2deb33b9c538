"""Strain gauges of shells: the nominal strain of a surface along a direction, as one glued there reads it.

At the height z over the mid-surface the strains of stress.py give, along a unit direction a of the reference,

    E(z) = E + z kappa,        strain = sqrt(1 + 2 E(z)) - 1

The part of z^2 is left out, as in the law. Of a metal, too, these are the strains of the mid-surface so far, elastic and plastic.
NumPy only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import runtime
from ...scene.kept import StrainGauge
from .build import ShellBody

SIDES = {"outer": 0.5, "middle": 0.0, "inner": -0.5}  # height over the mid-surface, in thicknesses
LEAST = 1e-3  # part of a direction that must lie in a cell


class Gauge:
    """One gauge on one body. rows (K,): its stress points; weight (K,): their areas; along (K, 2): its direction in the frames of the
    points; height (K,) [m] over the mid-surface."""

    units = {"strain": "-", "membrane": "-", "bending": "-"}

    def __init__(self, points: Any, body: ShellBody, said: StrainGauge):
        """points: the pool of stress points of the group."""
        mesh, per = body.mesh, body.points.n // body.cells.n
        of_points = runtime.get(points.area, points.n)[body.points.first : body.points.first + body.points.n].astype(np.float64)
        counts = of_points.reshape(-1, per).sum(axis=1) > 0  # of a shell in parts: where this one bears
        away = np.where(counts, np.linalg.norm(mesh.centres - np.asarray(said.point), axis=1), np.inf)
        cells = np.flatnonzero(away <= 0.5 * (said.length or 0.0))
        if not len(cells):
            cells = np.array([np.argmin(away)])
        self.name, self.points = f"gauge_{said.name}", points
        self.away = float(away.min())  # m
        self.rows = body.points.first + (cells[:, None] * per + np.arange(per)).ravel()
        tangents = np.stack([self._of(points.a1), self._of(points.a2)], axis=1).astype(np.float64)  # (K, 2, dim)
        within = np.einsum("kad,d->ka", tangents, np.asarray(said.along, float)[: tangents.shape[2]])
        length = np.linalg.norm(within, axis=1, keepdims=True)
        self.flat = bool((length > LEAST * np.linalg.norm(said.along)).all())
        self.along = within / np.maximum(length, 1e-300)
        self.weight = self._of(points.area).astype(np.float64)
        thickness = np.asarray(body.made.thickness, float) * np.ones(body.cells.n)
        self.height = SIDES[said.side] * np.repeat(thickness[cells], per)

    def _of(self, field: Any) -> np.ndarray:
        return runtime.get(field, self.points.n)[self.rows]

    def read(self) -> dict[str, float]:
        """Of the surface, and its parts: that of the mid-surface, and what bending adds. nan once all its cells are broken."""
        g, (c, s) = self._of(self.points.strain).astype(np.float64), self.along.T
        shape = np.stack([c * c, s * s, c * s], axis=1)
        middle = np.einsum("ka,ka->k", shape, g[:, :3])
        bent = self.height * np.einsum("ka,ka->k", shape, g[:, 3:6]) if g.shape[1] > 3 else np.zeros(len(g))
        weight = self.weight * (self._of(self.points.broken) == 0)
        if not weight.any():
            return dict.fromkeys(self.units, float("nan"))
        membrane, whole = (
            float(np.average(np.sqrt(np.maximum(1.0 + 2.0 * e, 0.0)) - 1.0, weights=weight)) for e in (middle, middle + bent)
        )
        return {"strain": whole, "membrane": membrane, "bending": whole - membrane}

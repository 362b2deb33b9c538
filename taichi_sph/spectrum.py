"""In-plane frequencies of a free square plate, beside those of the finite-element method on the same nodes.

A spectrum shows what a count of zero modes hides: soft spurious modes, that is flexible modes far below the
lowest physical one. The stiffness is read off the running force kernels, column by column, so it is the
operator that the time loop uses. Both methods have the same lumped masses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .model.mesh import SurfaceMesh
from .scene.schema import Plate, Scene

RIGID = 3  # translations and the rotation in the plane
SOFT = 0.5  # a mode is soft when its frequency is below this part of the finite elements' of the same number


@dataclass(frozen=True)
class Spectrum:
    """Frequencies [Hz], ascending, rigid ones left out: ours, the finite elements' on the same nodes
    (triangles where the cells are, else bilinear quadrangles), and a fine mesh's as what is true.
    `rigid`: our modes below 1e-3 of the first true frequency. `growth`: largest |imaginary / real| part of omega.
    `step`: the critical time step, in D/c with c = sqrt(E/rho). `shapes` (count, N, 2): the modes of `ours`, largest
    displacement 1; `mesh`: what they live on."""

    ours: np.ndarray
    elements: np.ndarray
    fine: np.ndarray
    rigid: int
    growth: float
    step: float
    shapes: np.ndarray
    mesh: SurfaceMesh

    @property
    def soft(self) -> int:
        """How many of our modes are far below the elements' of the same number."""
        n = min(len(self.ours), len(self.elements))
        return int((self.ours[:n] < SOFT * self.elements[:n]).sum()) + max(0, self.rigid - RIGID)


def square(scene: Scene, cells: int) -> Scene:
    """The scene's material and numerics on a free square plate of `cells` x `cells`, no load, no cut, no damage."""
    shell = scene.shells[0]
    side = cells * scene.numerics.spacing
    material = shell.material.model_copy(update={"damage": None, "delay": None, "critical_damage": None})
    plate = shell.model_copy(
        update={
            "surface": Plate(length=side, width=side),
            "material": material,
            "motion": "in_plane",
            "cuts": (),
            "thickness": min(shell.thickness, side),
        }
    )
    nothing = {"forces": (), "moments": (), "pressures": (), "gravity": None, "motions": (), "initial": (), "quantities": (), "static": None}
    return scene.model_copy(update={"shells": (plate,), **nothing})


def stiffness(sim) -> np.ndarray:
    """(2N, 2N) tangent of the internal forces at rest [N/m], by one small displacement per column."""
    from . import runtime

    nodes = sim.nodes
    n, dim = nodes.n, nodes.dim
    size = (1e-4 if sim.scene.numerics.precision == "f32" else 1e-7) * sim.spacing
    rest = runtime.get(nodes.u, n)

    def forces(u: np.ndarray) -> np.ndarray:
        runtime.put(nodes.u, u.astype(rest.dtype))
        sim.internal.strain(0.0, intact=1)
        sim.internal.force()
        return runtime.get(nodes.force, n).astype(np.float64).ravel()

    K = np.empty((n * dim, n * dim))
    for column in range(n * dim):
        u = np.zeros(n * dim)
        u[column] = size
        K[:, column] = -(forces(u.reshape(n, dim)) - forces(-u.reshape(n, dim))) / (2 * size)
    runtime.put(nodes.u, rest)
    return K


def element_stiffness(mesh: SurfaceMesh, young: float, poisson: float, thickness: float):
    """Sparse (2N, 2N) plane-stress stiffness [N/m]: constant-strain triangles, bilinear quadrangles (2 x 2 points)."""
    from scipy.sparse import coo_array

    C = young / (1 - poisson**2) * np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])
    rows, columns, values = [], [], []
    for cell, corners in zip(mesh.cells, mesh.corners):
        nodes = cell[:corners]
        x = mesh.points[nodes, :2]
        k = np.zeros((2 * corners, 2 * corners))
        for slopes, weight in _points(x):
            B = np.zeros((3, 2 * corners))
            B[0, 0::2] = B[2, 1::2] = slopes[:, 0]
            B[1, 1::2] = B[2, 0::2] = slopes[:, 1]
            k += weight * thickness * B.T @ C @ B
        dofs = np.stack([2 * nodes, 2 * nodes + 1], axis=1).ravel()
        rows.append(np.repeat(dofs, len(dofs)))
        columns.append(np.tile(dofs, len(dofs)))
        values.append(k.ravel())
    size = 2 * len(mesh.points)
    return coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(size, size)).tocsc()


def _points(x: np.ndarray):
    """Gradients of the shape functions (corners, 2) [1/m] and weights [m2] at the integration points."""
    if len(x) == 3:
        slopes = np.linalg.solve(np.column_stack([np.ones(3), x]).T, np.array([[0, 0], [1, 0], [0, 1]]))
        area = 0.5 * abs(np.linalg.det(np.column_stack([np.ones(3), x])))
        yield slopes, area
        return
    g = 1 / np.sqrt(3)
    for r, s in ((-g, -g), (g, -g), (g, g), (-g, g)):
        d = 0.25 * np.array([[-(1 - s), -(1 - r)], [1 - s, -(1 + r)], [1 + s, 1 + r], [-(1 + s), 1 - r]])
        J = d.T @ x
        yield d @ np.linalg.inv(J).T, abs(np.linalg.det(J))


def _lowest(K, mass: np.ndarray, count: int) -> np.ndarray:
    """Lowest `count` flexible frequencies [Hz] of a symmetric sparse stiffness and lumped masses (one per node)."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import eigsh

    scale = diags_array(np.repeat(1 / np.sqrt(mass), 2))
    A = (scale @ K @ scale).tocsc()
    shift = -1e-6 * A.diagonal().max()  # beside the zero modes, which are singular
    values = eigsh(A, k=min(count + RIGID, A.shape[0] - 2), sigma=shift, which="LM", return_eigenvectors=False)
    return np.sqrt(np.sort(values)[RIGID:].clip(0)) / (2 * np.pi)


def compare(scene: Scene, cells: int = 12, count: int = 12, simulation: Callable | None = None) -> Spectrum:
    """The spectrum of the scene's formulation on a free square plate."""
    from .model.mesh import plate as plate_mesh
    from .solver.simulation import Simulation

    plain = square(scene, cells)
    sim = (simulation or Simulation)(plain)
    shell, m = plain.shells[0], plain.shells[0].material
    area_mass = shell.thickness * m.density
    mass = sim.mesh.node_areas * area_mass
    root = np.repeat(1 / np.sqrt(mass), 2)
    A = root[:, None] * stiffness(sim) * root[None, :]
    if plain.numerics.formulation.kind == "galerkin":
        values, vectors = np.linalg.eigh(0.5 * (A + A.T))
        values = values.astype(complex)
    else:
        values, vectors = np.linalg.eig(A)
    order = np.argsort(values.real)
    omega, vectors = np.sqrt(values[order]), vectors.real[:, order] * root[:, None]
    side = shell.surface.length
    fine = plate_mesh(side, side, side / (4 * cells), "quad")
    true = _lowest(element_stiffness(fine, m.young, m.poisson, shell.thickness), fine.node_areas * area_mass, count)
    elements = _lowest(element_stiffness(sim.mesh, m.young, m.poisson, shell.thickness), mass, count)
    hertz = omega / (2 * np.pi)
    still = np.abs(hertz) < 1e-3 * true[0]
    moving, vectors = hertz[~still], vectors[:, ~still]
    # a negative eigenvalue is a mode that grows: it counts as frequency 0, below everything
    ours = np.where(moving.real > np.abs(moving.imag), moving.real, 0.0)
    first = np.argsort(ours, kind="stable")[:count]
    shapes = vectors[:, first].T.reshape(len(first), -1, 2)
    shapes = shapes / np.linalg.norm(shapes, axis=2).max(axis=1)[:, None, None]
    growth = float(np.max(np.abs(moving.imag) / np.maximum(np.abs(moving.real), 1e-12), initial=0.0))
    step = float(2 / np.abs(omega).max() * np.sqrt(m.young / m.density) / sim.mesh.spacing)
    return Spectrum(ours[first], elements, true, int(still.sum()), growth, step, shapes, sim.mesh)


# what the table compares: formulation, cells, irregularity
VARIANTS = (
    ("galerkin", "quad", 0.0),
    ("galerkin", "quad", 0.25),
    ("galerkin", "triangle", 0.0),
    ("galerkin", "triangle", 0.25),
    ("collocation", "quad", 0.0),
    ("collocation", "quad", 0.25),
)


def variants(scene: Scene, cells: int = 12, count: int = 12) -> dict[tuple[str, str, float], Spectrum]:
    """The spectrum of every variant on the scene's material and spacing; the scene's own formulation keeps its numbers."""
    found = {}
    for kind, shape, irregularity in VARIANTS:
        own = scene.numerics.formulation
        changed = scene.derive(
            **{
                "numerics.formulation": own if own.kind == kind else kind,
                "numerics.cells": shape,
                "numerics.irregularity": irregularity,
            }
        )
        found[kind, shape, irregularity] = compare(changed, cells, count)
    return found


def main(scene: Scene, cells: int, count: int, picture: Path | None = None) -> None:
    """Prints the table of the variants and the modes of the scene's own; draws the lowest ones into `picture`."""
    n = scene.numerics
    print(f"free square plate, {cells} x {cells} cells; frequencies over those of finite elements on the same nodes")
    print("formulation  cells     irregular  zero modes  soft   lowest  least of all  growth  critical step [D/c]")
    for (kind, shape, irregularity), s in variants(scene, cells, count).items():
        ratio = s.ours / s.elements[: len(s.ours)]
        print(
            f"{kind:12s} {shape:8s} {irregularity:10.2f} {s.rigid:11d} {s.soft:5d} {ratio[0]:8.3f} {ratio.min():13.3f}"
            f" {s.growth:7.1e} {s.step:20.3f}"
        )
    s = compare(scene, cells, count)
    print(f"\nthe scene's own: {n.formulation.kind}, {n.cells}, irregularity {n.irregularity:g}, support {n.formulation.support:g}")
    print("mode   ours [kHz]   elements [kHz]   fine mesh [kHz]   ours/elements   ours/fine")
    for i, (ours, elements, fine) in enumerate(zip(s.ours, s.elements, s.fine)):
        print(
            f"{i + 1:4d} {ours / 1e3:12.4f} {elements / 1e3:16.4f} {fine / 1e3:17.4f} {ours / elements:15.4f} {ours / fine:11.4f}"
        )
    print(f"zero modes {s.rigid} (expected {RIGID}), soft spurious modes {s.soft}, critical step {s.step:.3f} D/c")
    if picture is not None:
        from .render.modes import draw

        draw(picture, s.mesh, s.shapes[:6], [f"{f / 1e3:.2f} kHz" for f in s.ours[:6]])
        print(f"drawn: {picture}")

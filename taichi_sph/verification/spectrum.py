"""Frequencies of a free square plate in its plane, and of a free curved patch that bends, beside those of the
finite-element method on the same nodes.

A spectrum shows what a count of zero modes hides: soft spurious modes, that is flexible modes far below the
lowest physical one. The stiffness is read off the running force kernels, column by column, so it is the
operator that the time loop uses. Both methods have the same lumped masses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry.mesh import SurfaceMesh
from ..scene import Plate, Scene
from ..scene.surfaces import Cylinder
from .elements import element_stiffness, shell_stiffness

RIGID = 3  # translations and the rotation in the plane
RIGID_BENT = 6
SLENDERNESS = 50  # side over thickness of the curved patch
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
    nothing = {
        "forces": (),
        "moments": (),
        "pressures": (),
        "gravity": None,
        "motions": (),
        "initial": (),
        "quantities": (),
        "static": None,
    }
    return scene.model_copy(update={"shells": (plate,), **nothing})


def stiffness(sim: Any) -> np.ndarray:
    """(2N, 2N) tangent of the internal forces at rest [N/m], by one small displacement per column."""
    from .. import runtime

    nodes = sim.shell.nodes
    n, dim = nodes.n, nodes.dim
    size = (1e-4 if sim.scene.numerics.precision == "f32" else 1e-7) * sim.shell.spacing
    rest = runtime.get(nodes.u, n)

    def forces(u: np.ndarray) -> np.ndarray:
        runtime.put(nodes.u, u.astype(rest.dtype))
        sim.shell.internal.strain(0.0, intact=1)
        sim.shell.internal.force()
        return runtime.get(nodes.force, n).astype(np.float64).ravel()

    K = np.empty((n * dim, n * dim))
    for column in range(n * dim):
        u = np.zeros(n * dim)
        u[column] = size
        K[:, column] = -(forces(u.reshape(n, dim)) - forces(-u.reshape(n, dim))) / (2 * size)
    runtime.put(nodes.u, rest)
    return K


def _lowest(K: Any, mass: np.ndarray, count: int) -> np.ndarray:
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
    from ..geometry.mesh import plate as plate_mesh
    from ..world.world import World

    plain = square(scene, cells)
    sim = (simulation or World)(plain)
    shell, m = plain.shells[0], plain.shells[0].material
    area_mass = shell.thickness * m.density
    mass = sim.shell.mesh.node_areas * area_mass
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
    elements = _lowest(element_stiffness(sim.shell.mesh, m.young, m.poisson, shell.thickness), mass, count)
    hertz = omega / (2 * np.pi)
    still = np.abs(hertz) < 1e-3 * true[0]
    moving, vectors = hertz[~still], vectors[:, ~still]
    # a negative eigenvalue is a mode that grows: it counts as frequency 0, below everything
    ours = np.where(moving.real > np.abs(moving.imag), moving.real, 0.0)
    first = np.argsort(ours, kind="stable")[:count]
    shapes = vectors[:, first].T.reshape(len(first), -1, 2)
    shapes = shapes / np.linalg.norm(shapes, axis=2).max(axis=1)[:, None, None]
    growth = float(np.max(np.abs(moving.imag) / np.maximum(np.abs(moving.real), 1e-12), initial=0.0))
    step = float(2 / np.abs(omega).max() * np.sqrt(m.young / m.density) / sim.shell.mesh.spacing)
    return Spectrum(ours[first], elements, true, int(still.sum()), growth, step, shapes, sim.shell.mesh)


@dataclass(frozen=True)
class Bent:
    """The like of a free curved patch: frequencies [Hz] of ours and of MITC shell elements on the same nodes, with the same
    lumped masses; how many of ours are rigid (below 1e-3 of the elements' first), `growth`, shapes (count, N, 3)."""

    ours: np.ndarray
    elements: np.ndarray
    rigid: int
    growth: float
    shapes: np.ndarray
    mesh: SurfaceMesh

    @property
    def soft(self) -> int:
        """How many of our modes are far below the elements' of the same number."""
        n = min(len(self.ours), len(self.elements))
        return int((self.ours[:n] < SOFT * self.elements[:n]).sum()) + max(0, self.rigid - RIGID_BENT)


def patch(scene: Scene, cells: int) -> Scene:
    """The scene's material and numerics on a free piece of a cylinder, `cells` x `cells`, one radian wide and as long."""
    plain = square(scene, cells)
    side = plain.shells[0].surface.length
    wall = plain.shells[0].model_copy(
        update={"surface": Cylinder(radius=side, length=side, axis="y", angle=1.0), "motion": "free", "thickness": side / SLENDERNESS}
    )
    return plain.model_copy(update={"shells": (wall,)})


def compare_bent(scene: Scene, cells: int = 12, count: int = 12) -> Bent:
    """The spectrum of the scene's formulation on a free curved patch."""
    import scipy.linalg
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import eigsh

    from ..bodies.shell.instead.modes import stiffness as sparse_stiffness
    from ..world.world import World

    plain = patch(scene, cells)
    sim = World(plain)
    A, free, number, root = sparse_stiffness(sim.shell)
    m, thickness = plain.shells[0].material, plain.shells[0].thickness
    # the elements' on the same unknowns
    n, c, f = free.shape
    node, direction = np.nonzero(number >= 0)
    found = free[node, :, direction] / root[node]
    at = (c * node[:, None] + np.arange(c)).ravel()
    basis = csc_array((found.ravel(), (at, np.repeat(number[node, direction], c))), shape=(c * n, A.shape[0]))
    K = (basis.T @ shell_stiffness(sim.shell.mesh, m.young, m.poisson, thickness) @ basis).tocsc()
    values = eigsh(K, k=count + RIGID_BENT, sigma=-1e-9 * K.diagonal().max(), which="LM", return_eigenvectors=False)
    elements = np.sqrt(np.sort(values)[RIGID_BENT:].clip(0)) / (2 * np.pi)
    # ours
    if plain.numerics.formulation.kind == "galerkin":
        values, vectors = np.linalg.eigh(0.5 * (A + A.T).toarray())
        values = values.astype(complex)
    else:
        values, vectors = scipy.linalg.eig(A.toarray())
    hertz = np.sqrt(values) / (2 * np.pi)
    still = np.abs(hertz) < 1e-3 * elements[0]
    moving, vectors = hertz[~still], vectors.real[:, ~still]
    ours = np.where(moving.real > np.abs(moving.imag), moving.real, 0.0)
    first = np.argsort(ours, kind="stable")[:count]
    shapes = (basis @ vectors[:, first]).T.reshape(len(first), n, c)[:, :, :3]
    shapes = shapes / np.linalg.norm(shapes, axis=2).max(axis=1)[:, None, None]
    growth = float(np.max(np.abs(moving.imag) / np.maximum(np.abs(moving.real), 1e-12), initial=0.0))
    return Bent(ours[first], elements, int(still.sum()), growth, shapes, sim.shell.mesh)


# what the table compares: formulation, cells, irregularity
VARIANTS = (
    ("galerkin", "quad", 0.0),
    ("galerkin", "quad", 0.25),
    ("galerkin", "triangle", 0.0),
    ("galerkin", "triangle", 0.25),
    ("collocation", "quad", 0.0),
    ("collocation", "quad", 0.25),
)


def variants(scene: Scene, cells: int = 12, count: int = 12, compared: Callable = compare) -> dict[tuple[str, str, float], Spectrum | Bent]:
    """The spectrum of every variant on the scene's material and spacing; the scene's own formulation keeps its numbers."""
    found = {}
    own, plain = scene.numerics.formulation, square(scene, cells)  # without loads, which not every form can bear
    for kind, shape, irregularity in VARIANTS:
        changed = plain.derive(
            **{
                "numerics.formulation": own if own.kind == kind else kind,
                "numerics.cells": shape,
                "numerics.irregularity": irregularity,
            }
        )
        found[kind, shape, irregularity] = compared(changed, cells, count)
    return found


def main(scene: Scene, cells: int, count: int, picture: Path | None = None) -> None:
    """Prints the tables of the variants and the modes of the scene's own; draws the lowest ones into `picture`: of a shell
    that bends those of the curved patch, else those of the plate."""
    n = scene.numerics
    print(f"free square plate in its plane, {cells} x {cells} cells; frequencies over those of finite elements on the same nodes")
    print("formulation  cells     irregular  zero modes  soft   lowest  least of all  growth  critical step [D/c]")
    for (kind, shape, irregularity), s in variants(scene, cells, count).items():
        print(_line(kind, shape, irregularity, s))
    print(f"\nfree curved patch that bends, one radian, side / thickness {SLENDERNESS}, the same")
    print("formulation  cells     irregular  zero modes  soft   lowest  least of all  growth")
    for (kind, shape, irregularity), s in variants(scene, cells, count, compare_bent).items():
        print(_line(kind, shape, irregularity, s))
    bends = scene.shells[0].motion == "free"
    s = compare_bent(scene, cells, count) if bends else compare(scene, cells, count)
    print(f"\nthe scene's own: {n.formulation.kind}, {n.cells}, irregularity {n.irregularity:g}, support {n.formulation.support:g}")
    print("mode   ours [kHz]   elements [kHz]   ours/elements")
    for i, (ours, elements) in enumerate(zip(s.ours, s.elements)):
        print(f"{i + 1:4d} {ours / 1e3:12.4f} {elements / 1e3:16.4f} {ours / elements:15.4f}")
    print(f"zero modes {s.rigid} (expected {RIGID_BENT if bends else RIGID}), soft spurious modes {s.soft}")
    if picture is not None:
        from ..render.modes import draw

        draw(picture, s.mesh, s.shapes[:6], [f"{f / 1e3:.3g} kHz" for f in s.ours[:6]])
        print(f"drawn: {picture}")


def _line(kind: str, shape: str, irregularity: float, s: Spectrum | Bent) -> str:
    ratio = s.ours / s.elements[: len(s.ours)]
    step = f" {s.step:20.3f}" if isinstance(s, Spectrum) else ""
    return f"{kind:12s} {shape:8s} {irregularity:10.2f} {s.rigid:11d} {s.soft:5d} {ratio[0]:8.3f} {ratio.min():13.3f} {s.growth:7.1e}{step}"

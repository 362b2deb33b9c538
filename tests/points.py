"""Stress points of a metal without a shell around them, driven through paths of strain."""

import itertools

import numpy as np

from taichi_sph import runtime
from taichi_sph.bodies.shell import metal
from taichi_sph.bodies.shell.pool import Cells, MaterialPool
from taichi_sph.bodies.shell.sections import Sheet
from taichi_sph.pool import Pool
from taichi_sph.runtime import ti
from taichi_sph.scene import Material

NUMBER = itertools.count()
THICKNESS = 2e-3
YOUNG, NU = 210e9, 0.3
G = YOUNG / (2 * (1 + NU))


def steel(strength, **more) -> Material:
    return Material(name="steel", young=YOUNG, poisson=NU, density=7800.0, strength=strength, **more)


@ti.data_oriented
class Points(Pool):
    """What bodies/shell/metal.py needs of the cells; n independent points of unit area."""

    def __init__(self, n: int, material: Material, bends: bool = True):
        name = f"points_{next(NUMBER)}"  # several may live in one run
        super().__init__(name)
        self.n = n
        self.material = MaterialPool([Sheet(material, THICKNESS)], bends, f"{name}.material")
        size = 8 if bends else 3
        self.spares = self.varied = False
        self.strain = self.field("strain", n, size, keeps=True)
        self.result = self.field("result", n, size)
        self.energy = self.field("energy", n)
        for name in ("damage", "delayed", "lost", "area", "shear"):
            setattr(self, name, self.field(name, n, keeps=name not in ("area", "shear")))
        runtime.put(self.area, np.ones(n))
        runtime.put(self.shear, np.full(n, 5 / 6 * G * THICKNESS))
        Cells._metal(self, self.material, bends, np.zeros(n, np.int32))
        self._fresh = self.state()

    def reset(self) -> None:
        """Back to the virgin state: cheaper than new points, for which everything would be compiled again."""
        self.restore(self._fresh)

    def go(self, g: np.ndarray, dt: float = 1e-6, rebase: int = 0) -> np.ndarray:
        """(n, 8 or 3) strains of stress.py after a step -> resultants [N/m, N]."""
        runtime.put(self.result, np.ascontiguousarray(g, runtime.get(self.result, 1).dtype))
        _advance(self, self.material, self.n, dt, rebase)
        return runtime.get(self.result, self.n).astype(float)

    def get(self, name: str) -> np.ndarray:
        return runtime.get(getattr(self, name), self.n).astype(float)

    def stored(self) -> np.ndarray:
        """(n,) elastic energy per area [J/m2]."""
        _stored(self, self.material, self.n)
        return self.get("energy")


@ti.kernel
def _advance(points: ti.template(), material: ti.template(), n: ti.i32, dt: float, rebase: ti.i32):
    for s in range(n):
        points.result[s] = metal.advance(points, material, s, points.result[s], dt, rebase)


@ti.kernel
def _stored(points: ti.template(), material: ti.template(), n: ti.i32):
    for s in range(n):
        points.energy[s] = metal.stored(points, material, s)


def plane(eps11=0.0, eps22=0.0, eps12=0.0, bends=True) -> np.ndarray:
    """Strains on the reference of a stretch whose logarithm is eps (its principal axes fixed)."""
    U2 = _exp(2.0 * np.array([[eps11, eps12], [eps12, eps22]]))
    g = np.array([0.5 * (U2[0, 0] - 1), 0.5 * (U2[1, 1] - 1), U2[0, 1], 0, 0, 0, 0, 0])
    return g if bends else g[:3]


def bent(beta11=0.0, beta22=0.0, beta12=0.0) -> np.ndarray:
    """Curvatures whose strain at the radius of gyration is beta, without stretch."""
    scale = 12**0.5 / THICKNESS
    return scale * np.array([0, 0, 0, beta11, beta22, 2 * beta12, 0, 0])


def _exp(a: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(a)
    return vectors @ np.diag(np.exp(values)) @ vectors.T

"""The stable step from the operator itself: dt = 2 / omega_max of M^-1 K, by Arnoldi's iteration.

The force kernels give K u for a displacement so small that they are linear. Damage is left out, for it only softens. K of the galerkin
form is symmetric: the iteration is Lanczos', which approaches the largest eigenvalue from below. The residual of the Ritz pair bounds
its error and is added, so the step is not overestimated. K of the collocation form is not symmetric: the largest |lambda| counts.
"""

from typing import TYPE_CHECKING

import numpy as np

from ... import runtime
from ...numerics.lanczos import inner, length
from ...numerics.reduce import BLOCK
from ...pool import Pool
from ...runtime import ti
from ..body import Now

if TYPE_CHECKING:
    from .group import ShellGroup

ROOM = 1.05  # frequency that a metal is given beyond what it needs, while it is compressed further
AGAIN = 6  # iterations of such a look, from the mode found before

STRAIN = {"f64": 1e-7, "f32": 1e-4}  # of the probing displacement


class StableStep(Pool):
    """Keeps dt of a group below the limit of its quickest body. The limit is measured at the start, and again after ruptures, which
    renew the operator near the crack, every `look_every` steps of the form at most. dt never grows again.

    A shell gets stiffer where it is stretched: along a stretch l, the force S(E) l has the tangent (3 l^2 - 1) / 2 = 1 + 3 E times
    that at rest. The stress of a metal follows the logarithmic strain (bodies/shell/metal.py), so a metal gets stiffer where it is
    compressed: E e_0 / l^2 in the plane, and its directors (e / e_0)^2 times as much, e / e_0 = 1 / det U. The stretch of a metal may
    change by percents in a step; so a metal is looked at every few steps and gets more room.
    """

    kept = ("mode", "frequency", "stiffer", "events", "looked")

    def __init__(self, group: "ShellGroup", name: str = "stable"):
        super().__init__(name)
        self.group = group
        self.safety = group.scene.numerics.time_step_safety
        self.frequency, self.mode = largest_frequency(group)
        self.stiffer = 1.0  # frequency over that at rest
        self.look_every = group.internal.look_every
        if group.material.yields:
            self.stiffer, self.look_every = ROOM, 10
            self.blocks = -(-group.points.n // BLOCK)
            self.partial = self.field("partial", self.blocks, dtype="f64", doc="scratch")
        self.events, self.looked = group.ruptures, 0

    @property
    def dt(self) -> float:
        """safety * 2 / omega_max [s]."""
        return self.safety * 2.0 / (self.frequency * self.stiffer)

    def _stretched(self) -> bool:
        """Whether sound cells are stretched beyond what the step allows for: then it is shortened, with some room."""
        cells = self.group.points
        if self.group.material.yields:
            _stiffest(self.partial, cells, self.group.material, cells.n, self.blocks)
            needed = max(1.0, float(np.sqrt(runtime.get(self.partial, self.blocks).max())))
            if not 1.02 * self.stiffer < needed < np.inf:
                return False
            self.stiffer = ROOM * needed
            return True
        g = runtime.get(cells.strain, cells.n)[:, :3].astype(np.float64)
        kept = np.where(runtime.get(cells.broken, cells.n) == 0, 1.0 - runtime.get(cells.delayed, cells.n), 0.0)
        largest = 0.5 * (g[:, 0] + g[:, 1]) + 0.5 * np.hypot(g[:, 0] - g[:, 1], g[:, 2])
        needed = float(np.sqrt(np.nanmax(kept * (1.0 + 3.0 * largest), initial=1.0)))
        if not 1.02 * self.stiffer < needed < np.inf:
            return False
        self.stiffer = 1.04 * needed
        return True

    def watch(self, now: Now) -> bool:
        """Look again when something broke or is stretched; True when the step has to be shortened."""
        group = self.group
        if now.step % self.look_every == 0 and self._stretched():
            return True
        if group.ruptures == self.events or now.step - self.looked < group.internal.look_every:
            return False
        self.events, self.looked = group.ruptures, now.step
        frequency, self.mode = largest_frequency(group, AGAIN, self.mode)
        if frequency <= 1.001 * self.frequency:
            return False
        self.frequency = frequency
        return True


class Operator:
    """M^-1/2 K M^-1/2 about the reference state, applied to mass-weighted unknowns of shape `shape`.

    Columns: displacement components, then (where the shell bends) those of the director change, whose part
    along the director is projected out. The bodies of a group do not see each other: the operator acts on all of them at once, and
    on each as if it were alone. `close` puts the displacements back.
    """

    def __init__(self, group: "ShellGroup", across: np.ndarray | None = None):
        """across (N,): weight across the shell over weight along it, where masses are fictitious (relax)."""
        self.group = group
        nodes, n = group.nodes, group.nodes.n
        self.rows = [body.nodes.rows for body in group.shells]
        self.u0, self.force0 = runtime.get(nodes.u, n), runtime.get(nodes.force, n)
        self.real = self.u0.dtype
        self.strain = STRAIN[group.scene.numerics.precision]
        self.root = np.sqrt(runtime.get(nodes.mass, n).astype(np.float64))[:, None] * np.ones(nodes.dim)
        self.N = None
        if nodes.bends:
            self.d0, self.couple0 = runtime.get(nodes.d, n), runtime.get(nodes.couple, n)
            self.N = runtime.get(nodes.N, n).astype(np.float64)
            inertia = np.sqrt(runtime.get(nodes.inertia, n).astype(np.float64))[:, None] * np.ones(3)
            self.root = np.hstack([self.root, inertia])
        self.lighter = None if across is None else 1.0 / np.sqrt(across) - 1.0
        self.shape = self.root.shape

    def _across(self, y: np.ndarray) -> np.ndarray:
        """Without the part of the director change along the director."""
        if self.N is None:
            return y
        d = y[:, 3:]
        return np.hstack([y[:, :3], d - np.einsum("ni,ni->n", d, self.N)[:, None] * self.N])

    def _sizes(self, w: np.ndarray) -> np.ndarray:
        """(N, 1) factor of each node: one size for displacements and for director changes, both small against 1 in their own unit."""
        sizes = np.empty((len(w), 1))
        for body, rows in zip(self.group.shells, self.rows):
            spacing, dim = body.mesh.spacing, self.group.nodes.dim
            largest = np.abs(w[rows, :dim]).max() / spacing
            if self.N is not None:
                largest = max(largest, np.abs(w[rows, 3:]).max())
            sizes[rows] = self.strain / max(largest, 1e-300)
        return sizes

    def __call__(self, y: np.ndarray) -> np.ndarray:
        group, nodes, n = self.group, self.group.nodes, self.group.nodes.n
        w = self._lighten(self._across(y) / self.root)
        size = self._sizes(w)
        runtime.put(nodes.u, (size * w[:, : nodes.dim]).astype(self.real))
        if nodes.bends:
            runtime.put(nodes.d, (size * w[:, 3:]).astype(self.real))
        group.internal.strain(0.0, intact=1)
        group.internal.force()
        force = runtime.get(nodes.force, n).astype(np.float64)
        if nodes.bends:
            force = np.hstack([force, runtime.get(nodes.couple, n).astype(np.float64)])
        return self._across(self._lighten(-force / size / self.root))

    def _lighten(self, y: np.ndarray) -> np.ndarray:
        """The rest of M^-1/2 where a node weighs less across the shell than along it."""
        if self.lighter is None or self.N is None:
            return y
        normal = self.lighter * np.einsum("ni,ni->n", y[:, :3], self.N)
        return np.hstack([y[:, :3] + normal[:, None] * self.N, y[:, 3:]])

    def close(self) -> None:
        """The nodes as they were. Their forces too: those of a group that is not due are asked for at the next step of the clock."""
        nodes = self.group.nodes
        runtime.put(nodes.u, self.u0)
        runtime.put(nodes.force, self.force0)
        if self.N is not None:
            runtime.put(nodes.d, self.d0)
            runtime.put(nodes.couple, self.couple0)


def largest_frequencies(
    group: "ShellGroup", iterations: int = 40, start: np.ndarray | None = None, across: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(B,) omega_max [rad/s] of each body, its error bound added; (N, c) their Ritz vectors in mass-weighted displacements.

    Each body has an iteration of its own; they share the evaluations of the operator alone.
    """
    operator = Operator(group, across)
    own = [
        _Arnoldi(iterations, operator.shape[1], body.nodes.n, None if start is None else start[body.nodes.rows]) for body in group.shells
    ]
    rows = operator.rows
    for _ in range(iterations):
        if all(one.done for one in own):
            break
        w = operator(np.concatenate([one.basis[one.k] for one in own]))
        for one, mine in zip(own, rows):
            one.take(w[mine])
    operator.close()
    found = [one.largest() for one in own]
    return np.array([frequency for frequency, _ in found]), np.concatenate([ritz for _, ritz in found])


def largest_frequency(
    group: "ShellGroup", iterations: int = 40, start: np.ndarray | None = None, across: np.ndarray | None = None
) -> tuple[float, np.ndarray]:
    """The largest omega_max of the bodies of the group [rad/s], and the Ritz vectors of all."""
    frequencies, ritz = largest_frequencies(group, iterations, start, across)
    return float(frequencies.max()), ritz


class _Arnoldi:
    """The iteration of one body of n nodes and c unknowns each; `basis[k]` is what the operator is to be applied to next."""

    def __init__(self, iterations: int, c: int, n: int, start: np.ndarray | None):
        q = np.random.default_rng(0).standard_normal((n, c)) if start is None else start
        self.basis = [q / length(q)]
        self.H = np.zeros((iterations + 1, iterations))
        self.k, self.last, self.done = 0, iterations - 1, False

    def take(self, w: np.ndarray) -> None:
        """w: the operator on basis[k]. Nothing once the iteration is done."""
        if self.done:
            return
        H, k = self.H, self.k
        for i, b in enumerate(self.basis):
            H[i, k] = inner(b, w)
            w = w - H[i, k] * b
        H[k + 1, k] = length(w)
        self.done = bool(H[k + 1, k] < 1e-12 * abs(H[0, 0])) or k == self.last
        if not self.done:
            self.basis.append(w / H[k + 1, k])
            self.k += 1

    def largest(self) -> tuple[float, np.ndarray]:
        """omega_max with its bound, and its Ritz vector."""
        H, k = self.H, self.k
        values, vectors = np.linalg.eig(H[: k + 1, : k + 1])
        top = int(np.argmax(np.abs(values)))
        bound = abs(H[k + 1, k] * vectors[-1, top])
        ritz = sum(c * b for c, b in zip(vectors[:, top].real, self.basis))
        return float(np.sqrt(abs(values[top]) + bound)), ritz


@ti.kernel
def _stiffest(partial: ti.template(), cells: ti.template(), material: ti.template(), n: ti.i32, blocks: ti.i32):
    """Largest (omega / omega at rest)^2 of the live cells of a metal, block by block."""
    for b in range(blocks):
        most = ti.cast(0.0, ti.f64)
        for s in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
            if cells.broken[s] == 0:
                g = ti.cast(cells.strain[s], ti.f64)
                middle, radius = 1.0 + g[0] + g[1], ti.sqrt((g[0] - g[1]) ** 2 + g[2] * g[2])
                least = ti.max(middle - radius, 1e-6)
                stiffer = 1.0 / least
                if ti.static(material.bends):
                    stiffer = ti.max(stiffer, stiffer / (least * ti.max(middle + radius, 1e-6)))
                most = ti.max(most, (1.0 - ti.cast(cells.delayed[s], ti.f64)) * stiffer)
        partial[b] = most

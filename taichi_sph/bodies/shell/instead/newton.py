"""Equilibrium by Newton's method with the tangent of a form (`freedom.Stiffness`), along a path of loads.

The loads of an increment are F(s) = F_0 + s (F_1 - F_0), s from 0 to 1. Newton's step solves K dx = F(s) - f(x), where f are the forces
that the kernels compute. A step that does not come to rest is taken again, a quarter as long. Where no step is short enough, the path is
followed by its length instead (Riks 1979): s is an unknown as well, and

    <x - x_n, t> = L        t: direction of the path at n, of length one;  <., .>: displacements over the size of the body, and turns

goes on over the top and down behind it, until s is 1 again. `Path` is that for one group; statics.py says when it is asked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .... import runtime
from ....scene.instead import COARSE
from ..pressure import LEAVE
from .freedom import Freedom, Stiffness, freedom

if TYPE_CHECKING:
    from ..group import ShellGroup

ITERATIONS = 14  # of one step, at most
STALLED = 5  # of them without a smaller residual: a step of load that is given up
WANTED = 5  # iterations of a good step: the next one is longer where it took fewer
TURN = 0.7  # rad, that a director turns in one iteration at most
FAR = 1.2  # rad, in one step: farther away it may be another branch of the path
SHORTEST = 1e-4  # of an increment: shorter steps are given up
GROWTH = 2.0  # of a step over the one before, at most
START = 0.02  # of the loads: the first step along a path where no step of load came to rest
FARTHEST = 8.0  # the longest step along a path over its first one


def turn_per_cell(group: ShellGroup, d: np.ndarray | None = None) -> float:
    """The most that the angle between the directors of two corners of a cell has grown [rad]; d (N, 3): their changes, by themselves those
    of now."""
    if not group.nodes.bends:
        return 0.0
    n = group.nodes.n
    N = runtime.get(group.nodes.N, n).astype(np.float64)
    now, most = N + (runtime.get(group.nodes.d, n) if d is None else d), 0.0
    for k in range(4):
        i, j = group.mesh.cells[:, k], group.mesh.cells[:, (k + 1) % 4]
        i, j = np.where(i < 0, group.mesh.cells[:, 0], i), np.where(j < 0, group.mesh.cells[:, 0], j)
        angle = [np.arccos(np.clip(np.einsum("mi,mi->m", of[i], of[j]), -1.0, 1.0)) for of in (now, N)]
        most = max(most, float((angle[0] - angle[1]).max(initial=0.0)))
    return most


@dataclass
class Loads:
    """Loads at s = 0 and at s = 1: forces (N, dim) [N], moments (N, 3) [N m], pressures (P,) [Pa]; None where there are none."""

    forces: tuple[np.ndarray, np.ndarray] | None
    moments: tuple[np.ndarray, np.ndarray] | None
    pressures: tuple[np.ndarray, np.ndarray] | None

    def nodal(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Forces and moments, where there are any, as bodies.nodal.loads gives them."""
        return [pair for pair in (self.forces, self.moments) if pair is not None]

    @staticmethod
    def between(pair: tuple[np.ndarray, np.ndarray] | None, s: float) -> Any:
        """That pair at s."""
        return None if pair is None else pair[0] + s * (pair[1] - pair[0])


@dataclass
class State:
    """A point of the path: displacements and director changes (N, 3), load s, the stresses foreseen there."""

    u: np.ndarray
    d: np.ndarray
    s: float
    stresses: Any


class Lost(Exception):
    """A step found no equilibrium."""


@dataclass
class Direction:
    """Of a path: moves (N, c) of u and d, and load s, for a unit of length."""

    moves: np.ndarray
    load: float


class Path:
    """Equilibria of a group from one load to another. iterations: factorisations so far; limits: loads s at which the path turned back;
    points: how many equilibria were reached along its length, where no step of load was short enough."""

    def __init__(self, group: ShellGroup, tangent: Stiffness, loads: Loads, tolerance: np.ndarray, room: int, wary: bool = False):
        """tolerance (B,) [N] of the unbalanced force of each body; room: iterations that may be spent; wary: no limit point is passed where
        neighbours have turned apart by more than `COARSE`."""
        self.wary = wary
        self.group, self.loads, self.tolerance, self.room = group, loads, tolerance, room
        self.tangent = tangent
        self.iterations = 0
        self.N = runtime.get(group.nodes.N, group.nodes.n).astype(np.float64) if group.nodes.bends else None
        self.size = float(np.ptp(group.mesh.points, axis=0).max())
        self.residual = np.full(len(group.shells), np.inf)
        self.unstable = False
        self.limits: list[float] = []
        self.points = 0

    def here(self) -> State:
        """The state of the nodes, at s = 0."""
        nodes, n = self.group.nodes, self.group.nodes.n
        u = runtime.get(nodes.u, n).astype(np.float64)
        d = runtime.get(nodes.d, n).astype(np.float64) if nodes.bends else np.zeros_like(u)
        return State(u, d, 0.0, self.tangent.stresses(u, d))

    def put(self, state: State) -> None:
        """Nodes, forces and loads as in that state."""
        group, nodes = self.group, self.group.nodes
        runtime.put(nodes.u, state.u)
        if nodes.bends:
            runtime.put(nodes.d, state.d)
        for load, pair in zip(group.loads.given(), self.loads.nodal()):
            runtime.put(load.total, Loads.between(pair, state.s))
        group.internal.strain(0.0)
        if group.pressures is not None:
            group.pressures.press_with(Loads.between(self.loads.pressures, state.s), LEAVE)
        group.internal.force()

    def _unbalanced(self, state: State, free: Freedom) -> np.ndarray:
        """(size,) forces and torques that the unknowns feel, and `residual` of the bodies."""
        group, nodes, n = self.group, self.group.nodes, self.group.nodes.n
        self.put(state)
        force = runtime.get(nodes.force, n).astype(np.float64)
        if self.loads.forces is not None:
            force = force + Loads.between(self.loads.forces, state.s)
        if nodes.bends:
            couple = runtime.get(nodes.couple, n).astype(np.float64)
            if self.loads.moments is not None:
                couple = couple + np.cross(Loads.between(self.loads.moments, state.s), self.N + state.d)
            force = np.concatenate([force, couple], axis=1)
        felt = np.where(free.number >= 0, np.einsum("ncf,nc->nf", free.basis, force), 0.0)
        squares = felt**2
        for b, body in enumerate(group.shells):
            own = squares[body.nodes.rows]
            own[:, nodes.dim :] /= body.mesh.spacing**2
            self.residual[b] = np.sqrt(own.sum())
        return free.gather(felt)

    def weigh(self, state: State) -> np.ndarray:
        """(B,) norm of the unbalanced forces of each body at that state [N]."""
        self._unbalanced(state, self._free(state))
        return self.residual.copy()

    def _push(self, state: State, free: Freedom) -> np.ndarray:
        """(size,) what the unknowns feel more of the loads for a unit of s."""
        nodes, n = self.group.nodes, self.group.nodes.n
        push = np.zeros((n, self.tangent.width))
        if self.loads.forces is not None:
            push[:, : nodes.dim] += self.loads.forces[1] - self.loads.forces[0]
        if self.loads.moments is not None:
            push[:, nodes.dim :] += np.cross(self.loads.moments[1] - self.loads.moments[0], self.N + state.d)
        if self.loads.pressures is not None and self.group.pressures is not None:
            more, m, pressures = self.loads.pressures[1] - self.loads.pressures[0], self.group.cells.n, self.group.pressures
            push[:, :3] += self.tangent.pressed(state.u, pressures.on_cells(more, m, True), pressures.on_cells(more, m, False))
        return free.gather(np.einsum("ncf,nc->nf", free.basis, push))

    def factor(self, state: State, free: Freedom) -> Any:
        """A solver for K of that state. Nodes are eliminated in one order, found once."""
        import scipy.sparse as sparse
        from scipy.sparse.linalg import splu

        pressures, moments = np.zeros(self.group.cells.n), Loads.between(self.loads.moments, state.s)
        if self.loads.pressures is not None and self.group.pressures is not None:
            pressures = self.group.pressures.on_cells(Loads.between(self.loads.pressures, state.s), self.group.cells.n, True)
        K = self.tangent.matrix(state.u, state.d, state.stresses, pressures, free, moments)
        unknowns = free.number[self.tangent.elimination]
        unknowns = unknowns[unknowns >= 0]
        scale = 1.0 / np.sqrt(np.maximum(np.abs(K.diagonal()), 1e-300))
        scaled = sparse.diags_array(scale) @ K @ sparse.diags_array(scale)
        scaled = sparse.csc_array(scaled)[unknowns][:, unknowns]
        self.iterations += 1
        try:
            lu = splu(
                sparse.csc_matrix(scaled), permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True, "Equil": False}
            )
        except RuntimeError as error:  # exactly singular
            raise Lost from error
        pivots = lu.U.diagonal()
        straight = np.array_equal(lu.perm_r, np.arange(len(pivots)))
        self.unstable = bool(straight and (pivots < 0.0).any())
        if not np.abs(pivots).min() > 1e-14:
            raise Lost

        def solve(right: np.ndarray) -> np.ndarray:
            found = np.empty_like(right)
            found[unknowns] = lu.solve((scale * right)[unknowns])
            return scale * found

        return solve

    def _moved(self, state: State, free: Freedom, step: np.ndarray, ds: float) -> State:
        """The state after a step of the unknowns."""
        if not np.isfinite(step).all():
            raise Lost
        dim, parts = self.group.nodes.dim, free.spread(step)
        du = np.einsum("nij,nj->ni", free.basis[:, :dim, :dim], parts[:, :dim])
        dd = np.zeros_like(du)
        d = state.d
        if self.N is not None:
            dd = np.einsum("nij,nj->ni", free.basis[:, 3:, 3:], parts[:, 3:])
            n = self.N + d
            turn = np.einsum("nij,nj->ni", free.axes, parts[:, 3:])
            angle = np.maximum(np.linalg.norm(turn, axis=1), 1e-300)[:, None]
            turned = np.cross(turn, n)
            d = d + np.sin(angle) / angle * turned + 2.0 * (np.sin(0.5 * angle) / angle) ** 2 * np.cross(turn, turned)
            n = self.N + d
            d = d + 0.5 * (1.0 - np.einsum("ni,ni->n", n, n))[:, None] * n
        return State(state.u + du, d, state.s + ds, self.tangent.foreseen(state.u, state.d, du, dd))

    def _shorter(self, free: Freedom, step: np.ndarray) -> float:
        """Factor on a step that would turn a director too far."""
        if self.N is None:
            return 1.0
        farthest = float(np.linalg.norm(free.spread(step)[:, 3:], axis=1).max())
        return min(1.0, TURN / farthest) if farthest > 0.0 else 1.0

    def _free(self, state: State) -> Freedom:
        return freedom(self.group, self.N + state.d if self.N is not None else state.d)

    def _spent(self) -> bool:
        return self.iterations >= self.room

    def _inner(self, free: Freedom, one: np.ndarray, other: np.ndarray) -> float:
        """<., .> of two steps."""
        weight = np.ones(free.number.shape)
        weight[:, : self.group.nodes.dim] /= self.size**2
        return float(np.sum(free.gather(weight) * one * other)) / self.group.nodes.n

    def at(self, start: State, s: float) -> State:
        """Equilibrium at the load s, from an equilibrium nearby; Lost where none is found."""
        state = replace(start, s=s)
        free = self._free(state)
        unbalanced = self._unbalanced(state, free)
        first = float(np.linalg.norm(unbalanced))
        least, when = np.inf, 0  # the smallest residual after a step, and the step
        for k in range(ITERATIONS):
            if (self.residual < self.tolerance).all():
                return state
            size = float(np.linalg.norm(unbalanced))
            if k > 0 and size < least:
                least, when = size, k
            if not size < 1e8 * max(first, 1e-300) or k - when > STALLED or self._spent():
                raise Lost
            step = self.factor(state, free)(unbalanced)
            step *= self._shorter(free, step)
            state = self._moved(state, free, step, 0.0)
            free = self._free(state)
            unbalanced = self._unbalanced(state, free)
        if (self.residual < self.tolerance).all():
            return state
        raise Lost

    def _same_branch(self, before: State, after: State) -> bool:
        """Whether no director has turned by more than a step may turn it."""
        if self.N is None:
            return True
        return bool((np.einsum("ni,ni->n", self.N + before.d, self.N + after.d) > np.cos(FAR)).all())

    def climb(self, state: State, reached: Callable[[State], None]) -> State:
        """From s = 0 to s = 1, by loads, and by length where no step of load is short enough; Lost where both are. `reached` is told of
        every equilibrium on the way."""
        ds, gone = 1.0, 0.0  # the next step of load; the length of the longest one that came to rest
        stable = not self.unstable  # at the start
        while state.s < 1.0:
            s = min(1.0, state.s + ds)
            try:
                after = self.at(state, 1.0 if s > 1.0 - SHORTEST else s)
                if not self._same_branch(state, after) or (stable and self.unstable):
                    raise Lost
            except Lost:
                ds *= 0.25
                if self._spent():
                    raise
                if ds < SHORTEST:
                    if self.wary and turn_per_cell(self.group, state.d) > COARSE:
                        raise
                    return self._over(state, reached, gone)
            else:
                gone = max(gone, self._apart(state, after))
                state = after
                reached(state)
                ds *= GROWTH
        return state

    def _apart(self, before: State, after: State) -> float:
        """The length from one state to another, as `_inner` measures moves."""
        moves = np.concatenate([(after.u - before.u) / self.size, after.d - before.d], axis=1)
        return float(np.sqrt(np.sum(moves**2) / self.group.nodes.n))

    def _over(self, state: State, reached: Callable[[State], None], gone: float) -> State:
        """To s = 1 along the path, over limit points. The first step is no longer than `gone`, what a step of load went (0: none did):
        near a limit point a share of the load would be a long way."""
        direction = self.direction(state, None)
        length = START / max(abs(direction.load), 1e-300)
        if gone > 0.0:
            length = min(length, gone)
        longest = max(gone, FARTHEST * length if gone == 0.0 else 0.0)
        while True:
            state, direction, length = self.step(state, direction, length)
            length = min(length, longest)
            self.points += 1
            reached(state)
            if state.s == 1.0:
                return state

    def step(self, state: State, direction: Direction, length: float) -> tuple[State, Direction, float]:
        """The next point of the path at a length or, where that is too far, at less; s = 1 exactly where the path passes it upwards.
        Then the direction there and the length of the step to follow."""
        shortest = SHORTEST * length
        while True:
            try:
                after, iterations = self.along(state, direction, length)
                if after.s > 1.0:
                    after = self.at(after, 1.0)
                if not self._same_branch(state, after):
                    raise Lost
                break
            except Lost:
                length *= 0.5
                if length < shortest or self._spent():
                    raise
        onward = self.direction(after, direction)
        if onward.load * direction.load < 0.0:
            self.limits.append(max(state.s, after.s) if direction.load > 0.0 else min(state.s, after.s))
        return after, onward, length * float(np.clip(np.sqrt(WANTED / iterations), 0.5, GROWTH))

    def direction(self, state: State, before: Direction | None) -> Direction:
        """Of the path at an equilibrium: forward along `before`, up in load where there is none."""
        free = self._free(state)
        step = self.factor(state, free)(self._push(state, free))
        length = np.sqrt(self._inner(free, step, step))
        ds = 1.0
        if before is not None:
            along = self._inner(free, step, free.gather(np.einsum("ncf,nc->nf", free.basis, before.moves)))
            ds = -1.0 if along < 0.0 else 1.0
        parts = free.spread(step * ds / length)
        return Direction(np.einsum("ncf,nf->nc", free.basis, parts), ds / length)

    def along(self, start: State, direction: Direction, length: float) -> tuple[State, int]:
        """The equilibrium that lies `length` farther along the path, and the iterations it took."""
        free = self._free(start)
        step = free.gather(np.einsum("ncf,nc->nf", free.basis, direction.moves)) * length
        done = self._shorter(free, step)
        if done < 1.0:
            raise Lost
        way = length * self._inner(free, step / length, step / length)  # what has been gone of the length
        state = self._moved(start, free, step, direction.load * length)
        for k in range(ITERATIONS):
            free = self._free(state)
            unbalanced = self._unbalanced(state, free)
            if (self.residual < self.tolerance).all():
                return state, k + 1
            if self._spent():
                raise Lost
            solve = self.factor(state, free)
            rest, push = solve(unbalanced), solve(self._push(state, free))
            t = free.gather(np.einsum("ncf,nc->nf", free.basis, direction.moves))
            ds = (length - way - self._inner(free, t, rest)) / self._inner(free, t, push)
            step = rest + ds * push
            part = self._shorter(free, step)
            way += part * self._inner(free, t, step)
            state = self._moved(state, free, part * step, part * ds)
            if not abs(state.s) < 1e6:
                raise Lost
        raise Lost

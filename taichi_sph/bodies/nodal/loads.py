"""What acts from outside on nodes: dead forces and moments, prescribed velocities and spins, each with its history."""

from collections.abc import Sequence

import numpy as np

from ... import runtime
from ...pool import Pool
from ...runtime import ti
from ...scene.histories import Points
from .nodes import Nodes
from .supports import Supports


class Curves(Pool):
    """Histories as data: the points of all of them in one table, curve k from first[k] to first[k + 1]; equal ones stand there once."""

    def __init__(self, name: str, curves: Sequence[Points]):
        super().__init__(name)
        self.known = list(dict.fromkeys(curves))
        points = np.array([point for curve in self.known for point in curve], dtype=np.float64).reshape(-1, 2)
        self.first = self.field("first", len(self.known) + 1, dtype="i32", doc="row of the first point of a history")
        self.time = self.field("time", len(points), unit="s", doc="of a point")
        self.factor = self.field("factor", len(points), doc="of the full value, at a point")
        runtime.put(self.first, np.cumsum([0] + [len(curve) for curve in self.known]).astype(np.int32))
        runtime.put(self.time, points[:, 0])
        runtime.put(self.factor, points[:, 1])

    def number(self, curve: Points) -> int:
        """Of a history."""
        return self.known.index(curve)


class Loads(Pool):
    """Nodal forces and moments by entries (node, load, history); motions by number, found through nodes.fixed."""

    def __init__(self, nodes: Nodes, forces: Sequence, motions: Sequence, moments: Sequence = (), name: str = "loads", blows: bool = False):
        """forces: list of (node numbers, (n, dim) forces [N], points of their history); moments: the same, (n, 3) [N m];
        motions: list of (node numbers, (dim,) mask, (dim,) velocity [m/s], (3,) mask, (3,) spin [rad/s], points of their history);
        the second pair counts for a shell that bends. blows: they act now and then, as blows (slow.SlowNodes)."""
        super().__init__(name)
        self.nodes = nodes
        self.pushes, self.twists, self.moves = bool(forces), bool(moments), bool(motions)
        self.blows = blows
        self.acts = self.pushes or self.twists or self.moves
        self.constant = all(len(curve) == 1 for *_, curve in [*forces, *moments])
        if self.acts:
            self.curves = Curves(f"{name}.curves", [curve for *_, curve in [*forces, *moments, *motions]])
        if self.acts:
            self.work = self.field("work", nodes.n, unit="J", doc="done on the node up to time n", keeps=True)
            self.ahead = self.field("ahead", nodes.n, unit="J", doc="what f_n does on the way to n + 1", keeps=True)
        if nodes.bends and (self.twists or self.moves):
            self.ahead_spin = self.field("ahead_spin", nodes.n, unit="J", doc="the same of moments and spins", keeps=True)
        if self.pushes:
            self.force = NodalLoad(f"{name}.force", nodes, forces, nodes.dim, "N", self.curves)
        if self.twists:
            self.moment = NodalLoad(f"{name}.moment", nodes, moments, 3, "N m", self.curves)
        self.set(0.0)
        if motions:
            self._motions(motions)

    def _motions(self, motions: Sequence) -> None:
        nodes, dim = self.nodes, self.nodes.dim
        fixed = np.zeros(nodes.n, np.int32)
        self.mask = self.field("mask", len(motions), dim, "i32", doc="1: this component is prescribed")
        self.velocity = self.field("velocity", len(motions), dim, unit="m/s", doc="prescribed, at its full value")
        self.curve = self.field("curve", len(motions), dtype="i32", doc="number of its history")
        if nodes.bends:
            self.spin_mask = self.field("spin_mask", len(motions), 3, "i32", doc="1: this component of the spin is prescribed")
            self.spin = self.field("spin", len(motions), 3, unit="rad/s", doc="prescribed, at its full value")
        held, mask, velocity, spin_mask, spin, curve = zip(*motions)
        for m, i in enumerate(held):
            fixed[i] = m + 1
        runtime.put(self.mask, np.array(mask, np.int32)[:, :dim])
        runtime.put(self.velocity, np.array(velocity, float)[:, :dim])
        runtime.put(self.curve, np.array([self.curves.number(one) for one in curve], np.int32))
        if nodes.bends:
            runtime.put(self.spin_mask, np.array(spin_mask, np.int32))
            runtime.put(self.spin, np.array(spin, float))
        runtime.put(nodes.fixed, fixed)
        self.supports = Supports(nodes, fixed, len(motions), f"{self.name}.supports")

    def share(self, forces: Sequence, moments: Sequence) -> None:
        """Other values on the same nodes, at the start."""
        for load, entries in zip(self.given(), [entries for entries in (forces, moments) if entries]):
            load.put(entries)
        self.set(0.0)

    def given(self) -> list["NodalLoad"]:
        """Forces and moments, where there are any."""
        return [*([self.force] if self.pushes else []), *([self.moment] if self.twists else [])]

    def pools(self) -> list[Pool]:
        """All that has fields."""
        return [self, *([self.curves] if self.acts else []), *self.given(), *([self.supports] if self.moves else [])]

    def set(self, time: float) -> None:
        """Loads at `time`."""
        if self.pushes:
            self.force.set(time)
        if self.twists:
            self.moment.set(time)

    def update(self, time: float) -> None:
        """Loads at `time`, where they vary."""
        if not self.constant:
            self.set(time)


class NodalLoad(Pool):
    """One kind of nodal load: `total` (N, c) on the nodes now, from entries (node, value, history)."""

    def __init__(self, name: str, nodes: Nodes, entries: Sequence, components: int, unit: str, curves: Curves):
        super().__init__(name)
        self.curves = curves
        node = np.concatenate([i for i, _, _ in entries])
        curve = np.concatenate([np.full(len(i), curves.number(curve), np.int32) for i, _, curve in entries])
        order = np.argsort(node, kind="stable")  # those of one node side by side, in the order of the scene
        loaded, first = np.unique(node[order], return_index=True)
        self.n = len(loaded)
        self.total = self.field("total", nodes.n, components, unit=unit, doc="on the node now")
        self.node = self.field("node", self.n, dtype="i32", doc="a node with entries")
        self.first = self.field("first", self.n + 1, dtype="i32", doc="its first entry")
        self.value = self.field("value", len(node), components, unit=unit, doc="of an entry, at its full value")
        self.curve = self.field("curve", len(node), dtype="i32", doc="number of its history")
        runtime.put(self.node, loaded.astype(np.int32))
        runtime.put(self.first, np.append(first, len(node)).astype(np.int32))
        runtime.put(self.curve, curve[order])
        self.put(entries)

    def put(self, entries: Sequence) -> None:
        """The values of all entries."""
        order = np.argsort(np.concatenate([i for i, _, _ in entries]), kind="stable")
        runtime.put(self.value, np.concatenate([f for _, f, _ in entries])[order])

    def set(self, time: float) -> None:
        """Sum the entries at `time`."""
        _gather(self, self.n, time)


@ti.func
def history(time, curves: ti.template(), k):
    """Factor of history k at a time, linear between its points (scene.histories.factor)."""
    low, high = curves.first[k], curves.first[k + 1] - 1
    value = curves.factor[high]
    if time < curves.time[high]:
        value = curves.factor[low]
        if time >= curves.time[low]:
            while high - low > 1:
                middle = (low + high) // 2
                if time < curves.time[middle]:
                    high = middle
                else:
                    low = middle
            begin, end = curves.factor[low], curves.factor[high]
            value = begin + (time - curves.time[low]) / (curves.time[high] - curves.time[low]) * (end - begin)
    return value


@ti.func
def undrilled(loads: ti.template(), g, n, w):
    """The spin (or torque) w of a director n in the motion g, freed of its part along n by the free components alone.

    Where one component is held and n leans towards its axis, the two others hold a turn about n, which nothing
    resists: it must not take part.
    """
    p = n
    free = 0
    for c in ti.static(range(3)):
        if loads.spin_mask[g][c] == 1:
            p[c] = 0.0
        else:
            free += 1
    if free == 2 and p.dot(n) > 1e-6:
        w -= w.dot(n) / p.dot(n) * p
    return w


@ti.kernel
def _gather(load: ti.template(), n: ti.i32, time: float):
    for m in range(n):
        total = load.total[load.node[m]] * 0.0
        for k in range(load.first[m], load.first[m + 1]):
            total += load.value[k] * history(time, load.curves, load.curve[k])
        load.total[load.node[m]] = total

"""Links over a void: a chord that leaves the body across a hole, a notch or a gap. NumPy only.

The way of such a link leads through the body: to the rim, along the rim, and on. A link is cut

    at the start      where its way is longer than DETOUR chords (or there is none): the two sides of a notch, two pieces
    during a run      when a cell breaks that the rim passes between its ends: a crack that ends on a concave edge parts its lips

A round hole keeps all links whose chord is short of its diameter, a square corner keeps its own, and a notch sharper than 84 degrees is
two lips. The links are found once, with the cells that each leans on (`links.Links.lean`); a rupture then reads a list.

A chord starts a little inside the cells of its end, and not at the end itself. So a chord along a straight border stays in the body. Chords
and rims are compared in the tangent plane of the row.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ... import runtime
from ...geometry.mesh import SurfaceMesh
from .links import Links

DETOUR = 1.5  # chords: a way along the body that is longer hides
INSIDE = 1e-5  # of the way to the middle of its cells: where a place is looked from
ASIDE = 1e-3  # of a side: a rim that is passed over less of it is not passed
ABOVE = 0.5  # smoothing lengths: a rim farther from a chord, across the surface, is another sheet's
AT_ONCE = 200_000  # meetings of a chord and a side that are looked at together


@dataclass(frozen=True)
class Voids:
    """The border of a mesh, side by side, ordered round its loops; and where places are looked from.

    start, end, inward (K, 3): a side, and where its cell lies from there [m]; cell (K,); body (K,); loop (K,): first side of its loop and
    count of its sides, (K, 2); along (K,): way round the loop to `start` [m], length (K,) [m], round (K,): that of the whole loop, inf
    where it is open. winding (K,) bool: sides with another border in sight on their outer hand: all others part nothing.
    fan (K + 1,), of_fan: the cells around `start`. nodes (N, 3), edge_moves (R, 3), centres (M, 3): as looked from.
    """

    start: np.ndarray
    end: np.ndarray
    inward: np.ndarray
    cell: np.ndarray
    body: np.ndarray
    loop: np.ndarray
    along: np.ndarray
    length: np.ndarray
    round: np.ndarray
    winding: np.ndarray
    fan: np.ndarray
    of_fan: np.ndarray
    nodes: np.ndarray
    edge_moves: np.ndarray
    centres: np.ndarray

    def hide(self, links: Links, rows: np.ndarray, sources: np.ndarray) -> None:
        """Cuts the pairs of `links` whose way is too long, and tells it what the others lean on. rows (R, 2, 3), sources (S, 3): as
        looked from."""
        cut = runtime.get(links.cut, links.pairs)
        leaning: list[np.ndarray] = []
        for pair, row, g, side, t, u, out, chord in self._crossings(links, rows, sources, cut):
            order = np.lexsort((t, g, pair))
            pair, row, g, side, t, u, out = (a[order] for a in (pair, row, g, side, t, u, out))
            leaves = np.flatnonzero((pair[1:] == pair[:-1]) & (g[1:] == g[:-1]) & out[:-1] & ~out[1:])
            back = leaves + 1
            link = np.stack([row, pair, g], axis=1)[leaves]
            forward, way = self._way(side[leaves], u[leaves], side[back], u[back])
            straight = (t[back] - t[leaves]) * chord[order][leaves]
            # a chord may leave the body more than once: its way is the sum
            _, same = np.unique(2 * link[:, 1] + link[:, 2], return_inverse=True)
            longer = np.bincount(same.ravel(), way - straight)[same.ravel()]
            far = longer > (DETOUR - 1.0) * chord[order][leaves]
            cut[link[far, 1]] |= (1 << link[far, 2]).astype(np.int8)
            kept = np.flatnonzero(~far)
            first = np.where(forward, side[leaves], side[back])[kept]
            last = np.where(forward, side[back], side[leaves])[kept]
            from_u = np.where(forward, u[leaves], u[back])[kept]
            to_u = np.where(forward, u[back], u[leaves])[kept]
            which, cell = self._passed(first, from_u, last, to_u)
            if len(which):
                leaning.append(np.unique(np.column_stack([link[kept][which], cell]), axis=0))
        runtime.put(links.cut, cut)
        if leaning:
            links.lean(np.concatenate(leaning))

    def _crossings(self, links: Links, rows: np.ndarray, sources: np.ndarray, cut: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
        """Meetings of chords with winding sides, whole rows at once: pair, row, g, side, place on the chord, place on the side (0 to 1),
        bool whether the chord leaves the body there, its length [m]."""
        from scipy.spatial import cKDTree

        first, source = runtime.get(links.start, links.n + 1).astype(np.int64), runtime.get(links.source, links.pairs)
        h, points = runtime.get(links.h, links.n), runtime.get(links.n_points, links.n)
        frame = np.stack([runtime.get(links.t1, links.n), runtime.get(links.t2, links.n)], axis=1)
        normal = np.cross(frame[:, 0], frame[:, 1])
        body = runtime.get(links.body, links.n) if links.several else np.zeros(links.n, np.int32)
        wind = np.flatnonzero(self.winding)
        middle = 0.5 * (self.start + self.end)[wind]
        tree, span = cKDTree(middle), 0.5 * float(self.length[wind].max())
        centre = rows.mean(axis=1)
        reach = 2.0 * h + 0.5 * np.linalg.norm(rows[:, 1] - rows[:, 0], axis=1) + span
        near = np.flatnonzero(np.isfinite(tree.query(centre, distance_upper_bound=float(reach.max()))[0]))
        lists = tree.query_ball_point(centre[near], reach[near], return_sorted=True)
        count = np.array([len(one) for one in lists], np.int64)
        near, lists, count = near[count > 0], lists[count > 0], count[count > 0]
        cost = np.cumsum(count * (first[near + 1] - first[near]) * 2)
        for some in np.split(np.arange(len(near)), np.searchsorted(cost, np.arange(AT_ONCE, cost[-1] if len(cost) else 0, AT_ONCE))):
            if not len(some):
                continue
            row = np.repeat(near[some], count[some])
            side = wind[np.concatenate([np.asarray(one, np.int64) for one in lists[some]])]
            mine = self.body[side] == body[row]
            row, side = row[mine], side[mine]
            row, side, pair = _each(row, side, first)
            for g in (0, 1):
                live = (points[row] > g) & (cut[pair] >> g & 1 == 0)
                r, k, p = row[live], side[live], pair[live]
                a = rows[r, g]
                flat = frame[r]
                b, s, e, i = (
                    np.einsum("nai,ni->na", flat, x) for x in (sources[source[p]] - a, self.start[k] - a, self.end[k] - a, self.inward[k])
                )
                beside = b[:, 0] * s[:, 1] - b[:, 1] * s[:, 0]
                beyond = b[:, 0] * e[:, 1] - b[:, 1] * e[:, 0]
                meet = np.flatnonzero((beside >= 0) != (beyond >= 0))
                r, k, p, a, b, s, e, i = r[meet], k[meet], p[meet], a[meet], b[meet], s[meet], e[meet], i[meet]
                u = beside[meet] / (beside[meet] - beyond[meet])
                place = s + u[:, None] * (e - s)
                t = np.einsum("na,na->n", place, b) / np.einsum("na,na->n", b, b)
                along = e - s
                hand = along[:, 0] * i[:, 1] - along[:, 1] * i[:, 0]  # on which hand of the side its cell lies
                out = (along[:, 0] * b[:, 1] - along[:, 1] * b[:, 0]) * hand < 0
                chord = sources[source[p]] - a
                height = np.einsum("ni,ni->n", normal[r], self.start[k] - a + u[:, None] * (self.end - self.start)[k] - t[:, None] * chord)
                held = (t > 0) & (t < 1) & (np.abs(height) < ABOVE * h[r])
                yield (
                    p[held], r[held], np.full(held.sum(), g), k[held], t[held], u[held], out[held],
                    np.linalg.norm(chord[held], axis=1),
                )  # fmt: skip

    def _way(self, one: np.ndarray, u: np.ndarray, other: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Between places u and w on two sides: whether the shorter way round runs forward, and how long it is [m]; inf: there is none."""
        a, b = self.along[one] + u * self.length[one], self.along[other] + w * self.length[other]
        whole = self.round[one]
        closed = np.isfinite(whole)
        ahead = b - a
        ahead = np.where(closed, np.mod(ahead, np.where(closed, whole, 1.0)), ahead)
        behind = np.where(closed, whole - ahead, -ahead)
        forward = np.where(closed, ahead <= behind, ahead >= 0)
        way = np.where(forward, ahead, behind)
        return forward, np.where(self.loop[one, 0] == self.loop[other, 0], way, np.inf)

    def _passed(self, first: np.ndarray, u: np.ndarray, last: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(number of the way, cell): what stands along ways that run forward from place u of side `first` to w of side `last`."""
        begin, sides = self.loop[first].T
        count = np.mod(last - first, sides) + 1
        which = np.repeat(np.arange(len(first)), count)
        step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        side = begin[which] + np.mod(first[which] - begin[which] + step, sides[which])
        is_first, is_last = step == 0, step == count[which] - 1
        from_, to = np.where(is_first, u[which], 0.0), np.where(is_last, w[which], 1.0)
        over = to - from_ > ASIDE
        # a corner of the rim counts where the way comes from before it and goes on behind it
        before = np.where(step == 1, 1.0 - u[which], 1.0)
        corner = np.flatnonzero(~is_first & (to > ASIDE) & (before > ASIDE))
        size = self.fan[side[corner] + 1] - self.fan[side[corner]]
        member = np.repeat(self.fan[side[corner]] - np.cumsum(size) + size, size) + np.arange(size.sum())
        return (
            np.concatenate([which[over], np.repeat(which[corner], size)]),
            np.concatenate([self.cell[side[over]], self.of_fan[member]]),
        )


def _each(row: np.ndarray, side: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every pair of a row beside every side that the row meets."""
    count = first[row + 1] - first[row]
    pair = np.repeat(first[row] - np.cumsum(count) + count, count) + np.arange(count.sum())
    return np.repeat(row, count), np.repeat(side, count), pair


def _loops(start: np.ndarray, end: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sides that follow one another: their order, the number of each one's loop, and of each loop whether it closes."""
    by_start = np.argsort(start, kind="stable")
    taken = np.zeros(n + 1, np.int64)
    first = np.r_[0, np.cumsum(np.bincount(start, minlength=n))]
    following = np.full(len(start), -1)
    for k in range(len(start)):  # where several loops meet at a node, each arrival takes another departure
        place = first[end[k]] + taken[end[k]]
        if place < first[end[k] + 1]:
            following[k] = by_start[place]
            taken[end[k]] += 1
    arrives = np.zeros(len(start), bool)
    arrives[following[following >= 0]] = True
    done = np.zeros(len(start), bool)
    order: list[int] = []
    number: list[int] = []
    closes: list[bool] = []
    for k in [*np.flatnonzero(~arrives).tolist(), *range(len(start))]:  # open chains from their beginning
        if done[k]:
            continue
        at, closes_here = k, False
        while at >= 0 and not done[at]:
            done[at] = True
            order.append(at)
            number.append(len(closes))
            at = int(following[at])
            closes_here = at == k
        closes.append(closes_here)
    return np.array(order), np.array(number), np.array(closes)


def voids(mesh: SurfaceMesh, reach: float, body: np.ndarray | None = None) -> Voids | None:
    """What a mesh has of borders that chords can leave the body over; None where there is nothing of the sort.

    reach: the longest link [m]; body (N,): number of each node's body, None: there is one.
    """
    from scipy.spatial import cKDTree

    edges, n = mesh.edges, len(mesh.points)
    border = np.flatnonzero(edges.sides[:, 1] < 0)
    if not len(border):
        return None
    cell, k = np.divmod(edges.sides[border, 0].astype(np.int64), 4)
    start = mesh.cells[cell, k].astype(np.int64)
    end = mesh.cells[cell, np.where(k + 1 == mesh.corners[cell], 0, np.minimum(k + 1, 3))].astype(np.int64)
    order, number, closes = _loops(start, end, n)
    cell, start, end = cell[order], start[order], end[order]
    length = np.linalg.norm(mesh.points[end] - mesh.points[start], axis=1)
    begin, sides = np.unique(number, return_index=True, return_counts=True)[1:]
    before = np.cumsum(length) - length
    whole = np.bincount(number, length)
    at, until = mesh.points[start], mesh.points[end]
    inward = np.cross(mesh.frames[cell, 2], until - at)
    inward *= np.sign(np.einsum("ki,ki->k", inward, mesh.centres[cell] - at))[:, None]
    of = np.zeros(n, np.int32) if body is None else body.astype(np.int32)
    pairs = cKDTree(0.5 * (at + until)).query_pairs(reach + float(length.max()), output_type="ndarray")
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    pairs = pairs[of[start[pairs[:, 0]]] == of[start[pairs[:, 1]]]]
    slack = -1e-7 * np.linalg.norm(inward, axis=1) * length
    winding = np.zeros(len(at), bool)
    for ends in (at, until):
        outside = np.einsum("pi,pi->p", inward[pairs[:, 0]], ends[pairs[:, 1]] - at[pairs[:, 0]]) < slack[pairs[:, 0]]
        winding[pairs[outside, 0]] = True
    if not winding.any():
        return None
    node = mesh.cells[mesh.cells >= 0]
    around = np.repeat(np.arange(len(mesh.cells)), mesh.corners)
    by_node = np.argsort(node, kind="stable")
    first = np.r_[0, np.cumsum(np.bincount(node, minlength=n))]
    size = first[start + 1] - first[start]
    middle = np.stack([np.bincount(node, c, minlength=n) for c in mesh.centres[around].T], axis=1) / np.bincount(node, minlength=n)[:, None]
    beside = np.where(edges.sides < 0, edges.sides[:, :1], edges.sides) // 4
    between = mesh.points[edges.nodes].mean(axis=1)
    return Voids(
        start=at,
        end=until,
        inward=inward,
        cell=cell,
        body=of[start],
        loop=np.stack([begin[number], sides[number]], axis=1),
        along=before - before[begin[number]],
        length=length,
        round=np.where(closes, whole, np.inf)[number],
        winding=winding,
        fan=np.r_[0, np.cumsum(size)],
        of_fan=around[by_node][np.repeat(first[start] - np.cumsum(size) + size, size) + np.arange(size.sum())],
        nodes=mesh.points + INSIDE * (middle - mesh.points),
        edge_moves=INSIDE * (mesh.centres[beside].mean(axis=1) - between),
        centres=mesh.centres,
    )

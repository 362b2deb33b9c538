"""Which elements are near each other: candidate pairs, kept until something has moved by half the skin.

A pair is a ball against a disc, or a ball against a ball. The disc is rounded: all points within half the thickness of a flat disc of
radius R_1, so that with q the point of the flat disc nearest to the ball's centre c,

    n = (c - q) / |c - q|,     gap = |c - q| - R_2 - e/2

Over the disc this is T 3.19; beside it the ball touches when d_t < R_1 + sqrt((R_2 + e/2)^2 - d_n^2), where T 3.20 has
sqrt(R_2^2 - (d_n - e/2)^2): a round rim is touched up to e/2 earlier. There the normal leans as the rim does. T pushes along the
director even there, and so a striker that has passed the plane of the shell would drag the rim of its hole along.

Two shells meet by thin balls, one at each node with half the thickness: the nodes of the first against the faces of the second and the
other way round, so that neither is preferred and a fine shell does not slip through a coarse one. The gap is the distance less both half
thicknesses: each counts once. A face is a whole cell (faces.py). The impulse acts at the point of the face that is nearest, so its corners
share it and no moment is left out. Discs would not do: they are flat, reach over their neighbours and stand out of a fold that is not much
wider than they are, and folds of a crushed tube would lie farther apart than the sheet is thick. Two sides of shells that cross between
their nodes do not see each other.

A rigid body with a surface is met in the same way: the nodes of the shell against its triangles (walls), and its own points, those that can
be the first to touch, against the faces of the shell. A wall has an outer side and no thickness.

Of the faces or walls near a node only those count whose nearest point is nearer than all that lies around it on its body (multipliers.py):
one over a flat or bulging surface, two or three in a corner. The others say the same with normals that lean a little, and a solver that
has to tell a dozen such constraints of one node apart takes a hundred iterations.

The search follows the numbers: few balls are tried against everything, many balls against many discs by a grid.
Candidates are counted and written by their owners in order: the list is the same for any number of threads. Water that is put in another
order keeps its pairs.

Bodies that pairs link are one part (`root`: the smallest body number in it). Each part counts how far it has moved, has its own grid, and
searches its pairs anew when it has moved far enough. So no bit of a part depends on another part.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ... import runtime
from ...bodies.faces import hidden
from ...bodies.surface import Surface
from ...errors import RunStopped
from ...numerics.cells import CUBES, CellGrid, alone, beside, cube, running
from ...pool import Pool
from ...runtime import ti
from ..ports import Port
from .faces import in_triangle, nearest

BALL, DISC, FACE, WALL = range(4)  # what a ball is paired with
WHO, PAIRS, TURNING, BODIES = range(4)  # `Pairs.size`: movers on the list, pairs, first place of those that turn, bodies


class Meetings(NamedTuple):
    """Body x body, symmetric (B, B): whether they meet, Newton's restitution, Coulomb's coefficient of friction."""

    meets: np.ndarray
    restitution: np.ndarray
    friction: np.ndarray


class Table(Pool):
    """`Meetings` on the device; rubs: some bodies have friction."""

    def __init__(self, said: Meetings, name: str = "meetings"):
        super().__init__(name)
        self.rubs = bool((said.friction[said.meets] > 0).any())
        n = len(said.meets)
        self.meets = self.field("meets", n * n, dtype="i32", doc="1: the two bodies may touch")
        self.restitution = self.field("restitution", n * n, dtype="f64", doc="Newton's, 0 for bodies that bounce by themselves")
        self.friction = self.field("friction", n * n, dtype="f64", doc="Coulomb's coefficient")
        runtime.put(self.meets, said.meets.ravel().astype(np.int32))
        runtime.put(self.restitution, said.restitution.ravel().astype(float))
        runtime.put(self.friction, said.friction.ravel().astype(float))


class Pairs(Pool):
    """Candidates (ball, against) and what the solver keeps of each; incidence by mover; parts."""

    kept = ("n",)

    def __init__(self, port: Port, table: Table, name: str = "pairs"):
        super().__init__(name)
        self.port, self.table = port, table
        few, discs, many = port.n_balls - port.n_wide, port.n_discs, port.n_many
        behind = port.n_behind
        single = few - behind
        size = single * single + min(few * few - single * single, 16 * behind)
        size += min(few * discs, 40_000 + 4 * discs) + min(few * many, 20_000 + many)
        size += min(24 * discs, 16 * many)
        if port.thin:
            size += 8 * discs if port.n_bodies == 1 else 16 * discs
        if port.walled:
            size += 8 * discs + 8 * port.n_points
        self.capacity = n = max(size, 64)
        self.n = 0
        field = self.field
        self.ball = field("ball", n, dtype="i32", doc="the ball", keeps=True)
        self.other = field("other", n, dtype="i32", doc="the ball, disc, face or wall that it may touch", keeps=True)
        self.sort = field("sort", n, dtype="i32", doc="what the other is: 0 a ball, 1 a disc, 2 a face, 3 a wall", keeps=True)
        self.p = field("p", n, dtype="f64", unit="N s", doc="impulse: the multiplier times the kick", keeps=True)
        self.a = field("a", n, dtype="i32", doc="place of the ball's mover on the port's list")
        self.b = field("b", n, dtype="i32", doc="place of the other's; of a face's first corner")
        self.normal = field("normal", n, 3, "f64", doc="from b to a")
        self.arm_a = field("arm_a", n, 3, "f64", unit="m", doc="from the place of a to the point of contact")
        self.arm_b = field("arm_b", n, 3, "f64", unit="m", doc="from the place of b")
        self.gap = field("gap", n, dtype="f64", unit="m", doc="negative in penetration")
        self.near = field("near", n, dtype="i32", doc="1: may touch in this step")
        self.slack = field("slack", n, dtype="f64", unit="m/s", doc="free approach speed, plus what the gap still allows")
        self.before = field("before", n, dtype="f64", unit="m/s", doc="normal speed at n - 1/2")
        self.free = field("free", n, dtype="f64", unit="m/s", doc="normal speed at n + 1/2 without contact")
        self.weight = field("weight", n, dtype="f64", unit="1/kg", doc="diagonal with split masses")
        self.y = field("y", n, dtype="f64", unit="N s", doc="impulse, extrapolated")
        self.size = field("size", 4, dtype="i32", doc="movers on the list, pairs, first place of those that turn, bodies")
        self.now = field("now", max(many, 1), dtype="i32", doc="number of a ball that had this number at the step before")
        faces, rubs = n if port.thin else 1, n if table.rubs else 1
        self.corner = field("corner", faces, 4, "i32", doc="places of a face's corners; of a triangle's third one twice")
        self.split = field("split", faces, 4, "f64", doc="parts that the corners have of the nearest point")
        self.away = field("away", faces, dtype="f64", unit="m", doc="from a face or wall; the wall that is faced is a trace nearer")
        walls = n if port.walled else 1
        self.inside = field("inside", walls, dtype="i32", doc="1: the node is behind the wall")
        self.q = field("q", rubs, 3, "f64", unit="N s", doc="impulse of friction on the ball", keeps=table.rubs)
        self.z = field("z", rubs, 3, "f64", unit="N s", doc="impulse of friction, extrapolated")
        self.slip_before = field("slip_before", rubs, 3, "f64", unit="m/s", doc="velocity along the contact at n - 1/2")
        self.slip = field("slip", rubs, 3, "f64", unit="m/s", doc="velocity along the contact at n + 1/2 without contact")
        # incidence: the mover at place m takes part in entries first[m] .. first[m + 1]; entry = `sides` pair + (0 as a, 1 as b, or 1 .. 4
        # as a corner)
        self.sides = 5 if port.thin else 2
        self.n_who = 0
        self.bounds = np.zeros(len(port.surfaces) + 1, int)
        room = min(port.n, self.sides * n)
        self.place = field("place", port.n + 1, dtype="i32", doc="where the next entry of a mover goes")
        self.first = field("first", room + 1, dtype="i32", doc="first entry at a place of the list")
        self.part = field("part", room, dtype="i32", doc="part of the mover there")
        self.entry = field("entry", self.sides * n, dtype="i32", doc="sides pair + (0 as a, 1 as b, 1 .. 4 as a corner)")
        self.root = field("root", port.n_bodies, dtype="i32", doc="part of a body: the smallest number of a body in it")
        self.starts = field("starts", len(port.surfaces) + 1, dtype="i32", doc="first movers of the groups, then their places on the list")
        self.start = field("start", port.n_discs + port.n_balls + 1, dtype="i32", doc="entries of an owner, in a search")
        self.movers = np.array([*(s.first.mover for s in port.surfaces), port.n], np.int32)
        if port.n_discs and port.n_many:
            self.grid = CellGrid("pairs.grid", port.disc_x, port.n_discs, 1.0)  # its reach is that of each search
        if port.thin:
            self.face_grid = CellGrid("pairs.faces.grid", port.face_x, port.n_faces, 1.0)
        if port.walled:
            self.wall_grid = CellGrid("pairs.walls.grid", port.wall_x, port.n_walls, 1.0)

    def search(self, parts: list[np.ndarray], reach: np.ndarray) -> list[np.ndarray]:
        """New candidates of these parts (arrays of body numbers); returns the parts as they are then.

        reach (B,) [m]: how far from contact a pair with each body is still a candidate. A part that finds another one is joined with it
        and searched again.
        """
        port = self.port
        root = runtime.get(self.root, port.n_bodies)
        done: list[np.ndarray] = []
        waiting = list(parts)
        shaped = np.concatenate(parts)
        self._drop(shaped)
        self._mark(shaped)
        port.look(places=True)
        while waiting:
            part = waiting.pop(0)
            self._mark(part)
            if not np.isin(part, shaped).all():
                port.look(places=True)
                shaped = np.union1d(shaped, part)
            met = self._search(part, float(reach[part].max()))
            if not len(met):
                done.append(part)
                continue
            joined = [part, np.flatnonzero(np.isin(root, root[met]))]
            for others in (waiting, done):
                for other in [o for o in others if np.isin(o, np.concatenate(joined)).any()]:
                    joined.append(other)
                    del others[next(k for k, o in enumerate(others) if o is other)]
            whole = np.unique(np.concatenate(joined))
            self._drop(whole)
            waiting.insert(0, whole)
        self.list_movers()
        return done

    def _search(self, part: np.ndarray, reach: float) -> np.ndarray:
        """Candidates with a body of this part, behind those that are there; returns the numbers of other bodies among them."""
        port = self.port
        runtime.fill(port.linked, 0)
        owners = port.n_discs + port.n_many + port.n_balls - port.n_wide
        before = self.n
        if port.n_balls > port.n_wide:
            self._collect(_few, owners, reach, port.n_discs, port.n_many, port.n_wide, port.n_balls)
        if port.n_discs and port.n_many and (port.widest[part] > 0.0).any():
            largest = runtime.get(port.largest, port.n_bodies) + port.half
            self._by_grid(self.grid, _near_discs, port.n_many, part, largest * (port.half > 0), reach)
        flat = (port.half[part] > 0.0).any() or (port.widest_wall[part] > 0.0).any()
        if port.thin and flat:
            largest = runtime.get(port.widest_face, port.n_bodies) + port.half
            self._by_grid(self.face_grid, _near_faces, port.n_discs + port.n_points, part, largest * (port.half > 0), reach)
        if port.walled and flat:
            self._by_grid(self.wall_grid, _near_walls, port.n_discs, part, port.widest_wall, reach)
        return np.flatnonzero(runtime.get(port.linked, port.n_bodies)) if self.n > before else np.zeros(0, int)

    def follow(self, surface: Surface) -> None:
        """Pairs of a group whose movers have been put in another order: the balls keep what they may touch."""
        if self.n:
            _renumber(self, surface.source, self.n, surface.first.ball, surface.n_balls)

    def _by_grid(self, grid: CellGrid, look: Callable[..., None], owners: int, part: np.ndarray, largest: np.ndarray, reach: float) -> None:
        """What the balls of `owners` find by a grid of discs or faces; largest (B,) [m]: of each body, from its place on the grid."""
        port, wide = self.port, self.n
        for bodies in (np.arange(port.n_bodies), part):  # a grid of others' elements would list the part's own in another order
            near = float(largest[bodies].max()) + float(port.widest[bodies].max()) + reach
            if bodies is part and (self.n == wide or near == grid.reach or runtime.get(port.linked, port.n_bodies).any()):
                break
            self.n, grid.reach = wide, near
            grid.rebuild()
            self._collect(look, owners, reach, 1.0 / near, grid.table)

    def _mark(self, part: np.ndarray) -> None:
        due = np.zeros(self.port.n_bodies, np.int32)
        due[part] = 1
        runtime.put(self.port.due, due)

    def _drop(self, bodies: np.ndarray) -> None:
        """Forget the candidates with one of these bodies."""
        if self.n == 0 or len(bodies) == self.port.n_bodies:
            self.n = 0
            return
        self._mark(bodies)
        self.n = _keep(self, self.n) if runtime.one_by_one() else self._kept()

    def _kept(self) -> int:
        """The same as `_keep`, in NumPy."""
        port = self.port
        due, body = runtime.get(port.due, port.n_bodies), runtime.get(port.body, port.n)
        keep = due[body[self._movers()[:, :2]]].sum(axis=1) == 0
        for field in (self.ball, self.other, self.sort, self.p, *([self.q] if self.table.rubs else [])):
            runtime.put(field, runtime.get(field, self.n)[keep])
        return int(keep.sum())

    def _movers(self) -> np.ndarray:
        """(n, sides) movers on the sides of each pair, -1 where there is none: `_side`, in NumPy."""
        port, get = self.port, runtime.get
        other, sort = get(self.other, self.n), get(self.sort, self.n)
        balls, discs = get(port.ball_mover, port.n_balls), get(port.disc_mover, max(port.n_discs, 1))
        movers = np.full((self.n, self.sides), -1, np.int32)
        movers[:, 0] = balls[get(self.ball, self.n)]
        movers[sort == BALL, 1] = balls[other[sort == BALL]]
        movers[sort == DISC, 1] = discs[other[sort == DISC]]
        movers[sort == WALL, 1] = balls[get(port.wall_point, max(port.n_walls, 1))[other[sort == WALL], 0]]
        if port.thin:
            corners = get(port.face_disc, port.n_faces)[other[sort == FACE]]
            movers[sort == FACE, 1:] = np.where(corners < 0, -1, discs[corners])
        return movers

    def list_movers(self) -> None:
        """The list of the port and the pairs of each mover on it, from the list of pairs."""
        port = self.port
        if runtime.one_by_one():
            runtime.put(self.starts, self.movers)
            self.n_who = _incidence(self, self.n, port.n, port.n_bodies, len(self.movers))
            self.bounds = runtime.get(self.starts, len(self.movers))
        else:
            self._incidence()
        turning = [bound for s, bound in zip(port.surfaces, self.bounds, strict=False) if s.turns]
        port.turning = int(turning[0]) if turning else self.n_who
        runtime.put(self.size, np.array([self.n_who, self.n, port.turning, port.n_bodies], np.int32))

    def _incidence(self) -> None:
        """The same as `_incidence`, in NumPy."""
        port, put = self.port, runtime.put
        movers = self._movers()
        body = runtime.get(port.body, port.n)
        root, before = np.arange(port.n_bodies, dtype=np.int32), None
        one, other = np.unique(body[movers[:, :2]], axis=0).T
        while before is None or (root != before).any():  # each link hands the smaller number on
            before = root.copy()
            np.minimum.at(root, other, root[one])
            np.minimum.at(root, one, root[other])
            root = root[root]
        entry = np.flatnonzero(movers >= 0)  # its number is `sides` pair + side
        mover = movers.ravel()[entry]
        who, count = np.unique(mover, return_counts=True)
        place = np.searchsorted(who, movers).astype(np.int32)
        self.n_who = len(who)
        self.bounds = np.searchsorted(who, self.movers)
        put(self.root, root)
        put(port.who, who)
        put(port.whose, body[who])
        put(self.part, root[body[who]])
        put(self.first, np.concatenate([[0], np.cumsum(count)]).astype(np.int32))
        put(self.entry, entry[np.argsort(mover, kind="stable")].astype(np.int32))
        put(self.a, place[:, 0])
        put(self.b, place[:, 1])
        if port.thin:
            put(self.corner, np.where(movers[:, 1:] < 0, place[:, [1, 2, 3, 3]], place[:, 1:]))  # of a triangle the last one twice

    def renew(self) -> None:
        self.list_movers()

    def _collect(self, look: Callable[..., None], owners: int, reach: float, *more: Any) -> None:
        """Count what each owner finds, then have it written behind what is there."""
        look(self, owners, reach, 0, self.n, self.port.n_bodies, *more)
        found = running(self.start, owners)
        if self.n + found > self.capacity:
            raise RunStopped(
                f"contact: {self.n + found} pairs of pinballs are near each other and {self.capacity} have room; the bodies "
                "are likely crushed into each other: look at the last frame, lower the speed or the spacing"
            )
        if found:
            look(self, owners, reach, 1, self.n, self.port.n_bodies, *more)
        self.n += found


@ti.func
def disc_gap(x, n, radius, half, c, ball):
    """(gap, normal) from a disc at x across n with this radius and half thickness to a ball at c with the radius `ball`."""
    away = c - x
    flat = away - away.dot(n) * n
    d = flat.norm()
    if d > radius:
        flat *= radius / d
    q = x + flat
    normal = c - q
    distance = normal.norm()
    if distance > 1e-12 * (ball + half):
        normal /= distance
    else:
        normal = n
    return distance - ball - half, normal


@ti.func
def _may(pairs: ti.template(), bodies, one, other):
    """Whether two bodies may meet and one of them is due; marks the one that is not."""
    port = pairs.port
    found = 0
    if pairs.table.meets[one * bodies + other] == 1 and port.due[one] + port.due[other] > 0:
        found = 1
        if port.due[one] == 0:
            port.linked[one] = 1
        if port.due[other] == 0:
            port.linked[other] = 1
    return found


@ti.func
def _note(pairs: ti.template(), k, ball, other, sort):
    pairs.ball[k], pairs.other[k], pairs.sort[k] = ball, other, sort
    pairs.p[k] = 0.0
    if ti.static(pairs.table.rubs):
        pairs.q[k] *= 0.0


@ti.kernel
def _few(
    pairs: ti.template(), n: ti.i32, reach: ti.f64, write: ti.i32, base: ti.i32, bodies: ti.i32, discs: ti.i32, many: ti.i32, first: ti.i32,
    last: ti.i32,
):  # fmt: skip
    """The balls first .. last - 1 against discs, against the many balls, and among themselves. Owners: discs, many balls, few balls."""
    port = pairs.port
    for o in range(n):
        found = 0
        if o < discs:
            x, radius, half, one = port.disc_x[o], port.disc_radius[o], port.disc_half[o], port.disc_body[o]
            for p in range(first, last):
                c, ball = port.ball_x[p], port.ball_radius[p][0]
                far = ball + radius + half + reach
                if (c - x).norm_sqr() < far * far:
                    gap, normal = disc_gap(x, port.disc_n[o], radius, half, c, ball)
                    stands_for = 0  # a wall, which this body meets itself
                    if ti.static(port.walled):
                        stands_for = port.behind[port.ball_body[p]] * port.faced[one]
                    if gap < reach and stands_for == 0 and _may(pairs, bodies, port.ball_body[p], one) == 1:
                        if write == 1:
                            _note(pairs, base + pairs.start[o] + found, p, o, DISC)
                        found += 1
        else:
            mine = o - discs
            end = last
            if mine >= many:  # one of the few: each two once
                mine += first - many
                end = mine
            c, radius, one = port.ball_x[mine], port.ball_radius[mine][0], port.ball_body[mine]
            for p in range(first, end):
                far = radius + port.ball_radius[p][0] + reach
                if (port.ball_x[p] - c).norm_sqr() < far * far:
                    if port.ball_body[p] != one and _may(pairs, bodies, port.ball_body[p], one) == 1:
                        if write == 1:
                            _note(pairs, base + pairs.start[o] + found, mine, p, BALL)
                        found += 1
        if write == 0:
            pairs.start[o + 1] = found


@ti.kernel
def _near_discs(
    pairs: ti.template(), n: ti.i32, reach: ti.f64, write: ti.i32, base: ti.i32, bodies: ti.i32, inverse: ti.f64, table: ti.i32
):
    """Discs near the many balls, by the grid of the discs."""
    port = pairs.port
    for j in range(n):
        found = 0
        c, one = port.ball_x[j], port.ball_body[j]
        looks = 0  # most find nothing
        if write == 1:
            looks = pairs.start[j + 1] - pairs.start[j]
        elif not alone(pairs.grid, c, inverse, table):
            looks = 1
        if looks > 0:
            for k in range(CUBES):
                there, first, last = beside(pairs.grid, c, k, inverse, table)
                for m in range(first, last):
                    i = pairs.grid.sorted[m]
                    x, half, flat = port.disc_x[i], port.disc_half[i], port.disc_radius[i]
                    radius = port.ball_radius[j][port.disc_sound[i]]
                    far = radius + flat + half + reach
                    if (c - x).norm_sqr() < far * far:
                        if all(cube(x, inverse) == there):
                            gap, normal = disc_gap(x, port.disc_n[i], flat, half, c, radius)
                            if gap < reach and _may(pairs, bodies, one, port.disc_body[i]) == 1:
                                if write == 1:
                                    _note(pairs, base + pairs.start[j] + found, j, i, DISC)
                                found += 1
        if write == 0:
            pairs.start[j + 1] = found


@ti.func
def _looks(pairs: ti.template(), d):
    """1: thin ball d looks for faces. Those of nodes that are met do, and those of the tips of walls."""
    port = pairs.port
    result = ti.select(hidden(port.ball_x[port.n_many + d]), 0, 1)
    if ti.static(port.walled):
        if d >= port.n_discs:
            result = port.tip[d - port.n_discs]
    return result


@ti.kernel
def _near_faces(
    pairs: ti.template(), n: ti.i32, reach: ti.f64, write: ti.i32, base: ti.i32, bodies: ti.i32, inverse: ti.f64, table: ti.i32
):
    """Faces near the thin balls, one of each disc, and near the tips of walls, by the grid of the faces."""
    port = pairs.port
    for d in range(n):
        found, mine = 0, port.n_many + d
        c, one, ball = port.ball_x[mine], port.ball_body[mine], port.ball_radius[mine][0]
        if _looks(pairs, d) == 1 and (write == 0 or pairs.start[d + 1] > pairs.start[d]):
            for k in range(CUBES):
                there, first, last = beside(pairs.face_grid, c, k, inverse, table)
                for m in range(first, last):
                    f = pairs.face_grid.sorted[m]
                    x, half, size = port.face_x[f], port.disc_half[port.face_disc[f][0]], port.face_reach[f]
                    for j in ti.static(range(1, 4)):
                        if port.face_disc[f][j] >= 0:
                            half = ti.max(half, port.disc_half[port.face_disc[f][j]])
                    far = ball + half + size + reach
                    if size >= 0.0 and (c - x).norm_sqr() < far * far:
                        if all(cube(x, inverse) == there) and _two_things(pairs, d, f) == 1:
                            corners = port.face_disc[f]
                            sides = ti.select(corners[3] < 0, 3, 4)
                            corners[3] = ti.select(corners[3] < 0, corners[2], corners[3])
                            split, q = nearest(
                                port.disc_x[corners[0]], port.disc_x[corners[1]], port.disc_x[corners[2]], port.disc_x[corners[3]], sides, c
                            )
                            if (c - q).norm() - ball - half < reach and _may(pairs, bodies, one, port.disc_body[corners[0]]) == 1:
                                if write == 1:
                                    _note(pairs, base + pairs.start[d] + found, mine, f, FACE)
                                found += 1
        if write == 0:
            pairs.start[d + 1] = found


@ti.kernel
def _near_walls(
    pairs: ti.template(), n: ti.i32, reach: ti.f64, write: ti.i32, base: ti.i32, bodies: ti.i32, inverse: ti.f64, table: ti.i32
):
    """Walls near the thin balls of bodies with faces, by the grid of the walls."""
    port = pairs.port
    for d in range(n):
        found = 0
        c, one, ball = port.disc_x[d], port.disc_body[d], port.disc_half[d]
        if port.faced[one] == 1 and not hidden(c) and (write == 0 or pairs.start[d + 1] > pairs.start[d]):
            for k in range(CUBES):
                there, first, last = beside(pairs.wall_grid, c, k, inverse, table)
                for m in range(first, last):
                    w = pairs.wall_grid.sorted[m]
                    x, at = port.wall_x[w], port.wall_point[w]
                    far = ball + port.wall_reach[w] + reach
                    if (c - x).norm_sqr() < far * far:
                        if all(cube(x, inverse) == there):
                            i, j, l = at[0], at[1], at[2]
                            s = in_triangle(port.ball_x[i], port.ball_x[j], port.ball_x[l], c)
                            q = s[0] * port.ball_x[i] + s[1] * port.ball_x[j] + s[2] * port.ball_x[l]
                            if (c - q).norm() - ball < reach and _may(pairs, bodies, one, port.ball_body[i]) == 1:
                                if write == 1:
                                    _note(pairs, base + pairs.start[d] + found, port.n_many + d, w, WALL)
                                found += 1
        if write == 0:
            pairs.start[d + 1] = found


@ti.func
def _two_things(pairs: ti.template(), d, f):
    """Whether the node of disc d and the face f are two things that meet: of one shell, when the node is no corner and farther than two
    thicknesses from all of them in the reference. A sheet that is folded upon itself is 1.6 thicknesses longer on the way round."""
    port = pairs.port
    result = 1
    corners = port.face_disc[f]
    if port.ball_body[port.n_many + d] == port.disc_body[corners[0]]:
        for k in range(4):
            if corners[k] >= 0:
                if (port.disc_X[corners[k]] - port.disc_X[d]).norm() <= 4.0 * port.disc_half[d]:
                    result = 0
    return result


@ti.func
def _other_mover(pairs: ti.template(), k):
    """Of a face that of its first corner."""
    p = 0
    if pairs.sort[k] == BALL:
        p = pairs.port.ball_mover[pairs.other[k]]
    elif pairs.sort[k] == DISC:
        p = pairs.port.disc_mover[pairs.other[k]]
    elif pairs.sort[k] == WALL:
        p = pairs.port.ball_mover[pairs.port.wall_point[pairs.other[k]][0]]
    else:
        p = pairs.port.disc_mover[pairs.port.face_disc[pairs.other[k]][0]]
    return p


@ti.func
def _side(pairs: ti.template(), k, side):
    """Mover on a side of pair k (0: a, 1: b; of a face its corners, 1 to 4), -1 where there is none."""
    p = -1
    if side == 0:
        p = pairs.port.ball_mover[pairs.ball[k]]
    elif pairs.sort[k] == FACE:
        d = pairs.port.face_disc[pairs.other[k]][side - 1]
        if d >= 0:
            p = pairs.port.disc_mover[d]
    elif side == 1:
        p = _other_mover(pairs, k)
    return p


@ti.kernel
def _renumber(pairs: ti.template(), source: ti.template(), n: ti.i32, first: ti.i32, balls: ti.i32):
    for k in range(balls):
        pairs.now[source[k]] = k
    for k in range(n):
        ball = pairs.ball[k] - first
        if ball >= 0 and ball < balls:
            pairs.ball[k] = first + pairs.now[ball]


@ti.kernel
def _keep(pairs: ti.template(), n: ti.i32) -> ti.i32:
    """Close the ranks of the pairs whose bodies are not due; returns how many they are."""
    port = pairs.port
    kept = 0
    ti.loop_config(serialize=True)
    for k in range(n):
        ball, other, sort = pairs.ball[k], pairs.other[k], pairs.sort[k]
        if port.due[port.ball_body[ball]] + port.due[port.body[_other_mover(pairs, k)]] == 0:
            pairs.ball[kept], pairs.other[kept], pairs.sort[kept] = ball, other, sort
            pairs.p[kept] = pairs.p[k]
            if ti.static(pairs.table.rubs):
                pairs.q[kept] = pairs.q[k]
            kept += 1
    return kept


@ti.func
def _root(pairs: ti.template(), body):
    r = body
    while pairs.root[r] != r:
        r = pairs.root[r]
    return r


@ti.kernel
def _incidence(pairs: ti.template(), n: ti.i32, movers: ti.i32, bodies: ti.i32, groups: ti.i32) -> ti.i32:
    """The port's list, the entries of each mover on it in the order of the pairs, and the parts; returns how many are on the list."""
    port = pairs.port
    listed = 0
    ti.loop_config(serialize=True)
    for _ in range(1):
        for p in range(movers + 1):
            pairs.place[p] = 0
        for b in range(bodies):
            pairs.root[b] = b
        for k in range(n):
            one, other = port.ball_mover[pairs.ball[k]], _other_mover(pairs, k)
            for side in range(ti.static(pairs.sides)):
                p = _side(pairs, k, side)
                if p >= 0:
                    pairs.place[p + 1] += 1
            r, s = _root(pairs, port.body[one]), _root(pairs, port.body[other])
            pairs.root[ti.max(r, s)] = ti.min(r, s)
        for b in range(bodies):
            pairs.root[b] = _root(pairs, b)
        g = 0
        for p in range(movers):
            while g < groups and pairs.starts[g] == p:
                pairs.starts[g] = listed
                g += 1
            count = pairs.place[p + 1]
            if count > 0:
                port.who[listed], port.whose[listed] = p, port.body[p]
                pairs.first[listed] = pairs.place[p]
                pairs.part[listed] = pairs.root[port.body[p]]
                listed += 1
            pairs.place[p + 1] += pairs.place[p]
        while g < groups:
            pairs.starts[g] = listed
            g += 1
        pairs.first[listed] = pairs.place[movers]
        for k in range(n):
            for side in range(ti.static(pairs.sides)):
                p = _side(pairs, k, side)
                if p >= 0:
                    pairs.entry[pairs.place[p]] = ti.static(pairs.sides) * k + side
                    pairs.place[p] += 1
        for m in range(listed):
            for e in range(pairs.first[m], pairs.first[m + 1]):
                k, side = pairs.entry[e] // ti.static(pairs.sides), pairs.entry[e] % ti.static(pairs.sides)
                if side == 0:
                    pairs.a[k] = m
                elif side == 1:
                    pairs.b[k] = m
                if ti.static(pairs.port.thin):
                    if side > 0 and pairs.sort[k] == FACE:
                        pairs.corner[k][side - 1] = m
                        if side == 3 and port.face_disc[pairs.other[k]][3] < 0:  # of a triangle the last one, which stands twice
                            pairs.corner[k][side] = m  # Taichi writes [3] to the third byte where it writes [side - 1] beside it
    return listed

"""Contact forces as multipliers of a unilateral constraint on the half-step velocities (T 3.8 to 3.18).

For each pair of pinballs, with v* the velocities at n+1/2 if there were no contact (T 3.17) and c the row of normals,

    c (v* + M^-1 c^T p) >= -<gap>_+ / dt,     p >= 0,     p = 0 where the left side is above the right one

Where p > 0 this reads b p = w, with b = c M^-1 c^T (T 3.15, 3.16). Where bodies part by themselves there is no force: this is the rebound
of T 3.18. T decides which pairs rebound before it solves; here the solver finds these pairs together with the forces. The gap on the right
lets a pair come to touch and no further. Penetration therefore stays at the order of what the normals turn in a step. Between two bodies
with a restitution the right side is Newton's rebound speed. Impulses are equal and opposite on each pair, so linear momentum is kept to
rounding.

Two bodies that rub (mu > 0) have an impulse q along the contact as well. With s the velocity there at n+1/2,

    |q| <= mu p,     q = -mu p s/|s| where s is not 0

This is Coulomb's law itself. A ball that slides is not lifted; the usual projection of (p, q) on a cone would lift it. In an iteration q
follows its own gradient and is brought back to the disc of radius mu p, with the p of the same iteration.

Solved by accelerated projected gradients (Nesterov; Mazhar et al. 2015), each pair scaled by the inverse masses that
it would see if every mover were split among its pairs (Tonge et al. 2012): that scaling bounds b from above for any set of
pairs, redundant ones too. A corner of a face that takes the part w of an impulse counts as w pairs, for
(sum w p)^2 <= sum w  sum w p^2. The momentum of a pair restarts when it climbs (after O'Donoghue and Candes 2015, who restart all at
once). Pairs gather from movers and movers from pairs: no scatter, one result for any number of threads.

Bodies that pairs link are a part (pairs.py). Each part has its own tolerance and ends when it has reached it, so that no part follows from
another one far away.
"""

import math

import numpy as np

from ... import launch, runtime
from ...bodies.body import Now
from ...bodies.surface import Surface
from ...errors import RunStopped, SceneError
from ...pool import Pool
from ...runtime import ti
from ..carried import Carried
from ..ports import Port
from .faces import in_triangle, nearest
from .pairs import BODIES, DISC, FACE, PAIRS, TURNING, WALL, WHO, Pairs, Table, disc_gap
from .said import PinballContact

BLOCK = 512
SHAPE, SEARCH = 1, 2  # what a part is due for: new shapes of its discs, new pairs as well
PAIRS_NEAR, MOVERS = range(2)  # `Contact.count`: of the pairs that are solved for, and of their movers
FIRST, CHECK = 2, 8  # iterations before the first look at the error; the most between two looks
SMALL_LIST = 4096  # pairs; fewer that are near are solved by one thread, faster than threads are woken
FAR = 1e30  # m: a way after which anything must be searched
SAME = 1e-9  # of half a thickness, or of a side: two walls have one nearest point
SMALL = 1e-2  # of the fastest speed: an approach below it is not resolved any finer


class Contact(Pool):
    """All contact of a run. `add` puts its forces on the bodies; the rest is for the record."""

    kept = ("all_iterations", "solves", "unsolved", "largest_error")

    def __init__(
        self,
        port: Port,
        table: Table,
        settings: PinballContact,
        skin: float,
        close: float,
        hidden: Carried | None = None,
        name: str = "contact",
    ):
        """skin [m]: how far beyond contact pairs are kept ready; close [m]: half the size of the smallest element, what little is a part
        of; hidden: strikers that hide from a fluid what they touch."""
        super().__init__(name)
        self.port, self.settings, self.skin, self.close = port, settings, skin, close
        self.hidden, self.hides = hidden, hidden is not None
        self.pairs = pairs = Pairs(port, table)
        room, bodies = min(port.n, pairs.sides * pairs.capacity), port.n_bodies
        blocks = -(-pairs.capacity // BLOCK)
        self.blocks = blocks
        field = self.field
        self.dv = field("dv", room, 3, "f64", unit="m/s", doc="change of velocity by the impulses, at a place of the port's list")
        self.dw = field("dw", max(port.n - port.n_still, 1), 3, "f64", unit="rad/s", doc="change of spin, of those that turn")
        self.share = field("share", room, dtype="f64", doc="near pairs of a mover; of a face's corner its part counts")
        self.met = field("met", room, dtype="i32", doc="1: a mover has near pairs, in a part where something closes")
        self.acting = field("acting", pairs.capacity, dtype="i32", doc="the pairs that are solved for")
        self.moved = field("moved", room, dtype="i32", doc="places of their movers on the port's list")
        self.count = field("count", 2, dtype="i32", doc="how many those pairs and movers are")
        self.work = field("work", blocks, dtype="f64", unit="J", doc="done on the bodies up to time n, by blocks of pairs", keeps=True)
        self.ahead = field("ahead", blocks, dtype="f64", unit="J", doc="what contact does on the way to n + 1", keeps=True)
        rubbed = blocks if table.rubs else 1
        self.rubbed = field("rubbed", rubbed, dtype="f64", unit="J", doc="work of friction up to time n", keeps=table.rubs)
        self.rubs_ahead = field("rubs_ahead", rubbed, dtype="f64", unit="J", doc="what friction does on the way to n + 1", keeps=table.rubs)
        self.deepest = field("deepest", 1, dtype="f64", unit="m", doc="largest penetration so far", keeps=True)
        # by body; of a part what stands at each of its bodies
        self.travelled = field("travelled", bodies, dtype="f64", unit="m", doc="since the last search, by the end of this step", keeps=True)
        self.aged = field("aged", bodies, dtype="f64", unit="m", doc="the same since discs were shaped", keeps=True)
        self.going = field("going", bodies, dtype="f64", unit="m", doc="part of it that lies ahead")
        # by part, at its root
        self.lasting = field("lasting", bodies, dtype="i32", doc="steps of the clock that lie ahead at once")
        self.top = field("top", bodies, dtype="f64", unit="m/s", doc="fastest speed of a part")
        self.closing = field("closing", bodies, dtype="f64", unit="m/s", doc="largest free approach beyond what is allowed")
        self.scale = field("scale", bodies, dtype="f64", unit="m/s", doc="what the tolerance is a part of")
        self.error = field("error", bodies, dtype="f64", unit="m/s", doc="largest violation")
        self.open = field("open", bodies, dtype="i32", doc="1: is being solved")
        runtime.fill(self.travelled, FAR)
        runtime.fill(self.aged, FAR)
        self.did = field("did", 1, dtype="i32", doc="iterations of the last step that one thread made")
        self.acts = 0  # bodies that contact pushes in this step
        self.touching = 0  # pairs with a force
        self.iterations = 0  # of the last step
        self.all_iterations, self.solves, self.unsolved = 0, 0, 0
        self.largest_error = 0.0  # of a step, over its tolerance's scale
        self.seconds = 0.0

    def pools(self) -> list[Pool]:
        """In the order of a restart."""
        return [self.port, self.pairs.table, *([] if self.hidden is None else [self.hidden]), self.pairs, self]

    def renew(self) -> None:
        """What is told of the last step: a world that ran before forgets its own."""
        self.touching, self.iterations = 0, 0

    def check_start(self) -> None:
        """SceneError when bodies lie in each other at t = 0."""
        port, pairs = self.port, self.pairs
        pairs.search([np.arange(port.n_bodies)], np.full(port.n_bodies, self.skin))
        if not pairs.n:
            return
        port.offer(pairs.bounds, Now())
        _measure(self, 0.0, self.close, 0, 0)
        owner = runtime.get(port.whose, pairs.n_who)
        a, b = (owner[runtime.get(side, pairs.n)] for side in (pairs.a, pairs.b))
        gap = runtime.get(pairs.gap, pairs.n)
        gap[a == b] = 0.0
        gap[port.loose[a] | port.loose[b]] += 0.5 * self.close  # a filling may touch its vessel
        k = int(np.argmin(gap))
        allowed = 1e-3 * self.close
        if gap[k] < -allowed:
            one, two = (f"{port.of(body).group.kind} '{port.names[body]}'" for body in (a[k], b[k]))
            hint = "move one of them away, pinballs touch at most"
            if port.loose[a[k]] or port.loose[b[k]]:
                hint += "; a filling whose particles are coarse comes to lie in the corners of its vessel: lower the fluid's spacing"
            raise SceneError(f"{one} starts {1e3 * -gap[k]:.3g} mm inside {two}: {hint}")

    def add(self, now: Now, common: int, books: bool = True) -> None:
        """Forces of contact at the present time, once all others are known. common: steps after which all groups are due together; books:
        nothing else changes the velocities to come, and the work is known."""
        began = launch.working()
        port, pairs = self.port, self.pairs
        step = now.step % common
        port.look()
        renumbered = [s for s in port.surfaces if s.renumbered]
        for s in renumbered:
            if s.source is None:
                self._forget(s)
            else:
                pairs.follow(s)
        if _wear(self, port.n_bodies, now.dt, self.skin, self.close, step):
            self._look_again()
        if any(s.source is not None for s in renumbered):
            pairs.list_movers()
        self.iterations = 0
        self.acts = 0
        if pairs.n:
            port.offer(pairs.bounds, now)
            self.acts = _measure(self, now.dt, self.close, 1, step)
            if self.acts:
                self._solve()
                port.take(pairs.bounds, now)
        self.seconds += launch.working() - began
        if books:
            self.book(now)

    def book(self, now: Now, anew: bool = False) -> None:
        """The work of contact. anew: by the velocities to come as they are now, for impulses came after those of contact."""
        began = launch.working()
        if anew and self.acts:
            self.port.offer(self.pairs.bounds, now)
            _met(self)
        self.touching = _book(self, self.blocks, now.dt_before, now.dt, 1.0 / now.kick, self.acts)
        self.seconds += launch.working() - began

    def _forget(self, surface: Surface) -> None:
        """What the bodies of a group may touch is searched for in this step."""
        first = surface.first.body
        travelled = runtime.get(self.travelled, self.port.n_bodies)
        travelled[first : first + len(surface.bodies)] = FAR
        runtime.put(self.travelled, travelled)

    def _look_again(self) -> None:
        """New pairs of the parts that are due for them, new shapes of the discs of all that are due."""
        n, port = self.port.n_bodies, self.port
        due, root = runtime.get(port.due, n), runtime.get(self.pairs.root, n)
        going, travelled, aged = runtime.get(self.going, n), runtime.get(self.travelled, n), runtime.get(self.aged, n)
        parts = [np.flatnonzero(root == r) for r in np.unique(root[due == SEARCH])]
        if (due == SHAPE).any():
            runtime.put(port.due, (due == SHAPE).astype(np.int32))
            port.look(places=True)
            aged[due == SHAPE] = going[due == SHAPE]
        if parts:
            for part in self.pairs.search(parts, self.skin + 2.0 * going):
                travelled[part] = aged[part] = going[part].max()
        runtime.put(self.travelled, travelled)
        runtime.put(self.aged, aged)

    def _solve(self) -> None:
        most, tolerance = self.settings.iterations, self.settings.tolerance
        if runtime.one_by_one():
            acting = _list_acting(self)
        else:
            acting = self._list_acting()
        if runtime.one_by_one() and acting < SMALL_LIST:
            error = _solve_here(self, most, tolerance)
            self.iterations = int(self.did[0])
        else:
            error = self._solve_together(most, tolerance)
        if not np.isfinite(error):
            raise RunStopped(
                "contact: the velocities of touching bodies are no numbers any more; the step is likely too long: lower "
                "numerics.time_step_safety, and look at the last frame"
            )
        self.unsolved += int(error > tolerance)
        self.largest_error = max(self.largest_error, error)
        self.all_iterations += self.iterations
        self.solves += 1

    def _list_acting(self) -> int:
        """The same as `_list_acting`, in NumPy."""
        pairs, get = self.pairs, runtime.get
        met = get(self.met, pairs.n_who)
        acting = np.flatnonzero((get(pairs.near, pairs.n) == 1) & (met[get(pairs.a, pairs.n)] == 1)).astype(np.int32)
        moved = np.flatnonzero(met).astype(np.int32)
        runtime.put(self.acting, acting)
        runtime.put(self.moved, moved)
        runtime.put(self.count, np.array([len(acting), len(moved)], np.int32))
        return len(acting)

    def _solve_together(self, most: int, tolerance: float) -> float:
        """`_solve_here` with a loop of all threads for each part of an iteration, to the same bits; returns the error left."""
        t, some = 1.0, FIRST
        error = np.inf
        while self.iterations < most:
            some = min(some, most - self.iterations)
            for done in range(0, some, 2):
                second, third = _next(t), _next(_next(t))
                twice = int(some - done > 1)
                _iterate(self, (t - 1.0) / second, (second - 1.0) / third, twice)
                t = third if twice else second
            self.iterations += some
            some = min(2 * some, CHECK)
            error = _error(self, tolerance)
            if error <= tolerance or not np.isfinite(error):
                break
        return error

    @property
    def penetration(self) -> float:
        """Largest so far [m]."""
        return float(self.deepest[0])

    def taken(self) -> dict[str, float]:
        """Energy that contact took [J], and friction where bodies rub, up to the time of the last force evaluation."""
        found = {"contact": -float(runtime.get(self.work, self.blocks).sum())}
        if self.pairs.table.rubs:
            found["friction"] = -float(runtime.get(self.rubbed, self.blocks).sum())
        return found

    def report(self) -> dict[str, float]:
        """What contact cost and how well it was solved, for the summary."""
        return {
            "iterations_per_step": self.all_iterations / max(self.solves, 1),
            "solves": self.solves,
            "unsolved": self.unsolved,
            "largest_error": self.largest_error,
            "penetration": self.penetration,
            "seconds": self.seconds,
        }


def _next(t: float) -> float:
    """Nesterov's sequence."""
    return 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * t * t))


@ti.kernel
def _wear(contact: ti.template(), bodies: ti.i32, dt: ti.f64, skin: ti.f64, close: ti.f64, step: ti.i32) -> ti.i32:
    """How far each part has gone by the end of this step; marks the bodies of those whose pairs must be searched or whose discs must be
    shaped, and counts them. Both sides of a pair may have gone that far, and a disc shaped on the way may have grown by as much."""
    port = contact.port
    root = ti.static(contact.pairs.root)
    worn = 0
    ti.loop_config(serialize=True)
    for _ in range(1):
        for b in range(bodies):
            contact.top[b], contact.lasting[b], port.due[b] = 0.0, 1, 0
        for b in range(bodies):
            r = root[b]
            contact.top[r] = ti.max(contact.top[r], port.speed[b])
            contact.lasting[r] = ti.max(contact.lasting[r], port.blow(b, step))
        for b in range(bodies):
            r = root[b]
            contact.going[b] = contact.lasting[r] * dt * contact.top[r]
            contact.travelled[b] += contact.going[b]
            contact.aged[b] += contact.going[b]
            if 2.0 * (2.0 * contact.travelled[b] - contact.aged[b]) > 0.9 * skin:
                port.due[r] = SEARCH
            elif 2.0 * contact.aged[b] > 0.9 * close:
                port.due[r] = ti.max(port.due[r], SHAPE)
        for b in range(bodies):
            port.due[b] = port.due[root[b]]
            worn += port.due[b]
    return worn


@ti.func
def _geometry(contact: ti.template(), k, a, b, turning):
    """(gap, normal from the other to the ball, point of contact) of pair k; of a face its corners' parts of the nearest point as well."""
    port, pairs = contact.port, contact.pairs
    ball, other = pairs.ball[k], pairs.other[k]
    c, radius = port.centre(ball, a, turning), port.ball_radius[ball][0]
    gap = ti.cast(0.0, ti.f64)
    normal = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    if pairs.sort[k] == DISC:
        radius = port.ball_radius[ball][port.disc_sound[other]]
        g, n = disc_gap(port.x[b], port.director[b], port.disc_radius[other], port.disc_half[other], c, radius)
        gap, normal = g, n
    elif ti.static(port.thin) and pairs.sort[k] >= FACE:
        gap, normal = pairs.gap[k], pairs.normal[k]  # `_flat_geometry` was here before
    else:
        away = c - port.centre(other, b, turning)
        distance = away.norm()
        normal = away / ti.max(distance, 1e-300)
        gap = distance - radius - port.ball_radius[other][0]
    return gap, normal, c - radius * normal


@ti.func
def _flat_geometry(contact: ti.template(), k, turning):
    """Gap and normal of pair k, a thin ball against a face or a wall, and what `_counts` compares: the parts that the corners have of the
    nearest point, how far away it is, and whether the ball is behind it."""
    port, pairs = contact.port, contact.pairs
    ball, other = pairs.ball[k], pairs.other[k]
    c, thick = port.centre(ball, pairs.a[k], turning), port.ball_radius[ball][0]
    inside, faced = 0, ti.cast(0.0, ti.f64)
    if pairs.sort[k] == FACE:
        at, disc = pairs.corner[k], port.face_disc[other]
        split, q = nearest(port.x[at[0]], port.x[at[1]], port.x[at[2]], port.x[at[3]], ti.select(disc[3] < 0, 3, 4), c)
        half = port.disc_half[disc[0]]
        thick += half
        for j in ti.static(range(1, 4)):  # as thick as at its corners; an even sheet to the bit
            if disc[j] >= 0:
                thick += split[j] * (port.disc_half[disc[j]] - half)
        away = c - q
        distance = away.norm()
        pairs.split[k] = split
        pairs.normal[k] = away / distance if distance > 1e-12 * thick else port.director[pairs.b[k]]
        pairs.gap[k], pairs.away[k] = distance - thick, distance
    elif ti.static(port.walled) and pairs.sort[k] == WALL:
        b, at = pairs.b[k], port.wall_point[other]
        one, two, three = port.centre(at[0], b, turning), port.centre(at[1], b, turning), port.centre(at[2], b, turning)
        s = in_triangle(one, two, three, c)
        normal = (two - one).cross(three - one).normalized()
        away = c - (s[0] * one + s[1] * two + s[2] * three)
        distance = away.norm()
        if distance > 1e-12 * thick:
            away /= distance
            faced = away.dot(normal)
            if faced < 0.0:
                inside = 1
            normal = (1 - 2 * inside) * away
        for corner in ti.static(range(3)):
            pairs.split[k][corner] = s[corner]
        pairs.inside[k], pairs.normal[k] = inside, normal
        pairs.gap[k], pairs.away[k] = (1 - 2 * inside) * distance - thick, distance - SAME * thick * abs(faced)


@ti.func
def _corners(pairs: ti.template(), k):
    """Of the face or the wall of pair k; -1 behind a triangle."""
    at = pairs.port.face_disc[pairs.other[k] * ti.select(pairs.sort[k] == FACE, 1, 0)]
    if ti.static(pairs.port.walled):
        if pairs.sort[k] == WALL:
            points = pairs.port.wall_point[pairs.other[k]]
            at = ti.Vector([points[0], points[1], points[2], -1])
    return at


@ti.func
def _counts(contact: ti.template(), k):
    """Whether its thin ball meets the face or wall of pair k: none that has the nearest point as well is nearer, and a wall is met from
    outside. A ball is inside a body when it is behind the nearest wall. That wall alone holds it, unless it has gone too deep."""
    port, pairs = contact.port, contact.pairs
    ball, sort, body, at, n = pairs.ball[k], pairs.sort[k], port.whose[pairs.b[k]], _corners(pairs, k), pairs.size[PAIRS]
    first = k
    while first > 0 and pairs.ball[ti.max(first - 1, 0)] == ball and pairs.sort[ti.max(first - 1, 0)] == sort:
        first -= 1
    hidden, nearest_one = 0, k
    j, last = first, first + 1
    while j < last:
        if pairs.away[j] < pairs.away[k] or (pairs.away[j] == pairs.away[k] and j < k):
            if port.whose[pairs.b[j]] == body:
                corners, shared = _corners(pairs, j), 1
                for c in ti.static(range(4)):
                    if pairs.split[k][c] > SAME and all(corners != at[c]):
                        shared = 0
                hidden = ti.max(hidden, shared)
                if pairs.away[j] < pairs.away[nearest_one] or (pairs.away[j] == pairs.away[nearest_one] and j < nearest_one):
                    nearest_one = j
        j += 1
        if j < n:
            if pairs.ball[j] == ball and pairs.sort[j] == sort:
                last = j + 1
    result = 1 - hidden
    if ti.static(port.walled):
        if sort == WALL:
            if pairs.inside[nearest_one] == 1:
                result = 0
                if nearest_one == k and pairs.gap[k] > -2.0 * port.ball_radius[ball][0]:
                    result = 1
            elif pairs.inside[k] == 1:
                result = 0
    return result


@ti.func
def _of_other(contact: ti.template(), field: ti.template(), k, b):
    """A velocity of the other of pair k: of its mover, or of a face at the nearest point."""
    pairs = contact.pairs
    v = field[b]
    if ti.static(contact.port.thin):
        if pairs.sort[k] == FACE:
            v *= 0.0
            for c in ti.static(range(4)):
                v += pairs.split[k][c] * field[pairs.corner[k][c]]
    return v


@ti.func
def _speeds(contact: ti.template(), k, a, b, turning):
    """Velocity of the ball from the other of pair k at the point of contact, at n - 1/2 and at n + 1/2 without contact."""
    port, pairs = contact.port, contact.pairs
    v_a, v_b, u_a, u_b = port.before[a], _of_other(contact, port.before, k, b), port.free[a], _of_other(contact, port.free, k, b)
    if a >= turning:
        v_a += port.spin_before[a - turning].cross(pairs.arm_a[k])
        u_a += port.spin_free[a - turning].cross(pairs.arm_a[k])
    if b >= turning:
        v_b += port.spin_before[b - turning].cross(pairs.arm_b[k])
        u_b += port.spin_free[b - turning].cross(pairs.arm_b[k])
    return v_a - v_b, u_a - u_b


@ti.func
def _part(contact: ti.template(), k, side):
    """How much of the impulse of pair k the mover on that side takes: all of it, or the part of a face's corner."""
    part = ti.cast(1.0, ti.f64)
    if ti.static(contact.port.thin):
        if side > 0 and contact.pairs.sort[k] == FACE:
            part = contact.pairs.split[k][side - 1]
    return part


@ti.func
def _mobility(contact: ti.template(), m, turning, arm, normal):
    """Of a mover: change of its speed along the normal by a unit impulse [1/kg]; where bodies rub, along any direction at most."""
    w = ti.cast(0.0, ti.f64)
    if ti.static(contact.pairs.table.rubs):
        w = contact.port.loosest(m, turning, arm)
    else:
        w = contact.port.mobility(m, turning, arm, normal)
    return w


@ti.func
def _weight(contact: ti.template(), k, a, b, turning):
    """Mobilities of all movers of pair k, each split among its own pairs [1/kg]."""
    port, pairs = contact.port, contact.pairs
    normal = pairs.normal[k]
    weight = contact.share[a] * _mobility(contact, a, turning, pairs.arm_a[k], normal)
    if ti.static(port.thin):
        if pairs.sort[k] == FACE:
            for c in ti.static(range(4)):
                m, part = pairs.corner[k][c], pairs.split[k][c]
                weight += contact.share[m] * part * _mobility(contact, m, turning, pairs.arm_b[k], normal)
        else:
            weight += contact.share[b] * _mobility(contact, b, turning, pairs.arm_b[k], normal)
    else:
        weight += contact.share[b] * _mobility(contact, b, turning, pairs.arm_b[k], normal)
    return weight


@ti.kernel
def _measure(contact: ti.template(), dt: ti.f64, close: ti.f64, speeds: ti.i32, step: ti.i32) -> ti.i32:
    """Where each pair is, how fast it closes, and its weight; returns how many bodies are in parts that close faster than they may."""
    port, pairs = contact.port, contact.pairs
    ti.loop_config(serialize=True)
    for b in range(pairs.size[BODIES]):
        contact.closing[b] = 0.0
    if ti.static(port.thin):
        for k in range(pairs.size[PAIRS]):
            if pairs.sort[k] >= FACE:
                _flat_geometry(contact, k, pairs.size[TURNING])
    for k in range(pairs.size[PAIRS]):
        a, b, turning = pairs.a[k], pairs.b[k], pairs.size[TURNING]
        gap, normal, point = _geometry(contact, k, a, b, turning)
        counts = 1
        if ti.static(port.thin):
            if pairs.sort[k] >= FACE:
                counts = _counts(contact, k)
                gap = gap if counts == 1 else FAR
        arm_a, arm_b = point - port.x[a], point - port.x[b]
        pairs.gap[k], pairs.normal[k], pairs.arm_a[k], pairs.arm_b[k] = gap, normal, arm_a, arm_b
        blow_a, blow_b = port.blow(port.whose[a], step), port.blow(port.whose[b], step)
        if blow_a == 0 or blow_b == 0:  # not its turn; p waits
            pairs.near[k] = 0
        elif (
            speeds == 1 and gap > 2.0 * dt * ti.max(blow_a, blow_b) * (port.speed[port.whose[a]] + port.speed[port.whose[b]]) + 0.3 * close
        ):
            pairs.near[k], pairs.p[k], pairs.y[k] = 0, 0.0, 0.0  # out of reach, were they twice as fast
            if ti.static(pairs.table.rubs):
                pairs.q[k] *= 0.0
                pairs.z[k] *= 0.0
        elif speeds == 1:
            lasts = dt * ti.max(blow_a, blow_b)
            v, u = _speeds(contact, k, a, b, turning)
            before, free = v.dot(normal), u.dot(normal)
            slack = free + ti.max(gap, 0.0) / lasts
            if slack < 0.0 and before < 0.0:
                e = pairs.table.restitution[port.whose[a] * pairs.size[BODIES] + port.whose[b]]
                if e > 0.0:
                    slack = free + e * before
            pairs.before[k], pairs.free[k], pairs.slack[k] = before, free, slack
            near, reach = 0, 0.3 * close
            if ti.static(port.thin):
                if pairs.sort[k] >= FACE:  # what can come to touch within the step: each pair more on a node slows the others down
                    reach = ti.min(reach, lasts * (port.speed[port.whose[a]] + port.speed[port.whose[b]]))
            if gap + lasts * ti.min(free, 0.0) < reach:
                near = 1
            if counts == 0:
                near, slack = 0, ti.max(slack, 0.0)
                pairs.slack[k] = slack
            if ti.static(contact.hides):
                if pairs.sort[k] == DISC:
                    for s in ti.static(range(contact.hidden.n)):
                        if contact.hidden.fluid[s] == port.whose[a]:
                            if contact.hidden.touches(s, port.x[b], port.disc_radius[pairs.other[k]]):
                                near, slack = 0, ti.max(slack, 0.0)
                                pairs.slack[k] = slack
            pairs.near[k] = near
            if near == 0:
                pairs.p[k] = 0.0
            pairs.y[k] = pairs.p[k]
            if ti.static(pairs.table.rubs):
                pairs.slip_before[k], pairs.slip[k] = v - before * normal, u - free * normal
                pairs.q[k] = near * (pairs.q[k] - pairs.q[k].dot(normal) * normal)
                pairs.z[k] = pairs.q[k]
            part = pairs.part[a]
            if -slack > contact.closing[part]:
                ti.atomic_max(contact.closing[part], -slack)
    acting = 0
    ti.loop_config(serialize=True)
    for _ in range(1):
        for b in range(pairs.size[BODIES]):
            contact.top[b] = 0.0
        for b in range(pairs.size[BODIES]):
            r = pairs.root[b]
            contact.top[r] = ti.max(contact.top[r], port.speed[b])
        for b in range(pairs.size[BODIES]):
            acts = 0
            if contact.closing[pairs.root[b]] > 0.0:
                acts = 1
            port.pushed[b], contact.open[b] = acts, acts
            contact.scale[b] = ti.max(contact.closing[b], SMALL * contact.top[b])
            acting += acts
    for m in range(pairs.size[WHO]):
        contact.met[m] = 0
        if contact.open[pairs.part[m]] == 1:
            count = ti.cast(0.0, ti.f64)
            for e in range(pairs.first[m], pairs.first[m + 1]):
                k, side = pairs.entry[e] // ti.static(pairs.sides), pairs.entry[e] % ti.static(pairs.sides)
                count += pairs.near[k] * _part(contact, k, side)
                contact.met[m] = ti.max(contact.met[m], pairs.near[k])
            contact.share[m] = count
            if contact.met[m] == 0:  # `_settle` goes to the others
                port.impulse[m] = ti.Vector([0.0, 0.0, 0.0], ti.f64)
                if m >= pairs.size[TURNING]:
                    port.twist[m - pairs.size[TURNING]] = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    for k in range(pairs.size[PAIRS]):
        a, b = pairs.a[k], pairs.b[k]
        if pairs.near[k] == 1 and contact.open[pairs.part[a]] == 1:
            weight = _weight(contact, k, a, b, pairs.size[TURNING])
            pairs.weight[k] = weight
            if weight <= 0.0:  # both are held: nothing to be done
                pairs.near[k] = 0
                pairs.p[k] = pairs.y[k] = 0.0
                if ti.static(pairs.table.rubs):
                    pairs.q[k] *= 0.0
                    pairs.z[k] *= 0.0
    return acting


@ti.kernel
def _list_acting(contact: ti.template()) -> ti.i32:
    """The near pairs of parts where something closes, and their movers; returns how many pairs they are."""
    pairs = contact.pairs
    acting, moved = 0, 0
    ti.loop_config(serialize=True)
    for _ in range(1):
        for k in range(pairs.size[PAIRS]):
            if pairs.near[k] == 1:
                if contact.met[pairs.a[k]] == 1:
                    contact.acting[acting] = k
                    acting += 1
        for m in range(pairs.size[WHO]):
            if contact.met[m] == 1:
                contact.moved[moved] = m
                moved += 1
        contact.count[PAIRS_NEAR], contact.count[MOVERS] = acting, moved
    return acting


@ti.func
def _impulse(contact: ti.template(), m, turning, extrapolated):
    """Impulse and moment of impulse on the mover at place m, by p or by the extrapolated y."""
    pairs = contact.pairs
    J = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    L = J
    for e in range(pairs.first[m], pairs.first[m + 1]):
        k, side = pairs.entry[e] // ti.static(pairs.sides), pairs.entry[e] % ti.static(pairs.sides)
        if pairs.near[k] == 1:
            p = pairs.y[k] if extrapolated == 1 else pairs.p[k]
            push = p * pairs.normal[k]
            if ti.static(pairs.table.rubs):
                push += pairs.z[k] if extrapolated == 1 else pairs.q[k]
            if side > 0:
                push = -push
            if ti.static(contact.port.thin):
                push *= _part(contact, k, side)
            J += push
            if m >= turning:
                arm = pairs.arm_a[k]
                if side > 0:
                    arm = pairs.arm_b[k]
                L += arm.cross(push)
    return J, L


@ti.func
def _moved(contact: ti.template(), k, a, b, turning):
    """Change of the ball's velocity from the other of pair k [m/s]."""
    pairs = contact.pairs
    v = contact.dv[a] - _of_other(contact, contact.dv, k, b)
    if a >= turning:
        v += contact.dw[a - turning].cross(pairs.arm_a[k])
    if b >= turning:
        v -= contact.dw[b - turning].cross(pairs.arm_b[k])
    return v


@ti.func
def _held_back(contact: ti.template(), k, q, p):
    """q, brought back to what friction can bear under the impulse p."""
    most = (
        p
        * contact.pairs.table.friction[
            contact.port.whose[contact.pairs.a[k]] * contact.pairs.size[BODIES] + contact.port.whose[contact.pairs.b[k]]
        ]
    )
    size = q.norm()
    if size > most:
        q *= most / size
    return q


@ti.func
def _change(contact: ti.template(), m, turning):
    """Change of velocity of the mover at place m by the impulses y."""
    port = contact.port
    if contact.open[contact.pairs.part[m]] == 1:
        J, L = _impulse(contact, m, turning, 1)
        contact.dv[m] = port.ease[m] * J
        if m >= turning:
            contact.dw[m - turning] = port.spin(m, turning, L)


@ti.func
def _project(contact: ti.template(), k, turning, beta):
    """One step of pair k down the gradient, back to p >= 0 and |q| <= mu p, and on by the momentum beta."""
    pairs = contact.pairs
    a, b = pairs.a[k], pairs.b[k]
    if contact.open[pairs.part[a]] == 1:
        v, normal = _moved(contact, k, a, b, turning), pairs.normal[k]
        r = pairs.slack[k] + v.dot(normal)
        p = ti.max(0.0, pairs.y[k] - r / pairs.weight[k])
        step = p - pairs.p[k]
        climbs = r * step
        if ti.static(pairs.table.rubs):
            s = pairs.slip[k] + v - v.dot(normal) * normal
            q = _held_back(contact, k, pairs.z[k] - s / pairs.weight[k], p)
            climbs += s.dot(q - pairs.q[k])
            z = q + beta * (q - pairs.q[k])
            if climbs > 0.0:
                z = q
            pairs.q[k], pairs.z[k] = q, z
        y = p + beta * step
        if climbs > 0.0:
            y = p
        pairs.p[k], pairs.y[k] = p, y


@ti.kernel
def _iterate(contact: ti.template(), first: ti.f64, second: ti.f64, twice: ti.i32):
    """An iteration of the parts that are not solved yet, with the momentum `first`; twice 1: another one, with `second`."""
    pairs = contact.pairs
    for l in range(contact.count[MOVERS]):
        _change(contact, contact.moved[l], pairs.size[TURNING])
    for l in range(contact.count[PAIRS_NEAR]):
        _project(contact, contact.acting[l], pairs.size[TURNING], first)
    for l in range(contact.count[MOVERS] * twice):
        _change(contact, contact.moved[l], pairs.size[TURNING])
    for l in range(contact.count[PAIRS_NEAR] * twice):
        _project(contact, contact.acting[l], pairs.size[TURNING], second)


@ti.func
def _settle(contact: ti.template(), m, turning):
    """The impulses of p and q on the mover at place m, and its change of velocity by them."""
    port = contact.port
    if contact.open[contact.pairs.part[m]] == 1:
        J, L = _impulse(contact, m, turning, 0)
        contact.dv[m] = port.ease[m] * J
        port.impulse[m] = J
        if m >= turning:
            contact.dw[m - turning] = port.spin(m, turning, L)
            port.twist[m - turning] = L


@ti.func
def _wrong(contact: ti.template(), k, a, b, turning):
    """Violation of pair k by p and q, of the constraint or of complementarity [m/s]."""
    pairs = contact.pairs
    v, normal = _moved(contact, k, a, b, turning), pairs.normal[k]
    r = pairs.slack[k] + v.dot(normal)
    wrong = ti.max(-r, ti.min(r, pairs.p[k] * pairs.weight[k]))
    if ti.static(pairs.table.rubs):
        s = pairs.slip[k] + v - v.dot(normal) * normal
        q = _held_back(contact, k, pairs.q[k] - s / pairs.weight[k], pairs.p[k])
        wrong = ti.max(wrong, (q - pairs.q[k]).norm() * pairs.weight[k])
    if not (wrong < ti.math.inf):  # also true for nan
        wrong = ti.math.inf
    return wrong


@ti.func
def _close(contact: ti.template(), b, tolerance):
    """Error of the part whose root is the body b, over its scale; 0 of other bodies. A part within the tolerance is closed."""
    error = ti.cast(0.0, ti.f64)
    if contact.port.pushed[b] == 1 and contact.pairs.root[b] == b:
        error = contact.error[b] / contact.scale[b]
        if error <= tolerance:
            contact.open[b] = 0
    return error


@ti.kernel
def _error(contact: ti.template(), tolerance: ti.f64) -> ti.f64:
    """Largest error of all parts; those within the tolerance are closed. The impulses of the movers are those of this look."""
    pairs = contact.pairs
    ti.loop_config(serialize=True)
    for b in range(pairs.size[BODIES]):
        if contact.open[b] == 1:
            contact.error[b] = 0.0
    for l in range(contact.count[MOVERS]):
        _settle(contact, contact.moved[l], pairs.size[TURNING])
    for l in range(contact.count[PAIRS_NEAR]):
        k = contact.acting[l]
        part = pairs.part[pairs.a[k]]
        if contact.open[part] == 1:
            wrong = _wrong(contact, k, pairs.a[k], pairs.b[k], pairs.size[TURNING])
            if wrong > contact.error[part]:
                ti.atomic_max(contact.error[part], wrong)
    worst = ti.cast(0.0, ti.f64)
    ti.loop_config(serialize=True)
    for b in range(pairs.size[BODIES]):
        worst = ti.max(worst, _close(contact, b, tolerance))
    return worst


@ti.kernel
def _solve_here(contact: ti.template(), most: ti.i32, tolerance: ti.f64) -> ti.f64:
    """All iterations by one thread; returns the largest error left, and their number in `did`."""
    pairs = contact.pairs
    worst = ti.cast(0.0, ti.f64)
    ti.loop_config(serialize=True)
    for _ in range(1):
        movers, n, turning, bodies = contact.count[MOVERS], contact.count[PAIRS_NEAR], pairs.size[TURNING], pairs.size[BODIES]
        t = ti.cast(1.0, ti.f64)
        did, some, going = 0, FIRST, 1
        while going == 1 and did < most:
            some = ti.min(some, most - did)
            for _i in range(some):
                after = 0.5 * (1.0 + ti.sqrt(1.0 + 4.0 * t * t))
                for l in range(movers):
                    _change(contact, contact.moved[l], turning)
                for l in range(n):
                    _project(contact, contact.acting[l], turning, (t - 1.0) / after)
                t = after
            did += some
            some = ti.min(2 * some, CHECK)
            for b in range(bodies):
                if contact.open[b] == 1:
                    contact.error[b] = 0.0
            for l in range(movers):
                _settle(contact, contact.moved[l], turning)
            for l in range(n):
                k = contact.acting[l]
                part = pairs.part[pairs.a[k]]
                if contact.open[part] == 1:
                    contact.error[part] = ti.max(contact.error[part], _wrong(contact, k, pairs.a[k], pairs.b[k], turning))
            worst = 0.0
            for b in range(bodies):
                worst = ti.max(worst, _close(contact, b, tolerance))
            if worst <= tolerance or worst == ti.math.inf:
                going = 0
        contact.did[0] = did
    return worst


@ti.kernel
def _met(contact: ti.template()):
    """Velocities to come of the pairs, of movers that have taken all impulses."""
    pairs = contact.pairs
    for m in range(pairs.size[WHO]):
        contact.dv[m] = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        if m >= pairs.size[TURNING]:
            contact.dw[m - pairs.size[TURNING]] = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    for k in range(pairs.size[PAIRS]):
        if pairs.near[k] == 1:
            _, u = _speeds(contact, k, pairs.a[k], pairs.b[k], pairs.size[TURNING])
            free = u.dot(pairs.normal[k])
            pairs.free[k] = free
            if ti.static(pairs.table.rubs):
                pairs.slip[k] = u - free * pairs.normal[k]


@ti.kernel
def _book(contact: ti.template(), blocks: ti.i32, dt_before: ti.f64, dt: ti.f64, per_kick: ti.f64, acts: ti.i32) -> ti.i32:
    """Work of contact on the bodies, trapezoidal as in world.step, and the largest penetration; returns the pairs with a force."""
    port, pairs = contact.port, contact.pairs
    touching = 0
    for block in range(blocks):
        contact.work[block] += contact.ahead[block]
        behind, ahead = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        rub_behind, rub_ahead = behind, ahead
        mine = 0  # shaders lose a kernel whose inner loop adds to the sum of all threads
        deepest = ti.cast(0.0, ti.f64)
        if acts > 0:
            for k in range(block * BLOCK, ti.min(pairs.size[PAIRS], (block + 1) * BLOCK)):
                if pairs.near[k] == 1 and pairs.p[k] > 0.0:
                    a, b = pairs.a[k], pairs.b[k]
                    if port.pushed[port.whose[a]] == 1:
                        mine += 1
                        v = _moved(contact, k, a, b, pairs.size[TURNING])
                        after = pairs.free[k] + (pairs.slack[k] + v.dot(pairs.normal[k])) - pairs.slack[k]
                        behind += pairs.p[k] * pairs.before[k]
                        ahead += pairs.p[k] * after
                        if ti.static(pairs.table.rubs):
                            rub_behind += pairs.q[k].dot(pairs.slip_before[k])
                            rub_ahead += pairs.q[k].dot(pairs.slip[k] + v)
                        deepest = ti.max(deepest, -pairs.gap[k])
        touching += mine
        if deepest > contact.deepest[0]:
            ti.atomic_max(contact.deepest[0], deepest)
        # v_0 is given at t = 0, and the kinetic energy there is that of v_0 less 1/2 p (v_1 - v_0), as in world.step
        if dt_before == 0.0:
            contact.work[block] -= 0.5 * (ahead - behind)
        contact.work[block] += 0.5 * dt_before * per_kick * behind
        contact.ahead[block] = 0.5 * dt * per_kick * ahead
        if ti.static(pairs.table.rubs):
            contact.rubbed[block] += contact.rubs_ahead[block]
            if dt_before == 0.0:
                contact.rubbed[block] -= 0.5 * (rub_ahead - rub_behind)
            contact.rubbed[block] += 0.5 * dt_before * per_kick * rub_behind
            contact.rubs_ahead[block] = 0.5 * dt * per_kick * rub_ahead
    return touching

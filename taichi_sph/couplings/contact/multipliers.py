"""Contact forces as multipliers of a unilateral constraint on the half-step velocities (T 3.8 to 3.18).

For each pair of pinballs, with v* the velocities at n+1/2 if there were no contact (T 3.17) and c the row of normals,

    c (v* + M^-1 c^T p) >= -<gap>_+ / dt,     p >= 0,     p = 0 where the left side is above the right one

Where p > 0 this reads b p = w, with b = c M^-1 c^T (T 3.15, 3.16). Where bodies part by themselves there is no force: this is the
rebound of T 3.18. T decides on the rebound first; here the solver finds it with the forces. The gap on the right lets a pair come to touch
and no further. Penetration therefore stays at the order of what the normals turn in a step. Between two bodies with a restitution the right
side is Newton's rebound speed. Impulses are equal and opposite on each pair, so linear momentum is kept to rounding.

Solved by accelerated projected gradients (Nesterov; Mazhar et al. 2015), each pair scaled by the inverse masses that
it would see if every mover were split among its pairs (Tonge et al. 2012): that scaling bounds b from above for any set of
pairs, redundant ones too. The momentum of a pair restarts when it climbs (after O'Donoghue and Candes 2015, who restart all at once). Pairs
gather from movers and movers from pairs: no scatter, one result for any number of threads.

Bodies that pairs link are a part (pairs.py). Each part has its own tolerance and ends when it has reached it, so that no part follows from
another one far away.
"""

import math
import time as clock

import numpy as np

from ... import runtime
from ...bodies.body import Now
from ...errors import RunStopped, SceneError
from ...pool import Pool
from ...runtime import ti
from ..ports import Port
from .pairs import Pairs, Table, disc_gap
from .said import PinballContact

BLOCK = 512
FIRST, CHECK = 2, 8  # iterations before the first look at the error; the most between two looks
FAR = 1e30  # m: a way after which anything must be searched
SMALL = 1e-2  # of the fastest speed: an approach below it is not resolved any finer


class Contact(Pool):
    """All contact of a run. `add` puts its forces on the bodies; the rest is for the record."""

    kept = ("all_iterations", "solves", "unsolved", "largest_error")

    def __init__(self, port: Port, table: Table, settings: PinballContact, skin: float, name: str = "contact"):
        """skin [m]: how far beyond contact pairs are kept ready."""
        super().__init__(name)
        self.port, self.settings, self.skin = port, settings, skin
        self.pairs = pairs = Pairs(port, table)
        room, bodies = min(port.n, 2 * pairs.capacity), port.n_bodies
        blocks = -(-pairs.capacity // BLOCK)
        self.blocks = blocks
        field = self.field
        self.dv = field("dv", room, 3, "f64", unit="m/s", doc="change of velocity by the impulses, at a place of the port's list")
        self.dw = field("dw", max(port.n - port.n_still, 1), 3, "f64", unit="rad/s", doc="change of spin, of those that turn")
        self.share = field("share", room, dtype="i32", doc="near pairs of a mover")
        self.work = field("work", blocks, dtype="f64", unit="J", doc="done on the bodies up to time n, by blocks of pairs", keeps=True)
        self.ahead = field("ahead", blocks, dtype="f64", unit="J", doc="what contact does on the way to n + 1", keeps=True)
        self.deepest = field("deepest", 1, dtype="f64", unit="m", doc="largest penetration so far", keeps=True)
        # by body; of a part what stands at each of its bodies
        self.travelled = field("travelled", bodies, dtype="f64", unit="m", doc="since the last search, by the end of this step", keeps=True)
        self.going = field("going", bodies, dtype="f64", unit="m", doc="part of it that lies ahead")
        # by part, at its root
        self.lasting = field("lasting", bodies, dtype="i32", doc="steps of the clock that lie ahead at once")
        self.top = field("top", bodies, dtype="f64", unit="m/s", doc="fastest speed of a part")
        self.closing = field("closing", bodies, dtype="f64", unit="m/s", doc="largest free approach beyond what is allowed")
        self.scale = field("scale", bodies, dtype="f64", unit="m/s", doc="what the tolerance is a part of")
        self.error = field("error", bodies, dtype="f64", unit="m/s", doc="largest violation")
        self.open = field("open", bodies, dtype="i32", doc="1: is being solved")
        runtime.fill(self.travelled, FAR)
        self.touching = 0  # pairs with a force
        self.iterations = 0  # of the last step
        self.all_iterations, self.solves, self.unsolved = 0, 0, 0
        self.largest_error = 0.0  # of a step, over its tolerance's scale
        self.seconds = 0.0

    def pools(self) -> list[Pool]:
        """In the order of a restart."""
        return [self.port, self.pairs.table, self.pairs, self]

    def check_start(self) -> None:
        """SceneError when bodies lie in each other at t = 0."""
        port, pairs = self.port, self.pairs
        pairs.search([np.arange(port.n_bodies)], np.full(port.n_bodies, self.skin))
        if not pairs.n:
            return
        port.offer(pairs.bounds, Now())
        _measure(self, 0, pairs.n, port.n_bodies, port.turning, 0.0, self.skin, 0, 0)
        owner = runtime.get(port.whose, pairs.n_who)
        a, b = (owner[runtime.get(side, pairs.n)] for side in (pairs.a, pairs.b))
        gap = runtime.get(pairs.gap, pairs.n)
        gap[a == b] = 0.0
        gap[port.loose[a] | port.loose[b]] += 0.5 * self.skin  # a filling may touch its vessel
        k = int(np.argmin(gap))
        allowed = 1e-3 * self.skin
        if gap[k] < -allowed:
            one, two = (f"{port.of(body).group.kind} '{port.names[body]}'" for body in (a[k], b[k]))
            hint = "move one of them away, pinballs touch at most"
            if port.loose[a[k]] or port.loose[b[k]]:
                hint += "; a filling whose particles are coarse comes to lie in the corners of its vessel: lower the fluid's spacing"
            raise SceneError(f"{one} starts {1e3 * -gap[k]:.3g} mm inside {two}: {hint}")

    def add(self, now: Now, common: int) -> None:
        """Forces of contact at the present time, once all others are known. common: steps after which all groups are due together."""
        began = clock.perf_counter()
        port, pairs = self.port, self.pairs
        step = now.step % common
        port.look()
        if any(s.renumbered for s in port.surfaces):
            travelled = runtime.get(self.travelled, port.n_bodies)
            for s in port.surfaces:
                if s.renumbered:
                    travelled[s.first.body : s.first.body + len(s.bodies)] = FAR
            runtime.put(self.travelled, travelled)
        if _wear(self, port.n_bodies, now.dt, self.skin, step):
            self._search()
        self.iterations = 0
        acts = 0
        if pairs.n:
            port.offer(pairs.bounds, now)
            acts = _measure(self, pairs.n_who, pairs.n, port.n_bodies, port.turning, now.dt, self.skin, 1, step)
            if acts:
                self._solve()
                port.take(pairs.bounds, now)
        self.touching = _book(self, pairs.n, self.blocks, port.turning, now.dt_before, now.dt, 1.0 / now.kick, acts)
        self.seconds += clock.perf_counter() - began

    def _search(self) -> None:
        n = self.port.n_bodies
        due, root = runtime.get(self.port.due, n) == 1, runtime.get(self.pairs.root, n)
        going, travelled = runtime.get(self.going, n), runtime.get(self.travelled, n)
        parts = [np.flatnonzero(root == r) for r in np.unique(root[due])]
        for part in self.pairs.search(parts, self.skin + 2.0 * going):
            travelled[part] = going[part].max()
        runtime.put(self.travelled, travelled)

    def _solve(self) -> None:
        pairs, turning = self.pairs, self.port.turning
        t, some = 1.0, FIRST
        error = np.inf
        while self.iterations < self.settings.iterations:
            some = min(some, self.settings.iterations - self.iterations)
            for done in range(0, some, 2):
                second, third = _next(t), _next(_next(t))
                twice = int(some - done > 1)
                _iterate(self, pairs.n_who, pairs.n, turning, (t - 1.0) / second, (second - 1.0) / third, twice)
                t = third if twice else second
            self.iterations += some
            some = min(2 * some, CHECK)
            error = _error(self, pairs.n_who, pairs.n, self.port.n_bodies, turning, self.settings.tolerance)
            if not np.isfinite(error):
                raise RunStopped(
                    "contact: the velocities of touching bodies are no numbers any more; the step is likely too long: lower "
                    "numerics.time_step_safety, and look at the last frame"
                )
            if error <= self.settings.tolerance:
                break
        else:
            self.unsolved += 1
        self.largest_error = max(self.largest_error, error)
        self.all_iterations += self.iterations
        self.solves += 1

    @property
    def penetration(self) -> float:
        """Largest so far [m]."""
        return float(self.deepest[0])

    def taken(self) -> float:
        """Energy that contact took [J], up to the time of the last force evaluation."""
        return -float(runtime.get(self.work, self.blocks).sum())

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
def _wear(contact: ti.template(), bodies: ti.i32, dt: ti.f64, skin: ti.f64, step: ti.i32) -> ti.i32:
    """How far each part has gone by the end of this step; marks the bodies of those that must be searched, and counts them."""
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
            if 2.0 * contact.travelled[b] > 0.9 * skin:
                port.due[r] = 1
        for b in range(bodies):
            port.due[b] = port.due[root[b]]
            worn += port.due[b]
    return worn


@ti.func
def _geometry(contact: ti.template(), k, a, b, turning):
    """(gap, normal from the other to the ball, point of contact) of pair k."""
    port, pairs = contact.port, contact.pairs
    ball, other = pairs.ball[k], pairs.other[k]
    c, radius = port.centre(ball, a, turning), port.ball_radius[ball][0]
    gap = ti.cast(0.0, ti.f64)
    normal = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    if pairs.flat[k] == 1:
        radius = port.ball_radius[ball][port.disc_sound[other]]
        g, n = disc_gap(port.x[b], port.director[b], port.disc_radius[other], port.disc_half[other], c, radius)
        gap, normal = g, n
    else:
        away = c - port.centre(other, b, turning)
        distance = away.norm()
        normal = away / ti.max(distance, 1e-300)
        gap = distance - radius - port.ball_radius[other][0]
    return gap, normal, c - radius * normal


@ti.kernel
def _measure(
    contact: ti.template(),
    n_who: ti.i32,
    n: ti.i32,
    bodies: ti.i32,
    turning: ti.i32,
    dt: ti.f64,
    skin: ti.f64,
    speeds: ti.i32,
    step: ti.i32,
) -> ti.i32:
    """Where each pair is, how fast it closes, and its weight; returns how many bodies are in parts that close faster than they may."""
    port, pairs = contact.port, contact.pairs
    ti.loop_config(serialize=True)
    for b in range(bodies):
        contact.closing[b] = 0.0
    for k in range(n):
        a, b = pairs.a[k], pairs.b[k]
        gap, normal, point = _geometry(contact, k, a, b, turning)
        arm_a, arm_b = point - port.x[a], point - port.x[b]
        pairs.gap[k], pairs.normal[k], pairs.arm_a[k], pairs.arm_b[k] = gap, normal, arm_a, arm_b
        blow_a, blow_b = port.blow(port.whose[a], step), port.blow(port.whose[b], step)
        if blow_a == 0 or blow_b == 0:  # not its turn; p waits
            pairs.near[k] = 0
        elif speeds == 1:
            lasts = dt * ti.max(blow_a, blow_b)
            v_a, v_b, u_a, u_b = port.before[a], port.before[b], port.free[a], port.free[b]
            if a >= turning:
                v_a += port.spin_before[a - turning].cross(arm_a)
                u_a += port.spin_free[a - turning].cross(arm_a)
            if b >= turning:
                v_b += port.spin_before[b - turning].cross(arm_b)
                u_b += port.spin_free[b - turning].cross(arm_b)
            before, free = (v_a - v_b).dot(normal), (u_a - u_b).dot(normal)
            slack = free + ti.max(gap, 0.0) / lasts
            if slack < 0.0 and before < 0.0:
                e = pairs.table.restitution[port.whose[a] * bodies + port.whose[b]]
                if e > 0.0:
                    slack = free + e * before
            pairs.before[k], pairs.free[k], pairs.slack[k] = before, free, slack
            near = 0
            if gap + lasts * ti.min(free, 0.0) < 0.3 * skin:
                near = 1
            pairs.near[k] = near
            if near == 0:
                pairs.p[k] = 0.0
            pairs.y[k] = pairs.p[k]
            part = pairs.part[a]
            if -slack > contact.closing[part]:
                ti.atomic_max(contact.closing[part], -slack)
    acting = 0
    ti.loop_config(serialize=True)
    for _ in range(1):
        for b in range(bodies):
            contact.top[b] = 0.0
        for b in range(bodies):
            r = pairs.root[b]
            contact.top[r] = ti.max(contact.top[r], port.speed[b])
        for b in range(bodies):
            acts = 0
            if contact.closing[pairs.root[b]] > 0.0:
                acts = 1
            port.pushed[b], contact.open[b] = acts, acts
            contact.scale[b] = ti.max(contact.closing[b], SMALL * contact.top[b])
            acting += acts
    for m in range(n_who):
        if contact.open[pairs.part[m]] == 1:
            count = 0
            for e in range(pairs.first[m], pairs.first[m + 1]):
                count += pairs.near[pairs.entry[e] // 2]
            contact.share[m] = count
    for k in range(n):
        a, b = pairs.a[k], pairs.b[k]
        if pairs.near[k] == 1 and contact.open[pairs.part[a]] == 1:
            normal = pairs.normal[k]
            weight = contact.share[a] * port.mobility(a, turning, pairs.arm_a[k], normal)
            weight += contact.share[b] * port.mobility(b, turning, pairs.arm_b[k], normal)
            pairs.weight[k] = weight
            if weight <= 0.0:  # both are held: nothing to be done
                pairs.near[k] = 0
                pairs.p[k] = pairs.y[k] = 0.0
    return acting


@ti.func
def _impulse(contact: ti.template(), m, turning, extrapolated):
    """Impulse and moment of impulse on the mover at place m, by p or by the extrapolated y."""
    pairs = contact.pairs
    J = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    L = J
    for e in range(pairs.first[m], pairs.first[m + 1]):
        entry = pairs.entry[e]
        k = entry // 2
        if pairs.near[k] == 1:
            p = pairs.y[k] if extrapolated == 1 else pairs.p[k]
            if entry % 2 == 1:
                p = -p
            push = p * pairs.normal[k]
            J += push
            if m >= turning:
                arm = pairs.arm_a[k]
                if entry % 2 == 1:
                    arm = pairs.arm_b[k]
                L += arm.cross(push)
    return J, L


@ti.func
def _corrected(contact: ti.template(), k, a, b, turning):
    """slack of pair k with the changes of velocity [m/s]; it should not be negative."""
    pairs = contact.pairs
    v = contact.dv[a] - contact.dv[b]
    if a >= turning:
        v += contact.dw[a - turning].cross(pairs.arm_a[k])
    if b >= turning:
        v -= contact.dw[b - turning].cross(pairs.arm_b[k])
    return pairs.slack[k] + v.dot(pairs.normal[k])


@ti.func
def _change(contact: ti.template(), m, turning):
    """Change of velocity of the mover at place m by the impulses y."""
    port = contact.port
    J, L = _impulse(contact, m, turning, 1)
    contact.dv[m] = port.ease[m] * J
    if m >= turning:
        contact.dw[m - turning] = port.spin(m, turning, L)


@ti.func
def _project(contact: ti.template(), k, turning, beta):
    """One step of pair k down the gradient, back to p >= 0, and on by the momentum beta."""
    pairs = contact.pairs
    a, b = pairs.a[k], pairs.b[k]
    if contact.open[pairs.part[a]] == 1:
        r = _corrected(contact, k, a, b, turning)
        p = ti.max(0.0, pairs.y[k] - r / pairs.weight[k])
        step = p - pairs.p[k]
        y = p + beta * step
        if r * step > 0.0:
            y = p
        pairs.p[k], pairs.y[k] = p, y


@ti.kernel
def _iterate(contact: ti.template(), n_who: ti.i32, n: ti.i32, turning: ti.i32, first: ti.f64, second: ti.f64, twice: ti.i32):
    """An iteration of the parts that are not solved yet, with the momentum `first`; twice 1: another one, with `second`."""
    pairs = contact.pairs
    for m in range(n_who):
        if contact.open[pairs.part[m]] == 1:
            _change(contact, m, turning)
    for k in range(n):
        if pairs.near[k] == 1:
            _project(contact, k, turning, first)
    for m in range(n_who * twice):
        if contact.open[pairs.part[m]] == 1:
            _change(contact, m, turning)
    for k in range(n * twice):
        if pairs.near[k] == 1:
            _project(contact, k, turning, second)


@ti.kernel
def _error(contact: ti.template(), n_who: ti.i32, n: ti.i32, bodies: ti.i32, turning: ti.i32, tolerance: ti.f64) -> ti.f64:
    """Largest violation by p, of the constraint or of complementarity, over the scale of its part; parts within the tolerance are closed.
    The impulses of the movers are those of this look."""
    port, pairs = contact.port, contact.pairs
    ti.loop_config(serialize=True)
    for b in range(bodies):
        if contact.open[b] == 1:
            contact.error[b] = 0.0
    for m in range(n_who):
        if contact.open[pairs.part[m]] == 1:
            J, L = _impulse(contact, m, turning, 0)
            contact.dv[m] = port.ease[m] * J
            port.impulse[m] = J
            if m >= turning:
                contact.dw[m - turning] = port.spin(m, turning, L)
                port.twist[m - turning] = L
    for k in range(n):
        if pairs.near[k] == 1:
            a, b = pairs.a[k], pairs.b[k]
            part = pairs.part[a]
            if contact.open[part] == 1:
                r = _corrected(contact, k, a, b, turning)
                wrong = ti.max(-r, ti.min(r, pairs.p[k] * pairs.weight[k]))
                if not (wrong < ti.math.inf):  # also true for nan
                    wrong = ti.math.inf
                if wrong > contact.error[part]:
                    ti.atomic_max(contact.error[part], wrong)
    worst = ti.cast(0.0, ti.f64)
    ti.loop_config(serialize=True)
    for b in range(bodies):
        if port.pushed[b] == 1 and pairs.root[b] == b:
            error = contact.error[b] / contact.scale[b]
            worst = ti.max(worst, error)
            if error <= tolerance:
                contact.open[b] = 0
    return worst


@ti.kernel
def _book(
    contact: ti.template(), n: ti.i32, blocks: ti.i32, turning: ti.i32, dt_before: ti.f64, dt: ti.f64, per_kick: ti.f64, acts: ti.i32
) -> ti.i32:
    """Work of contact on the bodies, trapezoidal as in world.step, and the largest penetration; returns the pairs with a force."""
    port, pairs = contact.port, contact.pairs
    touching = 0
    for block in range(blocks):
        contact.work[block] += contact.ahead[block]
        behind, ahead = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        mine = 0  # shaders lose a kernel whose inner loop adds to the sum of all threads
        deepest = ti.cast(0.0, ti.f64)
        if acts > 0:
            for k in range(block * BLOCK, ti.min(n, (block + 1) * BLOCK)):
                if pairs.near[k] == 1 and pairs.p[k] > 0.0:
                    a, b = pairs.a[k], pairs.b[k]
                    if port.pushed[port.whose[a]] == 1:
                        mine += 1
                        after = pairs.free[k] + _corrected(contact, k, a, b, turning) - pairs.slack[k]
                        behind += pairs.p[k] * pairs.before[k]
                        ahead += pairs.p[k] * after
                        deepest = ti.max(deepest, -pairs.gap[k])
        touching += mine
        if deepest > contact.deepest[0]:
            ti.atomic_max(contact.deepest[0], deepest)
        if dt_before == 0.0:
            # v_0 is given at t = 0, and the kinetic energy there is that of v_0 less 1/2 p (v_1 - v_0), as in world.step
            contact.work[block] -= 0.5 * (ahead - behind)
        contact.work[block] += 0.5 * dt_before * per_kick * behind
        contact.ahead[block] = 0.5 * dt * per_kick * ahead
    return touching

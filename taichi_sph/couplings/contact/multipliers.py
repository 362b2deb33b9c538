"""Contact forces as multipliers of a unilateral constraint on the half-step velocities (T 3.8 to 3.18).

For each pair of pinballs, with v* the velocities at n+1/2 if there were no contact (T 3.17) and c the row of normals,

    c (v* + M^-1 c^T p) >= -<gap>_+ / dt,     p >= 0,     p = 0 where the left side is above the right one

that is b p = w with b = c M^-1 c^T (T 3.15, 3.16) where p > 0, and no force where the bodies part by themselves: the
rebound of T 3.18, decided together with the forces instead of before them. The gap on the right lets a pair come to touch and no
further, so penetration stays at the order of what the normals turn in a step. Between two rigid bodies the right side is Newton's
rebound speed. Impulses are equal and opposite on each pair, so linear momentum is kept to rounding.

Solved by accelerated projected gradients (Nesterov; Mazhar et al. 2015), each pair scaled by the inverse masses that
it would see if every participant were split among its pairs (Tonge et al. 2012): that scaling bounds b from above for any set of
pairs, redundant ones too. The momentum of a pair restarts when it climbs (after O'Donoghue and Candes 2015, who restart all at once). Pairs
gather from participants and participants from pairs: no scatter, one result for any number of threads.
"""

import time as clock

import numpy as np

from ... import runtime
from ...bodies.rigid.pool import place, spin_of, spun
from ...errors import RunStopped, SceneError
from ...runtime import ti
from .bodies import Bodies, inverse_mass, mobility, place_of_node, radius_against, velocity_before, velocity_free
from .pairs import FLUID_RIGID, FLUID_SHELL, RIGID_RIGID, RIGID_SHELL, Pairs, disc_gap
from .said import PinballContact

BLOCK = 512
FIRST, CHECK = 2, 8  # iterations before the first look at the error; the most between two looks
SMALL = 1e-2  # of the fastest speed: an approach below it is not resolved any finer


@ti.data_oriented
class Contact:
    """All contact of a run. `add` puts its forces on the pools; the rest is for the record."""

    def __init__(self, bodies: Bodies, settings: PinballContact, self_contact: bool, skin: float):
        """skin [m]: how far beyond contact pairs are kept ready."""
        self.bodies, self.settings, self.skin = bodies, settings, skin
        self.pairs = Pairs(bodies, self_contact)
        self.dv = runtime.new("contact.dv", bodies.n, 3, "f64")  # m/s, change by the impulses
        self.share = runtime.new("contact.share", bodies.n, dtype="i32")  # near pairs of a participant
        if bodies.has_rigids:
            self.dw = runtime.new("contact.dw", bodies.nr, 3, "f64")  # rad/s
        blocks = -(-self.pairs.capacity // BLOCK)
        self.blocks = blocks
        self.work = runtime.new("contact.work", blocks, dtype="f64")  # J, done on the bodies up to time n
        self.ahead = runtime.new("contact.ahead", blocks, dtype="f64")  # J, what it does on the way to n + 1
        self.travelled = np.inf  # m, since the last search
        self.touching = 0  # pairs with a force
        self.penetration = 0.0  # m, largest so far
        self.iterations = 0  # of the last step
        self.all_iterations, self.solves, self.seconds, self.unsolved = 0, 0, 0.0, 0
        self.largest_error = 0.0  # of a step, over its tolerance's scale

    def check_start(self, shell_name: str) -> None:
        """SceneError when bodies lie in each other at t = 0."""
        self.pairs.search(self.skin)
        if not self.pairs.n:
            return
        _measure(self, self.pairs.n, 0.0, 0.0, 0.0, self.skin, 0, 1)
        gap = runtime.get(self.pairs.gap, self.pairs.n)
        kind = runtime.get(self.pairs.kind, self.pairs.n)
        gap[kind > FLUID_RIGID] = 0.0
        gap[(kind == FLUID_SHELL) | (kind == FLUID_RIGID)] += 0.5 * self.skin  # a filling may touch its vessel
        k = int(np.argmin(gap))
        allowed = 1e-3 * self.skin
        if gap[k] < -allowed:
            balls = runtime.get(self.pairs.ball, self.pairs.n)
            names = self.bodies.rigids.names if self.bodies.has_rigids else []
            owner = runtime.get(self.bodies.rigids.ball_body, self.bodies.rigids.n_balls) if names else []
            one = f"rigid '{names[owner[balls[k]]]}'" if kind[k] in (RIGID_SHELL, RIGID_RIGID) else "fluid"
            two = f"shell '{shell_name}'"
            if kind[k] in (RIGID_RIGID, FLUID_RIGID):
                other = int(runtime.get(self.pairs.other, self.pairs.n)[k])
                two = f"rigid '{names[owner[other]]}'"
            raise SceneError(f"{one} starts {1e3 * -gap[k]:.3g} mm inside {two}: move one of them away, pinballs touch at most")

    def add(self, dt_before: float, dt: float, half_time: float, renumbered: bool = False, times: int = 1) -> None:
        """Forces of contact at the present time, once all others are known. renumbered: the fluid's particles stand in
        another order than at the step before; times: how many steps the fluid takes at once now, 0 when it is not its turn."""
        began = clock.perf_counter()
        bodies, pairs = self.bodies, self.pairs
        kick = 0.5 * (dt_before + dt)
        if bodies.has_rigids:
            place(bodies.rigids, bodies.rigids.n_balls)
        if bodies.has_fluid:
            _calm(bodies.fluid, bodies.nf)
        top = _fastest(bodies, bodies.ns, bodies.nf, bodies.nr)
        ahead = max(times, 1) * dt * top
        self.travelled += ahead  # by the end of the step to come
        if renumbered or 2.0 * self.travelled > 0.9 * self.skin:
            pairs.search(self.skin + 2.0 * ahead)
            self.travelled = ahead
        self.iterations = 0
        if pairs.n:
            largest = _measure(self, pairs.n, dt, kick, half_time, self.skin, 1, times)
            if largest > 0.0:
                _shares(self, pairs.n_who)
                _weigh(self, pairs.n)
                self._solve(max(largest, SMALL * top))
                _push(self, pairs.n_who, 1.0 / kick, max(times, 1))
            self.touching = _book(self, pairs.n, self.blocks, dt_before, dt, 1.0 / kick, int(largest > 0.0))
        else:
            _book(self, 0, self.blocks, dt_before, dt, 1.0, 0)
            self.touching = 0
        self.seconds += clock.perf_counter() - began

    def _solve(self, scale: float) -> None:
        pairs = self.pairs
        t, some = 1.0, FIRST
        error = np.inf
        while self.iterations < self.settings.iterations:
            some = min(some, self.settings.iterations - self.iterations)
            for _ in range(some):
                following = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * t * t))
                _correct(self, pairs.n_who, 1)
                _project(self, pairs.n, (t - 1.0) / following)
                t = following
            self.iterations += some
            some = min(2 * some, CHECK)
            _correct(self, pairs.n_who, 0)
            error = _error(self, pairs.n) / scale
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
        self.penetration = max(self.penetration, _deepest(self, pairs.n))

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

    def state(self) -> dict[str, np.ndarray]:
        n = self.pairs.n
        kept = ("kind", "ball", "other", "a", "b", "p", "y")
        return {
            "contact.numbers": np.array(
                [n, self.travelled, self.penetration, self.all_iterations, self.solves, self.unsolved, self.largest_error]
            ),
            "contact.work": runtime.get(self.work, self.blocks),
            "contact.ahead": runtime.get(self.ahead, self.blocks),
            **{f"contact.{k}": runtime.get(getattr(self.pairs, k), self.pairs.capacity) for k in kept},
            **(
                {f"contact.{k}": runtime.get(getattr(self.bodies, k), self.bodies.ns) for k in ("disc", "sound")}
                if self.bodies.has_shell
                else {}
            ),
        }

    def restore(self, state: dict[str, np.ndarray]) -> None:
        n, self.travelled, self.penetration, iterations, solves, unsolved, self.largest_error = (float(x) for x in state["contact.numbers"])
        self.pairs.n = int(n)
        self.all_iterations, self.solves, self.unsolved = int(iterations), int(solves), int(unsolved)
        runtime.put(self.work, np.asarray(state["contact.work"]))
        runtime.put(self.ahead, np.asarray(state["contact.ahead"]))
        for k in ("kind", "ball", "other", "a", "b", "p", "y"):
            runtime.put(getattr(self.pairs, k), np.asarray(state[f"contact.{k}"]))
        if self.bodies.has_shell:
            for k in ("disc", "sound"):
                runtime.put(getattr(self.bodies, k), np.asarray(state[f"contact.{k}"]))
        self.pairs.list_participants()


@ti.kernel
def _calm(fluid: ti.template(), n: ti.i32):
    for j in range(n):
        fluid.push[j] *= 0.0


@ti.kernel
def _fastest(bodies: ti.template(), ns: ti.i32, nf: ti.i32, nr: ti.i32) -> ti.f64:
    """Largest speed of all points [m/s]."""
    top = ti.cast(0.0, ti.f64)
    if ti.static(bodies.has_shell):
        for i in range(ns):
            ti.atomic_max(top, ti.cast(bodies.nodes.v[i].norm(), ti.f64))
    if ti.static(bodies.has_fluid):
        for j in range(nf):
            ti.atomic_max(top, ti.cast(bodies.fluid.v[j].norm(), ti.f64))
    if ti.static(bodies.has_rigids):
        for r in range(nr):
            ti.atomic_max(top, bodies.rigids.v[r].norm())
        for p in range(bodies.rigids.n_balls):
            r = bodies.rigids.ball_body[p]
            ti.atomic_max(top, bodies.rigids.v[r].norm() + spin_of(bodies.rigids, r).norm() * bodies.rigids.ball_arm[p].norm())
    return top


@ti.func
def _geometry(contact: ti.template(), k):
    """(gap, normal from the other to the ball, point of contact) of pair k."""
    kind, ball, other = contact.pairs.kind[k], contact.pairs.ball[k], contact.pairs.other[k]
    gap = ti.cast(0.0, ti.f64)
    c = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    normal = c
    radius = gap
    if ti.static(contact.bodies.has_rigids):
        if kind == RIGID_SHELL or kind == RIGID_RIGID:
            c, radius = contact.bodies.rigids.ball_x[ball], contact.bodies.rigids.ball_radius[ball]
    if ti.static(contact.bodies.has_fluid):
        if kind == FLUID_SHELL or kind == FLUID_RIGID:
            c = ti.cast(contact.bodies.fluid.x[ball], ti.f64)
            radius = contact.bodies.fluid_radius[0]
    if ti.static(contact.bodies.has_shell):
        if ti.static(contact.bodies.has_fluid):
            if kind == FLUID_SHELL:
                radius = radius_against(contact.bodies, other)
        if kind == RIGID_SHELL or kind == FLUID_SHELL:
            g, n, q = disc_gap(contact.bodies, other, c, radius)
            gap, normal = g, n
        elif kind > FLUID_RIGID:
            c, radius = place_of_node(contact.bodies, ball), contact.bodies.half[0]
            g, n, q = disc_gap(contact.bodies, other, c, radius)
            gap, normal = g, n
    if ti.static(contact.bodies.has_rigids):
        if kind == RIGID_RIGID or kind == FLUID_RIGID:
            away = c - contact.bodies.rigids.ball_x[other]
            distance = away.norm()
            normal = away / ti.max(distance, 1e-300)
            gap = distance - radius - contact.bodies.rigids.ball_radius[other]
    return gap, normal, c - radius * normal


@ti.func
def _speeds(contact: ti.template(), k, kick, half_time, times):
    """Normal speeds of pair k: at the half step before, and free at the half step to come [m/s]."""
    a, b, arm_a, arm_b, n = contact.pairs.a[k], contact.pairs.b[k], contact.pairs.arm_a[k], contact.pairs.arm_b[k], contact.pairs.normal[k]
    before = (velocity_before(contact.bodies, a, arm_a) - velocity_before(contact.bodies, b, arm_b)).dot(n)
    free = (
        velocity_free(contact.bodies, a, arm_a, kick, half_time, times) - velocity_free(contact.bodies, b, arm_b, kick, half_time, times)
    ).dot(n)
    return before, free


@ti.kernel
def _measure(
    contact: ti.template(), n: ti.i32, dt: ti.f64, kick: ti.f64, half_time: ti.f64, skin: ti.f64, speeds: ti.i32, times: ti.i32
) -> ti.f64:
    """Where each pair is and how fast it closes; the largest free approach beyond what is allowed [m/s]."""
    top = ti.cast(0.0, ti.f64)
    for k in range(n):
        gap, normal, point = _geometry(contact, k)
        contact.pairs.gap[k], contact.pairs.normal[k] = gap, normal
        if ti.static(contact.bodies.has_rigids):
            first = contact.bodies.ns + contact.bodies.nf
            if contact.pairs.a[k] >= first:
                contact.pairs.arm_a[k] = point - contact.bodies.rigids.x[contact.pairs.a[k] - first]
            if contact.pairs.b[k] >= first:
                contact.pairs.arm_b[k] = point - contact.bodies.rigids.x[contact.pairs.b[k] - first]
        kind = contact.pairs.kind[k]
        wet = kind == FLUID_SHELL or kind == FLUID_RIGID
        if wet and times == 0:  # not its turn; p waits
            contact.pairs.near[k] = 0
        elif speeds == 1:
            step = dt
            if wet:
                step *= times
            before, free = _speeds(contact, k, kick, half_time, times)
            slack = free + ti.max(gap, 0.0) / step
            if ti.static(contact.bodies.has_rigids):
                if contact.pairs.kind[k] == RIGID_RIGID and slack < 0.0 and before < 0.0:
                    first = contact.bodies.ns + contact.bodies.nf
                    e = ti.max(
                        contact.bodies.rigids.restitution[contact.pairs.a[k] - first],
                        contact.bodies.rigids.restitution[contact.pairs.b[k] - first],
                    )
                    if e > 0.0:
                        slack = free + e * before
            contact.pairs.before[k], contact.pairs.free[k], contact.pairs.slack[k] = before, free, slack
            near = 0
            if gap + step * ti.min(free, 0.0) < 0.3 * skin:
                near = 1
            contact.pairs.near[k] = near
            if near == 0:
                contact.pairs.p[k] = 0.0
            contact.pairs.y[k] = contact.pairs.p[k]
            ti.atomic_max(top, -slack)
    return top


@ti.kernel
def _shares(contact: ti.template(), n_who: ti.i32):
    for m in range(n_who):
        count = 0
        for e in range(contact.pairs.first[m], contact.pairs.first[m + 1]):
            count += contact.pairs.near[contact.pairs.entry[e] // 2]
        contact.share[contact.pairs.who[m]] = count


@ti.kernel
def _weigh(contact: ti.template(), n: ti.i32):
    for k in range(n):
        if contact.pairs.near[k] == 1:
            a, b, normal = contact.pairs.a[k], contact.pairs.b[k], contact.pairs.normal[k]
            weight = contact.share[a] * mobility(contact.bodies, a, contact.pairs.arm_a[k], normal)
            weight += contact.share[b] * mobility(contact.bodies, b, contact.pairs.arm_b[k], normal)
            contact.pairs.weight[k] = weight
            if weight <= 0.0:  # both are held: nothing to be done
                contact.pairs.near[k] = 0
                contact.pairs.p[k] = contact.pairs.y[k] = 0.0


@ti.func
def _impulse(contact: ti.template(), m, extrapolated):
    """Impulse and moment of impulse on participant who[m]."""
    J = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    L = J
    for e in range(contact.pairs.first[m], contact.pairs.first[m + 1]):
        entry = contact.pairs.entry[e]
        k = entry // 2
        if contact.pairs.near[k] == 1:
            p = contact.pairs.y[k] if extrapolated == 1 else contact.pairs.p[k]
            arm = contact.pairs.arm_a[k]
            if entry % 2 == 1:
                p = -p
                arm = contact.pairs.arm_b[k]
            J += p * contact.pairs.normal[k]
            L += arm.cross(p * contact.pairs.normal[k])
    return J, L


@ti.kernel
def _correct(contact: ti.template(), n_who: ti.i32, extrapolated: ti.i32):
    """Changes of velocity by the impulses y, or p."""
    for m in range(n_who):
        p = contact.pairs.who[m]
        J, L = _impulse(contact, m, extrapolated)
        contact.dv[p] = inverse_mass(contact.bodies, p) * J
        if ti.static(contact.bodies.has_rigids):
            r = p - contact.bodies.ns - contact.bodies.nf
            if r >= 0:
                contact.dw[r] = spun(contact.bodies.rigids, r, contact.bodies.rigids.q[r], L)


@ti.func
def _corrected(contact: ti.template(), k):
    """slack of pair k with the changes of velocity [m/s]; it should not be negative."""
    a, b = contact.pairs.a[k], contact.pairs.b[k]
    v = contact.dv[a] - contact.dv[b]
    if ti.static(contact.bodies.has_rigids):
        first = contact.bodies.ns + contact.bodies.nf
        if a >= first:
            v += contact.dw[a - first].cross(contact.pairs.arm_a[k])
        if b >= first:
            v -= contact.dw[b - first].cross(contact.pairs.arm_b[k])
    return contact.pairs.slack[k] + v.dot(contact.pairs.normal[k])


@ti.kernel
def _project(contact: ti.template(), n: ti.i32, beta: ti.f64):
    for k in range(n):
        if contact.pairs.near[k] == 1:
            r = _corrected(contact, k)
            p = ti.max(0.0, contact.pairs.y[k] - r / contact.pairs.weight[k])
            step = p - contact.pairs.p[k]
            y = p + beta * step
            if r * step > 0.0:
                y = p
            contact.pairs.p[k], contact.pairs.y[k] = p, y


@ti.kernel
def _error(contact: ti.template(), n: ti.i32) -> ti.f64:
    """Largest violation, of the constraint or of complementarity [m/s]."""
    top = ti.cast(0.0, ti.f64)
    for k in range(n):
        if contact.pairs.near[k] == 1:
            r = _corrected(contact, k)
            wrong = ti.max(-r, ti.min(r, contact.pairs.p[k] * contact.pairs.weight[k]))
            if not (wrong < ti.math.inf):  # also true for nan
                wrong = ti.math.inf
            ti.atomic_max(top, wrong)
    return top


@ti.kernel
def _push(contact: ti.template(), n_who: ti.i32, per_kick: ti.f64, times: ti.i32):
    """The impulses as forces on the pools."""
    for m in range(n_who):
        p = contact.pairs.who[m]
        J, L = _impulse(contact, m, 0)
        force = per_kick * J
        if ti.static(contact.bodies.has_shell):
            if p < contact.bodies.ns:
                contact.bodies.nodes.force[p] += ti.cast(force, float)
        if ti.static(contact.bodies.has_fluid):
            if p >= contact.bodies.ns and p < contact.bodies.ns + contact.bodies.nf:
                contact.bodies.fluid.push[p - contact.bodies.ns] = ti.cast(force / times, float)
        if ti.static(contact.bodies.has_rigids):
            r = p - contact.bodies.ns - contact.bodies.nf
            if r >= 0:
                contact.bodies.rigids.force[r] += force
                contact.bodies.rigids.torque[r] += per_kick * L


@ti.kernel
def _deepest(contact: ti.template(), n: ti.i32) -> ti.f64:
    top = ti.cast(0.0, ti.f64)
    for k in range(n):
        if contact.pairs.near[k] == 1 and contact.pairs.p[k] > 0.0:
            ti.atomic_max(top, -contact.pairs.gap[k])
    return top


@ti.kernel
def _book(contact: ti.template(), n: ti.i32, blocks: ti.i32, dt_before: ti.f64, dt: ti.f64, per_kick: ti.f64, acts: ti.i32) -> ti.i32:
    """Work of contact on the couplings.contact.bodies, trapezoidal as in world.step; returns the pairs with a force."""
    touching = 0
    for b in range(blocks):
        contact.work[b] += contact.ahead[b]
        behind, ahead = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        if acts == 1:
            for k in range(b * BLOCK, ti.min(n, (b + 1) * BLOCK)):
                if contact.pairs.near[k] == 1 and contact.pairs.p[k] > 0.0:
                    touching += 1
                    after = contact.pairs.free[k] + _corrected(contact, k) - contact.pairs.slack[k]
                    behind += contact.pairs.p[k] * contact.pairs.before[k]
                    ahead += contact.pairs.p[k] * after
        if dt_before == 0.0:
            # v_0 is given at t = 0, and the kinetic energy there is that of v_0 less 1/2 p (v_1 - v_0), as in world.step
            contact.work[b] -= 0.5 * (ahead - behind)
        contact.work[b] += 0.5 * dt_before * per_kick * behind
        contact.ahead[b] = 0.5 * dt * per_kick * ahead
    return touching

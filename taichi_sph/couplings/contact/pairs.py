"""Which pinballs are near each other: candidate pairs, kept until something has moved by half the skin.

A pair is a ball (of a rigid body, a fluid particle, a shell node in self-contact) against a disc of the shell or a ball
of a rigid body. The disc is rounded: all points within half the thickness of a flat disc of radius R_1, so that with
q the point of the flat disc nearest to the ball's centre c,

    n = (c - q) / |c - q|,     gap = |c - q| - R_2 - e/2

Over the disc this is T 3.19; beside it the ball touches when d_t < R_1 + sqrt((R_2 + e/2)^2 - d_n^2), where T 3.20 has
sqrt(R_2^2 - (d_n - e/2)^2): a round rim is touched up to e/2 earlier. There the normal leans as the rim does. T pushes along the
director even there, and so a striker that has passed the plane of the shell would drag the rim of its hole along.

Candidates are counted and written by their owners in order: the list is the same for any number of threads.
"""

from ... import runtime
from ...errors import RunStopped
from ...numerics.cells import CellGrid, bucket, cube, running
from ...runtime import ti
from .bodies import Bodies, director_of, place_of_node, radius_against

RIGID_SHELL, RIGID_RIGID, FLUID_SHELL, FLUID_RIGID, SELF = range(5)


@ti.data_oriented
class Pairs:
    """Candidates (kind, ball, against) and what the solver keeps of each; incidence by participant."""

    def __init__(self, bodies: Bodies, self_contact: bool):
        self.bodies, self.self_contact = bodies, self_contact
        balls = bodies.rigids.n_balls if bodies.has_rigids else 0
        size = balls * balls + min(balls * bodies.ns, 40_000 + 4 * bodies.ns) + min(balls * bodies.nf, 20_000 + bodies.nf)
        size += min(24 * bodies.ns, 16 * bodies.nf) + (8 * bodies.ns if self_contact else 0)
        self.capacity = max(size, 64)
        new = runtime.new
        n = self.capacity
        self.n = 0
        self.kind = new("pairs.kind", n, dtype="i32")
        self.ball = new("pairs.ball", n, dtype="i32")  # pinball, particle or node
        self.other = new("pairs.other", n, dtype="i32")  # node or pinball
        self.a = new("pairs.a", n, dtype="i32")  # participant of the ball
        self.b = new("pairs.b", n, dtype="i32")  # participant of the other
        self.normal = new("pairs.normal", n, 3, "f64")  # from b to a
        self.arm_a = new("pairs.arm_a", n, 3, "f64")  # m, from the centre of a rigid a to the point of contact
        self.arm_b = new("pairs.arm_b", n, 3, "f64")
        self.gap = new("pairs.gap", n, dtype="f64")  # m, negative in penetration
        self.near = new("pairs.near", n, dtype="i32")  # 1: may touch in this step
        self.slack = new("pairs.slack", n, dtype="f64")  # m/s, free approach speed, plus what the gap still allows
        self.before = new("pairs.before", n, dtype="f64")  # m/s, normal speed at the half step before
        self.free = new("pairs.free", n, dtype="f64")  # m/s, normal speed at the half step to come without contact
        self.weight = new("pairs.weight", n, dtype="f64")  # 1/kg, diagonal with split masses
        self.p = new("pairs.p", n, dtype="f64")  # N s, impulse: the multiplier times the kick
        self.y = new("pairs.y", n, dtype="f64")  # N s, extrapolated
        # incidence: who[m] takes part in entries first[m] .. first[m + 1]; entry = 2 pair + (0 as a, 1 as b)
        self.n_who = 0
        self.place = new("pairs.place", bodies.n + 1, dtype="i32")
        self.who = new("pairs.who", min(bodies.n, 2 * n), dtype="i32")
        self.first = new("pairs.first", min(bodies.n, 2 * n) + 1, dtype="i32")
        self.entry = new("pairs.entry", 2 * n, dtype="i32")
        owners = max(bodies.ns, bodies.nf, balls)
        self.start = new("pairs.start", owners + 1, dtype="i32")
        if bodies.has_shell and (bodies.has_fluid or self_contact):
            self.node_x = new("pairs.node_x", bodies.ns, 3, "f64")
            self.grid = CellGrid("pairs.grid", self.node_x, bodies.ns, 1.0)  # its reach is that of each search

    def search(self, skin: float) -> None:
        """All pairs within `skin` [m] of contact, as the bodies lie now."""
        b = self.bodies
        b.shape_discs()
        self.n = 0
        if b.has_shell and (b.has_fluid or self.self_contact):
            _node_places(self, b.ns)
            largest = _largest_disc(b, b.ns) + b.half_thickness
            ball = b.fluid_radius[1] if b.has_fluid else 0.0
            self.grid.reach = largest + max(ball, b.half_thickness) + skin
            self.grid.rebuild()
        if b.has_rigids:
            if b.has_shell:
                self._collect(_rigid_shell, b.ns, skin)
            if b.has_fluid:
                self._collect(_fluid_rigid, b.nf, skin)
            if b.nr > 1:
                self._collect(_rigid_rigid, b.rigids.n_balls, skin)
        if b.has_shell and b.has_fluid:
            self._collect(_near_discs, b.nf, skin, FLUID_SHELL, 1.0 / self.grid.reach, self.grid.table)
        if self.self_contact:
            self._collect(_near_discs, b.ns, skin, SELF, 1.0 / self.grid.reach, self.grid.table)
        self.list_participants()

    def list_participants(self) -> None:
        """The pairs of each participant, from the list of pairs."""
        self.n_who = _incidence(self, self.n, self.bodies.n)

    def _collect(self, look, owners: int, skin: float, *more) -> None:
        """Count what each owner finds, then have it written behind what is there."""
        look(self, owners, skin, 0, self.n, *more)
        found = running(self.start, owners)
        if self.n + found > self.capacity:
            raise RunStopped(
                f"contact: {self.n + found} pairs of pinballs are near each other and {self.capacity} have room; the bodies "
                "are likely crushed into each other: look at the last frame, lower the speed or the spacing"
            )
        if found:
            look(self, owners, skin, 1, self.n, *more)
        self.n += found


@ti.kernel
def _largest_disc(bodies: ti.template(), n: ti.i32) -> ti.f64:
    """Radius of the largest disc [m]."""
    top = ti.cast(0.0, ti.f64)
    for i in range(n):
        ti.atomic_max(top, bodies.disc[i])
    return top


@ti.func
def disc_gap(bodies: ti.template(), i, c, radius):
    """(gap, normal from the disc of node i to a ball at c, nearest point of the rounded disc's flat one)."""
    n = director_of(bodies, i)
    x = place_of_node(bodies, i)
    away = c - x
    flat = away - away.dot(n) * n
    d = flat.norm()
    if d > bodies.disc[i]:
        flat *= bodies.disc[i] / d
    q = x + flat
    normal = c - q
    distance = normal.norm()
    if distance > 1e-12 * (radius + bodies.half[0]):
        normal /= distance
    else:
        normal = n
    return distance - radius - bodies.half[0], normal, q


@ti.func
def may_touch(bodies: ti.template(), i, j):
    """Whether nodes i and j of one shell are far enough apart in the reference to be two things that meet."""
    apart = (bodies.nodes.X[i] - bodies.nodes.X[j]).norm()
    return apart > 2.0 * (bodies.disc[i] + bodies.disc[j]) + 4.0 * bodies.half[0]


@ti.func
def _note(pairs: ti.template(), k, kind, ball, other, a, b):
    pairs.kind[k], pairs.ball[k], pairs.other[k] = kind, ball, other
    pairs.a[k], pairs.b[k] = a, b
    pairs.p[k] = 0.0


@ti.kernel
def _node_places(pairs: ti.template(), n: ti.i32):
    for i in range(n):
        pairs.node_x[i] = place_of_node(pairs.bodies, i)


@ti.kernel
def _rigid_shell(pairs: ti.template(), n: ti.i32, skin: ti.f64, write: ti.i32, base: ti.i32):
    for i in range(n):
        found = 0
        x = place_of_node(pairs.bodies, i)
        for p in range(pairs.bodies.rigids.n_balls):
            c, radius = pairs.bodies.rigids.ball_x[p], pairs.bodies.rigids.ball_radius[p]
            far = radius + pairs.bodies.disc[i] + pairs.bodies.half[0] + skin
            if (c - x).norm_sqr() < far * far:
                gap, normal, q = disc_gap(pairs.bodies, i, c, radius)
                if gap < skin:
                    if write == 1:
                        r = pairs.bodies.rigids.ball_body[p] + pairs.bodies.ns + pairs.bodies.nf
                        _note(pairs, base + pairs.start[i] + found, RIGID_SHELL, p, i, r, i)
                    found += 1
        if write == 0:
            pairs.start[i + 1] = found


@ti.kernel
def _rigid_rigid(pairs: ti.template(), n: ti.i32, skin: ti.f64, write: ti.i32, base: ti.i32):
    for p in range(n):
        found = 0
        one = pairs.bodies.rigids.ball_body[p]
        for q in range(p):
            two = pairs.bodies.rigids.ball_body[q]
            if two != one:
                away = (pairs.bodies.rigids.ball_x[p] - pairs.bodies.rigids.ball_x[q]).norm()
                if away < pairs.bodies.rigids.ball_radius[p] + pairs.bodies.rigids.ball_radius[q] + skin:
                    if write == 1:
                        first = pairs.bodies.ns + pairs.bodies.nf
                        _note(pairs, base + pairs.start[p] + found, RIGID_RIGID, p, q, one + first, two + first)
                    found += 1
        if write == 0:
            pairs.start[p + 1] = found


@ti.kernel
def _fluid_rigid(pairs: ti.template(), n: ti.i32, skin: ti.f64, write: ti.i32, base: ti.i32):
    for j in range(n):
        found = 0
        c = ti.cast(pairs.bodies.fluid.x[j], ti.f64)
        radius = pairs.bodies.fluid_radius[0]
        for p in range(pairs.bodies.rigids.n_balls):
            far = radius + pairs.bodies.rigids.ball_radius[p] + skin
            if (pairs.bodies.rigids.ball_x[p] - c).norm_sqr() < far * far:
                if write == 1:
                    first = pairs.bodies.ns + pairs.bodies.nf
                    body = pairs.bodies.rigids.ball_body[p] + first
                    _note(pairs, base + pairs.start[j] + found, FLUID_RIGID, j, p, j + pairs.bodies.ns, body)
                found += 1
        if write == 0:
            pairs.start[j + 1] = found


@ti.kernel
def _near_discs(pairs: ti.template(), n: ti.i32, skin: ti.f64, write: ti.i32, base: ti.i32, kind: ti.i32, inverse: ti.f64, table: ti.i32):
    """Discs near the fluid particles (FLUID_SHELL) or near the shell's own nodes (SELF), by the grid of the nodes."""
    for j in range(n):
        found = 0
        c = ti.Vector([0.0, 0.0, 0.0], ti.f64)
        a = j
        if kind == SELF:
            c = pairs.node_x[j]
        if ti.static(pairs.bodies.has_fluid):
            if kind == FLUID_SHELL:
                c = ti.cast(pairs.bodies.fluid.x[j], ti.f64)
                a = j + pairs.bodies.ns
        if write == 0 or pairs.start[j + 1] > pairs.start[j]:  # most have found nothing
            home = cube(c, inverse)
            for dx, dy, dz in ti.ndrange((-1, 2), (-1, 2), (-1, 2)):
                there = home + ti.Vector([dx, dy, dz])
                b = bucket(there, table)
                for m in range(pairs.grid.start[b], pairs.grid.start[b + 1]):
                    i = pairs.grid.sorted[m]
                    radius = pairs.bodies.half[0]  # of a node: a ball that does not stand out of the shell
                    if ti.static(pairs.bodies.has_fluid):
                        if kind == FLUID_SHELL:
                            radius = radius_against(pairs.bodies, i)
                    far = radius + pairs.bodies.disc[i] + pairs.bodies.half[0] + skin
                    if (c - pairs.node_x[i]).norm_sqr() < far * far:
                        if all(cube(pairs.node_x[i], inverse) == there) and (kind == FLUID_SHELL or may_touch(pairs.bodies, j, i)):
                            gap, normal, q = disc_gap(pairs.bodies, i, c, radius)
                            if gap < skin:
                                if write == 1:
                                    _note(pairs, base + pairs.start[j] + found, kind, j, i, a, i)
                                found += 1
        if write == 0:
            pairs.start[j + 1] = found


@ti.kernel
def _incidence(pairs: ti.template(), n: ti.i32, participants: ti.i32) -> ti.i32:
    """Entries of each participant, in the order of the pairs; returns how many take part at all."""
    taking_part = 0
    ti.loop_config(serialize=True)
    for _ in range(1):
        for p in range(participants + 1):
            pairs.place[p] = 0
        for k in range(n):
            pairs.place[pairs.a[k] + 1] += 1
            pairs.place[pairs.b[k] + 1] += 1
        for p in range(participants):
            count = pairs.place[p + 1]
            if count > 0:
                pairs.who[taking_part] = p
                pairs.first[taking_part] = pairs.place[p]
                taking_part += 1
            pairs.place[p + 1] += pairs.place[p]
        pairs.first[taking_part] = 2 * n
        for k in range(n):
            for side in range(2):
                p = pairs.a[k] if side == 0 else pairs.b[k]
                pairs.entry[pairs.place[p]] = 2 * k + side
                pairs.place[p] += 1
    return taking_part

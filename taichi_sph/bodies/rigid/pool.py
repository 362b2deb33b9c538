"""Rigid bodies: few of them, each with its pinballs (T 3.3). Data and the way they move; always f64, for a body
moves far and turns often."""

import numpy as np

from ... import runtime
from ...runtime import ti
from .said import Rigid


@ti.data_oriented
class RigidBodies:
    """State: x, v, q, L (v and L at the half step before); force and torque are overwritten each step, and f_max keeps the
    largest force until it is taken (`hardest`). Turning is kept as angular momentum in space, which contact alone changes,
    so that a tumbling body neither gains nor loses any."""

    def __init__(self, bodies: tuple[Rigid, ...]):
        self.names = [body.name for body in bodies]
        self.n = n = len(bodies)
        self.n_balls = sum(len(body.pinballs) for body in bodies)
        new = runtime.new
        self.x = new("rigid.x", n, 3, "f64")  # m, centre of mass
        self.v = new("rigid.v", n, 3, "f64")  # m/s
        self.q = new("rigid.q", n, 4, "f64")  # quaternion (w, x, y, z) from t = 0 to now
        self.L = new("rigid.L", n, 3, "f64")  # kg m2/s, angular momentum about the centre of mass
        self.force = new("rigid.force", n, 3, "f64")  # N, water and contact
        # N, what `felt` has beside `force`: blows in `force` that stand for several steps are spread over those (bodies/rigid/surface.py)
        self.spread = new("rigid.spread", n, 3, "f64")
        self.felt = new("rigid.felt", n, 3, "f64")  # N, of water and contact, each blow spread over the steps that it stands for
        self.f_max = new("rigid.f_max", n, dtype="f64")  # N, largest |force| of the steps since it was last taken
        self.torque = new("rigid.torque", n, 3, "f64")  # N m, about the centre of mass
        self.weight = new("rigid.weight", n, 3, "f64")  # N, gravity
        self.work = new("rigid.work", n, dtype="f64")  # J, done by gravity up to time n
        self.ahead = new("rigid.ahead", n, dtype="f64")  # J, what it does on the way to n + 1
        self.kinetic = new("rigid.kinetic", n, dtype="f64")  # J, of the last step
        self.mass = new("rigid.mass", n, dtype="f64")  # kg
        self.free = new("rigid.free", n, dtype="f64")  # 1, and 0 for a body that is held
        self.axes = new("rigid.axes", n, 4, "f64")  # quaternion of the principal axes at t = 0
        self.moments = new("rigid.moments", n, 3, "f64")  # kg m2, principal
        self.restitution = new("rigid.restitution", n, dtype="f64")
        self.ball_body = new("rigid.ball_body", self.n_balls, dtype="i32")
        self.ball_arm = new("rigid.ball_arm", self.n_balls, 3, "f64")  # m, from the centre of mass, at t = 0
        self.ball_radius = new("rigid.ball_radius", self.n_balls, dtype="f64")  # m
        self.ball_x = new("rigid.ball_x", self.n_balls, 3, "f64")  # m, now

        from scipy.spatial.transform import Rotation

        moments, axes = [], []
        for body in bodies:
            values, vectors = np.linalg.eigh(body.moments)
            if np.linalg.det(vectors) < 0:
                vectors[:, 0] *= -1
            moments.append(values)
            axes.append(np.roll(Rotation.from_matrix(vectors).as_quat(), 1))
        runtime.put(self.x, np.array([body.centre for body in bodies]))
        runtime.put(self.v, np.array([body.velocity for body in bodies], float))
        runtime.put(self.L, np.array([body.moments @ np.array(body.spin) for body in bodies]))
        runtime.put(self.q, np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)))
        runtime.put(self.mass, np.array([body.mass for body in bodies]))
        runtime.put(self.free, np.array([0.0 if body.held else 1.0 for body in bodies]))
        runtime.put(self.axes, np.array(axes))
        runtime.put(self.moments, np.array(moments))
        runtime.put(self.restitution, np.array([body.restitution for body in bodies]))
        runtime.put(self.ball_body, np.repeat(np.arange(n), [len(b.pinballs) for b in bodies]).astype(np.int32))
        runtime.put(self.ball_arm, np.array([np.array(p.centre) - b.centre for b in bodies for p in b.pinballs]))
        runtime.put(self.ball_radius, np.array([p.radius for b in bodies for p in b.pinballs]))
        self.ball_reference = np.array([p.centre for b in bodies for p in b.pinballs])
        place(self, self.n_balls)

    def balls_of(self, r: int) -> np.ndarray:
        """Numbers of the pinballs of body r."""
        return np.flatnonzero(runtime.get(self.ball_body, self.n_balls) == r)

    def history(self) -> dict[str, object]:
        """Fields that are history, with their lengths."""
        names = ("x", "v", "q", "L", "force", "felt", "f_max", "torque", "work", "ahead", "kinetic")
        return {f"rigid.{name}": (getattr(self, name), self.n) for name in names}

    def hardest(self) -> np.ndarray:
        """(n,) largest force of water and contact [N] of all steps since the last call."""
        found = runtime.get(self.f_max, self.n)
        self.f_max.fill(0.0)
        return found


def spins(rigids: RigidBodies) -> np.ndarray:
    """(n, 3) spins now [rad/s]."""
    from scipy.spatial.transform import Rotation

    q, axes = (Rotation.from_quat(np.roll(runtime.get(f, rigids.n), -1, axis=1)) for f in (rigids.q, rigids.axes))
    L, I = runtime.get(rigids.L, rigids.n), runtime.get(rigids.moments, rigids.n)
    pose = q * axes
    return pose.apply(pose.apply(L, inverse=True) / I) * runtime.get(rigids.free, rigids.n)[:, None]


@ti.func
def turned(q, a):
    """The vector a turned by the unit quaternion q."""
    u = ti.Vector([q[1], q[2], q[3]])
    t = 2.0 * u.cross(a)
    return a + q[0] * t + u.cross(t)


@ti.func
def product(p, q):
    """Quaternion of first q, then p."""
    u, w = ti.Vector([p[1], p[2], p[3]]), ti.Vector([q[1], q[2], q[3]])
    s = p[0] * q[0] - u.dot(w)
    v = p[0] * w + q[0] * u + u.cross(w)
    return ti.Vector([s, v[0], v[1], v[2]])


@ti.func
def back(q):
    """The inverse turn."""
    return ti.Vector([q[0], -q[1], -q[2], -q[3]])


@ti.func
def spun(rigids: ti.template(), r, q, L):
    """I^-1 L in space: the spin [rad/s] of body r in the pose q by an angular momentum L; 0 where it is held."""
    pose = product(q, rigids.axes[r])
    a = turned(back(pose), L)
    I = rigids.moments[r]
    return rigids.free[r] * turned(pose, ti.Vector([a[0] / I[0], a[1] / I[1], a[2] / I[2]]))


@ti.func
def spin_of(rigids: ti.template(), r):
    """Spin at the half step before, as the body lies now [rad/s]; without contact also that at the half step to come."""
    return spun(rigids, r, rigids.q[r], rigids.L[r])


@ti.func
def free_velocity(rigids: ti.template(), r, kick):
    """Velocity of the centre at the half step to come, by the forces so far [m/s]."""
    return rigids.v[r] + rigids.free[r] * kick / rigids.mass[r] * (rigids.weight[r] + rigids.force[r])


@ti.func
def rolled(q, theta):
    """The pose q turned further by the vector theta [rad]."""
    angle = theta.norm()
    step = ti.Vector([1.0, 0.0, 0.0, 0.0], ti.f64)
    if angle > 0.0:
        axis = ti.sin(0.5 * angle) / angle * theta
        step = ti.Vector([ti.cos(0.5 * angle), axis[0], axis[1], axis[2]])
    return product(step, q).normalized()


@ti.kernel
def rest(rigids: ti.template(), n: ti.i32):
    """No forces yet."""
    for r in range(n):
        rigids.force[r] *= 0.0
        rigids.torque[r] *= 0.0
        rigids.spread[r] *= 0.0


@ti.kernel
def place(rigids: ti.template(), n_balls: ti.i32):
    """Where the pinballs are now."""
    for p in range(n_balls):
        r = rigids.ball_body[p]
        rigids.ball_x[p] = rigids.x[r] + turned(rigids.q[r], rigids.ball_arm[p])


@ti.kernel
def move(rigids: ti.template(), n: ti.i32, dt_before: ti.f64, dt: ti.f64):
    """Kick by water, contact and gravity, then drift; energies as in world.step."""
    kick = 0.5 * (dt_before + dt)
    for r in range(n):
        before, L_before = rigids.v[r], rigids.L[r]
        v = free_velocity(rigids, r, kick)
        L = L_before + rigids.free[r] * kick * rigids.torque[r]
        weight = rigids.free[r] * rigids.weight[r]
        rigids.work[r] += rigids.ahead[r] + 0.5 * dt_before * weight.dot(before)
        rigids.ahead[r] = 0.5 * dt * weight.dot(v)
        if dt_before == 0.0:
            before, L_before = 2.0 * before - v, 2.0 * L_before - L
        q = rigids.q[r]
        rigids.kinetic[r] = 0.5 * rigids.mass[r] * before.dot(v) + 0.5 * L_before.dot(spun(rigids, r, q, L))
        rigids.felt[r] = rigids.force[r] + rigids.spread[r]
        rigids.f_max[r] = ti.max(rigids.f_max[r], rigids.felt[r].norm())
        rigids.v[r], rigids.L[r] = v, L
        rigids.x[r] += dt * v
        half_way = rolled(q, 0.5 * dt * spun(rigids, r, q, L))
        rigids.q[r] = rolled(q, dt * spun(rigids, r, half_way, L))

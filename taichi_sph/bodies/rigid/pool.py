"""Rigid bodies: few of them, each with its pinballs (T 3.3). Data and the way they move; always f64, for a body
moves far and turns often."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import runtime
from ...numerics.turns import eased, product, rolled, weighed
from ...pool import Pool
from ...runtime import ti
from .solid import Solid


class RigidBodies(Pool):
    """State: x, v, q, L (v and L at the half step before); force and torque are overwritten each step, and f_max keeps the
    largest force until it is taken (`hardest`). `force` holds the whole blow of a slow fluid. `felt` = `force` + `spread` is that blow
    shared evenly over its steps. Turning is kept as angular momentum in space, which contact alone changes, so that a tumbling body
    neither gains nor loses any.

    Of its pinballs: ball_body (B,), ball_arm (B, 3) [m] from the centre of mass at t = 0, ball_radius (B,) [m],
    ball_reference (B, 3) [m].
    """

    def __init__(self, bodies: Sequence[Solid], name: str = "rigid"):
        super().__init__(name)
        self.said = said = [body.said for body in bodies]
        self.names = [body.name for body in bodies]
        self.n = n = len(bodies)
        self.n_balls = sum(len(body.radii) for body in bodies)

        def field(name: str, vector: int = 0, unit: str = "", doc: str = "", keeps: bool = False) -> Any:
            return self.field(name, n, vector, "f64", unit=unit, doc=doc, keeps=keeps)

        self.x = field("x", 3, "m", "centre of mass", True)
        self.v = field("v", 3, "m/s", "velocity of the centre of mass, at the half step before", True)
        self.q = field("q", 4, "", "quaternion (w, x, y, z) of the turn from t = 0 to now", True)
        self.L = field("L", 3, "kg m2/s", "angular momentum about the centre of mass, at the half step before", True)
        self.force = field("force", 3, "N", "of water and contact", True)
        self.spread = field("spread", 3, "N", "felt - force: `force` holds the whole blow of a slow fluid, `felt` its even share")
        self.felt = field("felt", 3, "N", "force + spread: of water and contact, a blow shared evenly over its steps", True)
        self.f_max = field("f_max", 0, "N", "largest |felt| of the steps since it was last taken", True)
        self.torque = field("torque", 3, "N m", "about the centre of mass", True)
        self.weight = field("weight", 3, "N", "gravity")
        self.work = field("work", 0, "J", "done by gravity up to time n", True)
        self.ahead = field("ahead", 0, "J", "what gravity does on the way to n + 1", True)
        self.kinetic = field("kinetic", 0, "J", "of the last step", True)
        self.mass = field("mass", 0, "kg", "mass")
        self.free = field("free", 0, "", "1, and 0 for a body that does not turn by itself: held, driven, or on a rail")
        self.way = field("way", 3, "", "1 along the axes along which it moves by itself, else 0")
        self.drives = any(body.driven is not None for body in said)
        if self.drives:
            self.driven = field("driven", 0, "", "1 for a body that is driven")
            self.led = field("led", 3, "m/s", "velocity of a driven body at the half step to come")
            self.turn = field("turn", 3, "rad/s", "spin of a driven body at the half step to come")
            self.turn_before = field("turn_before", 3, "rad/s", "at the half step before", True)
        self.axes = field("axes", 4, "", "quaternion of the principal axes at t = 0")
        self.moments = field("moments", 3, "kg m2", "principal moments of inertia")
        self.reach = field("reach", 0, "m", "of the farthest point of a surface from the centre of mass; 0 of a body of pinballs")

        from scipy.spatial.transform import Rotation

        moments, axes = [], []
        for body in bodies:
            values, vectors = np.linalg.eigh(body.moments)
            if np.linalg.det(vectors) < 0:
                vectors[:, 0] *= -1
            moments.append(values)
            axes.append(np.roll(Rotation.from_matrix(vectors).as_quat(), 1))
        runtime.put(self.x, np.array([body.centre for body in bodies]))
        runtime.put(self.v, np.array([body.velocity for body in said], float))
        runtime.put(self.L, np.array([body.moments @ np.array(body.said.spin) for body in bodies]))
        runtime.put(self.q, np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)))
        runtime.put(self.mass, np.array([body.mass for body in bodies]))
        runtime.put(self.free, np.array([float(body.free and body.slides is None) for body in said]))
        runtime.put(self.way, np.array([[float(body.free and body.slides in (None, axis)) for axis in "xyz"] for body in said]))
        if self.drives:
            v, spin = self._led(0.0)
            runtime.put(self.driven, np.array([float(body.driven is not None) for body in said]))
            runtime.put(self.v, runtime.get(self.v, n) + v)
            runtime.put(self.turn_before, spin)
            runtime.put(self.L, runtime.get(self.L, n) + np.array([body.moments @ w for body, w in zip(bodies, spin)]))
        runtime.put(self.axes, np.array(axes))
        skins = [body.centre[None] if body.mesh is None else body.mesh.points for body in bodies]
        runtime.put(self.reach, np.array([np.linalg.norm(x - body.centre, axis=1).max() for x, body in zip(skins, bodies)]))
        runtime.put(self.moments, np.array(moments))
        self.ball_body = np.repeat(np.arange(n), [len(body.radii) for body in bodies]).astype(np.int32)
        self.ball_arm = np.concatenate([body.places - body.centre for body in bodies])
        self.ball_radius = np.concatenate([body.radii for body in bodies])
        self.ball_reference = np.concatenate([body.places for body in bodies])

    def _led(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) velocities [m/s] and (n, 3) spins [rad/s] of driven bodies, 0 of others."""
        still = np.zeros(3), np.zeros(3)
        v, spin = zip(*(still if body.driven is None else body.driven.at(time) for body in self.said))
        return np.array(v), np.array(spin)

    def lead(self, half_time: float) -> None:
        """What driven bodies do at the half step to come [s]."""
        if self.drives:
            v, spin = self._led(half_time)
            runtime.put(self.led, v)
            runtime.put(self.turn, spin)

    def ball_places(self) -> np.ndarray:
        """(B, 3) where the pinballs are now [m]."""
        return self.places(self.ball_body, self.ball_arm)

    def places(self, body: np.ndarray, arm: np.ndarray) -> np.ndarray:
        """(K, 3) where points of bodies are now [m]; body (K,), arm (K, 3) [m] from the centre at t = 0."""
        x, q = (runtime.get(field, self.n)[body] for field in (self.x, self.q))
        u = q[:, 1:]
        t = 2.0 * np.cross(u, arm)
        return x + (arm + q[:, :1] * t + np.cross(u, t))

    def hardest(self) -> np.ndarray:
        """(n,) largest force of water and contact [N] of all steps since the last call."""
        found = runtime.get(self.f_max, self.n)
        runtime.fill(self.f_max, 0.0)
        return found


def spins(rigids: RigidBodies) -> np.ndarray:
    """(n, 3) spins now [rad/s]."""
    from scipy.spatial.transform import Rotation

    q, axes = (Rotation.from_quat(np.roll(runtime.get(f, rigids.n), -1, axis=1)) for f in (rigids.q, rigids.axes))
    L, I = runtime.get(rigids.L, rigids.n), runtime.get(rigids.moments, rigids.n)
    pose = q * axes
    found = pose.apply(pose.apply(L, inverse=True) / I) * runtime.get(rigids.free, rigids.n)[:, None]
    return found + runtime.get(rigids.turn_before, rigids.n) if rigids.drives else found


@ti.func
def spun(rigids: ti.template(), r, q, L):
    """I^-1 L in space: the spin [rad/s] of body r in the pose q by an angular momentum L; 0 where it is held."""
    return rigids.free[r] * eased(product(q, rigids.axes[r]), rigids.moments[r], L)


@ti.func
def spin_of(rigids: ti.template(), r):
    """Spin at the half step before, as the body lies now [rad/s]; without contact also that at the half step to come."""
    w = spun(rigids, r, rigids.q[r], rigids.L[r])
    if ti.static(rigids.drives):
        w += rigids.turn_before[r]
    return w


@ti.func
def free_velocity(rigids: ti.template(), r, kick):
    """Velocity of the centre at the half step to come, by the forces so far [m/s]."""
    v = rigids.v[r] + rigids.way[r] * kick / rigids.mass[r] * (rigids.weight[r] + rigids.force[r])
    if ti.static(rigids.drives):
        if rigids.driven[r] > 0.0:
            v = rigids.led[r]
    return v


@ti.func
def spin_to_come(rigids: ti.template(), r, q, L):
    """Spin at the half step to come [rad/s] of body r in the pose q, by its angular momentum then."""
    w = spun(rigids, r, q, L)
    if ti.static(rigids.drives):
        w += rigids.turn[r]
    return w


@ti.kernel
def rest(rigids: ti.template(), n: ti.i32):
    """No forces yet."""
    for r in range(n):
        rigids.force[r] *= 0.0
        rigids.torque[r] *= 0.0
        rigids.spread[r] *= 0.0


@ti.kernel
def move(rigids: ti.template(), n: ti.i32, dt_before: ti.f64, dt: ti.f64):
    """Kick by water, contact and gravity, then drift; energies as in world.step."""
    kick = 0.5 * (dt_before + dt)
    for r in range(n):
        q, before, L_before = rigids.q[r], rigids.v[r], rigids.L[r]
        v = free_velocity(rigids, r, kick)
        L = L_before + rigids.free[r] * kick * rigids.torque[r]
        weight = rigids.way[r] * rigids.weight[r]
        behind, ahead = 0.5 * dt_before * weight.dot(before), 0.5 * dt * weight.dot(v)
        if ti.static(rigids.drives):
            if rigids.driven[r] > 0.0:  # gravity, and what else it takes to drive the body
                L = weighed(product(q, rigids.axes[r]), rigids.moments[r], rigids.turn[r])
                drive = rigids.mass[r] / kick * (v - before) - rigids.force[r]
                twist = (L - L_before) / kick - rigids.torque[r]
                behind = 0.5 * dt_before * (drive.dot(before) + twist.dot(rigids.turn_before[r]))
                ahead = 0.5 * dt * (drive.dot(v) + twist.dot(rigids.turn[r]))
        rigids.work[r] += rigids.ahead[r] + behind
        rigids.ahead[r] = ahead
        if dt_before == 0.0:
            before, L_before = 2.0 * before - v, 2.0 * L_before - L
        rigids.kinetic[r] = 0.5 * rigids.mass[r] * before.dot(v) + 0.5 * L_before.dot(spin_to_come(rigids, r, q, L))
        rigids.felt[r] = rigids.force[r] + rigids.spread[r]
        rigids.f_max[r] = ti.max(rigids.f_max[r], rigids.felt[r].norm())
        rigids.v[r], rigids.L[r] = v, L
        rigids.x[r] += dt * v
        half_way = rolled(q, 0.5 * dt * spin_to_come(rigids, r, q, L))
        rigids.q[r] = rolled(q, dt * spin_to_come(rigids, r, half_way, L))
        if ti.static(rigids.drives):
            rigids.turn_before[r] = rigids.turn[r]

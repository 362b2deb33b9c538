"""Turns in space as unit quaternions (w, x, y, z)."""

from ..runtime import ti
from .doubles import cos, sin


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
def rolled(q, theta):
    """The pose q turned further by the vector theta [rad]."""
    angle = theta.norm()
    step = ti.Vector([1.0, 0.0, 0.0, 0.0], ti.f64)
    if angle > 0.0:
        axis = sin(0.5 * angle) / angle * theta
        step = ti.Vector([cos(0.5 * angle), axis[0], axis[1], axis[2]])
    return product(step, q).normalized()


@ti.func
def weighed(pose, moments, w):
    """I w in space: the angular momentum [kg m2/s] of a body by its spin w [rad/s]; pose and moments as of `eased`."""
    a = turned(back(pose), w)
    return turned(pose, ti.Vector([a[0] * moments[0], a[1] * moments[1], a[2] * moments[2]]))


@ti.func
def eased(pose, moments, L):
    """I^-1 L in space: the spin [rad/s] of a body by an angular momentum L [kg m2/s]. pose: of its principal axes now; moments:
    principal [kg m2]."""
    a = turned(back(pose), L)
    return turned(pose, ti.Vector([a[0] / moments[0], a[1] / moments[1], a[2] / moments[2]]))

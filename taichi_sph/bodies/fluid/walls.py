"""Rigid planes that fluid does not cross. Data only."""

from collections.abc import Sequence

import numpy as np

from ...pool import Pool
from ...runtime import ti
from .said import Wall

RIM = 2.0  # D over which the images around a hole in a wall fade in
MOST = 6  # walls within reach of one place: a box as narrow as that has six
NONE = [-1] * MOST


class Walls(Pool):
    """Rigid planes, each with its hole if it has one."""

    def __init__(self, name: str, walls: Sequence[Wall]):
        super().__init__(name)
        self.n = len(walls)
        self.holed = any(wall.hole is not None for wall in walls)
        self.point = self.field("point", self.n, 3, "f64", unit="m", doc="a point of the plane")
        self.normal = self.field("normal", self.n, 3, "f64", doc="unit vector towards the fluid")
        self.centre = self.field("centre", self.n, 3, "f64", unit="m", doc="of the hole")
        self.radius = self.field("radius", self.n, dtype="f64", unit="m", doc="of the hole; 0: there is none")
        for k, wall in enumerate(walls):
            self.point[k] = wall.point
            self.normal[k] = np.asarray(wall.normal, float) / np.linalg.norm(wall.normal)
            if wall.hole is not None:
                self.centre[k] = wall.hole.centre
                self.radius[k] = wall.hole.radius

    @ti.func
    def height(self, k, x):
        """Of the place x above wall k [m]."""
        return (x - self.point[k]).dot(self.normal[k])

    @ti.func
    def share(self, k, x, width):
        """How much of an image wall k gives to x: 1, but 0 over its hole, growing over `width` around that."""
        result = ti.cast(1.0, ti.f64)
        if self.radius[k] > 0.0:
            across = x - self.centre[k]
            up = across.dot(self.normal[k])
            result = ti.min(ti.max(((across - up * self.normal[k]).norm() - self.radius[k]) / width, 0.0), 1.0)
            if up <= 0.0:
                result = 0.0
        return result

    @ti.func
    def stands(self, k, x):
        """Whether wall k stands below x: not over its hole, and, where it has one, x not on its other side."""
        result = True
        if self.radius[k] > 0.0:
            across = x - self.centre[k]
            up = across.dot(self.normal[k])
            across -= up * self.normal[k]
            result = across.norm() > self.radius[k] and up > 0.0
        return result

    @ti.func
    def near(self, x, reach, width):
        """The walls whose images reach the place x, MOST at most, and how many they are."""
        found = ti.Vector(NONE)
        count = 0
        for k in range(self.n):
            if count < MOST and self.height(k, x) < reach and self.share(k, x, width) > 0.0:
                found[count] = k
                count += 1
        return found, count

    @ti.func
    def shows(self, found, image, x, reach):
        """Whether the image of the place x in the walls `found` whose bit of `image` is 1 can be within reach of anything before them:
        not in two that face each other, nor from outside the reach of a corner."""
        square = ti.cast(0.0, ti.f64)
        result = True
        for c in ti.static(range(MOST)):
            if (image >> c) & 1:
                h = ti.max(self.height(found[c], x), 0.0)
                square += h * h
                for d in ti.static(range(c)):
                    if (image >> d) & 1 and self.normal[found[c]].dot(self.normal[found[d]]) < -0.5:
                        result = False
        return result and square < reach * reach

    @ti.func
    def pierced(self, found, image):
        """Whether one of them has a hole: far from it as well, for what ran out may spread behind the wall, where it has no share."""
        result = False
        for c in ti.static(range(MOST)):
            if (image >> c) & 1:
                result = result or self.radius[found[c]] > 0.0
        return result

    @ti.func
    def turned(self, found, image, a):
        """The vector a reflected in those of the walls `found` whose bit of `image` is 1."""
        for c in ti.static(range(MOST)):
            if (image >> c) & 1:
                normal = ti.cast(self.normal[found[c]], float)
                a -= 2.0 * a.dot(normal) * normal
        return a

    @ti.func
    def mirrored(self, found, image, y, origin):
        """The place y [m, relative to the origin] reflected in them."""
        for c in ti.static(range(MOST)):
            if (image >> c) & 1:
                k = found[c]
                normal = ti.cast(self.normal[k], float)
                y -= 2.0 * (y.dot(normal) - ti.cast((self.point[k] - origin).dot(self.normal[k]), float)) * normal
        return y

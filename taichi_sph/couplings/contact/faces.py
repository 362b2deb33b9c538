"""The point of a cell that is nearest to a place.

A quadrangle is the four triangles between its sides and the mean of its corners: a surface without a hole that goes through all of them
however the cell is warped, and the same whichever corner is named first.
"""

from ...runtime import ti

TINY = 1e-300  # m2: two corners in one place are a side without a length


@ti.func
def in_triangle(a, b, c, x):
    """Parts (3) that the corners a, b, c have of the point of their triangle that is nearest to x (Ericson 2005, 5.1.5)."""
    ab, ac, ax, bx, cx = b - a, c - a, x - a, x - b, x - c
    d1, d2, d3, d4, d5, d6 = ab.dot(ax), ac.dot(ax), ab.dot(bx), ac.dot(bx), ab.dot(cx), ac.dot(cx)
    of_a, of_b, of_c = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2  # areas, times the same
    s = ti.Vector([1.0, 0.0, 0.0], ti.f64)
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        s = ti.Vector([0.0, 1.0, 0.0], ti.f64)
    elif d6 >= 0.0 and d5 <= d6:
        s = ti.Vector([0.0, 0.0, 1.0], ti.f64)
    elif of_c <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / ti.max(d1 - d3, TINY)
        s = ti.Vector([1.0 - t, t, 0.0])
    elif of_b <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / ti.max(d2 - d6, TINY)
        s = ti.Vector([1.0 - t, 0.0, t])
    elif of_a <= 0.0 and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / ti.max((d4 - d3) + (d5 - d6), TINY)
        s = ti.Vector([0.0, 1.0 - t, t])
    else:
        s = ti.Vector([of_a, of_b, of_c]) / (of_a + of_b + of_c)
    return s


@ti.func
def nearest(a, b, c, d, sides, x):
    """(parts (4) of the corners, point [m]) of the cell a, b, c, d nearest to x; sides 3: of the triangle a, b, c."""
    split = ti.Vector([0.0, 0.0, 0.0, 0.0], ti.f64)
    point = a
    if sides == 3:
        s = in_triangle(a, b, c, x)
        for k in ti.static(range(3)):
            split[k] = s[k]
        point = s[0] * a + s[1] * b + s[2] * c
    else:
        middle = 0.25 * (a + b + c + d)
        least = ti.cast(ti.math.inf, ti.f64)
        for k in range(4):
            one, two = a, b
            if k == 1:
                one, two = b, c
            elif k == 2:
                one, two = c, d
            elif k == 3:
                one, two = d, a
            s = in_triangle(one, two, middle, x)
            q = s[0] * one + s[1] * two + s[2] * middle
            away = (x - q).norm_sqr()
            if away < least:
                least, point = away, q
                for m in ti.static(range(4)):
                    split[m] = 0.25 * s[2]
                    if m == k:
                        split[m] += s[0]
                    if m == (k + 1) % 4:
                        split[m] += s[1]
    return split, point

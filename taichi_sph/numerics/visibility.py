"""Visibility (T 2.3.6.2): does the segment between two points cross a broken cell?"""

from ..runtime import ti


@ti.func
def crosses(a, b, corners: ti.template(), n_corners, tolerance):
    """1 when segment a-b has a piece inside the convex polygon (plane coordinates, counter-clockwise).

    The polygon is shrunk by `tolerance` [m], so that a segment along a side, or one that ends on the
    boundary, does not cross: the lips of a crack see along themselves. Cyrus-Beck clipping.
    """
    enter, leave = a[0] * 0.0, a[0] * 0.0 + 1.0
    for k in range(n_corners):
        p = ti.Vector([corners[k, 0], corners[k, 1]])
        q = ti.Vector([corners[(k + 1) % n_corners, 0], corners[(k + 1) % n_corners, 1]])
        side = q - p
        outward = ti.Vector([side[1], -side[0]]) / ti.max(side.norm(), 1e-300)
        da = (a - p).dot(outward) + tolerance
        db = (b - p).dot(outward) + tolerance
        if da > 0.0 and db > 0.0:
            leave = -1.0
        elif da > 0.0:
            enter = ti.max(enter, da / (da - db))
        elif db > 0.0:
            leave = ti.min(leave, da / (da - db))
    result = 0
    if leave > enter:
        result = 1
    return result


@ti.func
def along(a, b, p, q, tolerance):
    """1 when segment a-b runs along segment p-q over more than `tolerance` [m].

    A side of a broken cell with no live cell across it belongs to no interior; a segment along it must be cut too.
    """
    side = q - p
    length = side.norm()
    t = side / length
    da = ti.Vector([t[1], -t[0]]).dot(a - p)
    db = ti.Vector([t[1], -t[0]]).dot(b - p)
    result = 0
    if ti.abs(da) < tolerance and ti.abs(db) < tolerance:
        sa, sb = t.dot(a - p), t.dot(b - p)
        if ti.min(ti.max(sa, sb), length) - ti.max(ti.min(sa, sb), 0.0) > tolerance:
            result = 1
    return result

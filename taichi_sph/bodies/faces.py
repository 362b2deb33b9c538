"""How the faces of a surface (surface.py) are shown to couplings, whatever kind of body they are of."""

from ..runtime import ti

NOWHERE = 1e6  # m, along each axis: where a search does not come by what is not met


@ti.func
def hidden(x):
    """Whether a place is that of a node which is not met: it looks for nothing. Numbers of cubes do not tell, they overflow up there."""
    return x[0] <= -NOWHERE


@ti.func
def lay_face(port: ti.template(), f, whole):
    """Where face f of the port is, by the discs at its corners, and how far it reaches from there: nowhere unless it is whole."""
    corners = port.face_disc[f]
    b = port.disc_body[corners[0]]
    sides = ti.select(corners[3] < 0, 3, 4)
    x = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    for k in range(sides):
        x += port.disc_x[corners[k]] / sides
    reach = ti.cast(-1.0, ti.f64)
    if whole:
        for k in range(sides):
            reach = ti.max(reach, (port.disc_x[corners[k]] - x).norm())
        if reach > port.widest_face[b]:
            ti.atomic_max(port.widest_face[b], reach)
    else:
        x = ti.Vector([NOWHERE, NOWHERE, NOWHERE], ti.f64)
    port.face_x[f], port.face_reach[f] = x, reach

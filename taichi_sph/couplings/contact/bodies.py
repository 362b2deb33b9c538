"""Who takes part in contact: shell nodes, fluid particles and rigid bodies under one numbering.

    0 .. ns-1          shell nodes           one pinball each: a disc that follows the director
    ns .. ns+nf-1      fluid particles       one pinball each: a sphere
    ns+nf .. +nr-1     rigid bodies          several pinballs each: spheres

What a body does not have is None, and nothing is compiled for it. For the solver each participant is an inverse mass
(by component, 0 where its motion is prescribed) and, for a rigid body, an inverse inertia.
"""

import numpy as np

from ... import runtime
from ...bodies.fluid.fill import CONTACT
from ...bodies.nodal.loads import history
from ...bodies.rigid.pool import free_velocity, spin_of, spun
from ...runtime import ti

PINBALL = 0.25  # of D: where contact stands behind the pressure of couplings/wetted/wetted.py


@ti.data_oriented
class Bodies:
    """Pools of the run and their numbers. nodes, cells, loads: of the shell or None; fluid: its particles or None;
    rigids: RigidBodies or None."""

    def __init__(self, mesh, nodes, cells, loads, thickness: float, fluid, rigids, pinballs: bool = False):
        """pinballs: contact alone carries the fluid (T 3.3); else couplings/wetted/wetted.py does, and contact stands behind it."""
        self.nodes, self.cells, self.loads, self.fluid, self.rigids = nodes, cells, loads, fluid, rigids
        self.has_shell, self.has_fluid, self.has_rigids = nodes is not None, fluid is not None, rigids is not None
        self.moves = self.has_shell and loads.moves
        self.pushes = self.has_shell and loads.pushes
        self.ns = nodes.n if self.has_shell else 0
        self.nf = fluid.n if self.has_fluid else 0
        self.nr = rigids.n if self.has_rigids else 0
        self.n = self.ns + self.nf + self.nr
        if self.has_fluid:
            # m: of a particle as such, and against a sound shell, whose missing neighbours it makes up for (docs/method.md)
            self.fluid_radius = runtime.new("contact.fluid_radius", 2, dtype="f64")
            radii = (0.5, CONTACT["pinballs"]) if pinballs else (PINBALL, PINBALL)
            self.fluid_radius[0], self.fluid_radius[1] = radii[0] * fluid.spacing, radii[1] * fluid.spacing
        if self.has_shell:
            self.disc = runtime.new("contact.disc", self.ns, dtype="f64")  # m, radius of the node's disc
            self.half = runtime.new("contact.half", 1, dtype="f64")  # m, half the thickness
            self.sound = runtime.new("contact.sound", self.ns, dtype="i32")  # 1: no lip, no border, no fragment
            self.border = runtime.new("contact.border", self.ns, dtype="i32")  # 1 on the border of the reference
            self.half_thickness = 0.5 * thickness
            self.half[0] = self.half_thickness
            runtime.put(self.disc, 0.5 * mesh.node_spacing)
            border = np.zeros(self.ns, np.int32)
            sides = np.asarray(mesh.edges.sides)
            border[np.unique(mesh.edges.nodes[(sides < 0).any(axis=1)])] = 1
            runtime.put(self.border, border)

    def shape_discs(self) -> None:
        """The discs as the shell lies now."""
        if self.has_shell:
            _discs(self, self.ns)


@ti.func
def place_of_node(bodies: ti.template(), i):
    """Where shell node i is [m], f64."""
    return bodies.nodes.X[i] + ti.cast(bodies.nodes.u[i], ti.f64)


@ti.func
def radius_against(bodies: ti.template(), i):
    """Of a fluid particle that meets shell node i [m]: at a lip its own, so that an opening is as wide as it is."""
    return bodies.fluid_radius[bodies.sound[i]]


@ti.func
def director_of(bodies: ti.template(), i):
    return ti.cast(bodies.nodes.N[i] + bodies.nodes.d[i], ti.f64)


@ti.kernel
def _discs(bodies: ti.template(), n: ti.i32):
    """A sound node's disc reaches half way to the farthest corner of its cells, so that the discs cover the surface
    without a hole; at a lip or border half way to the next node, so that an opening is as wide as it is (T 3.19). A
    node without a live cell, a fragment, keeps the disc it had: a flake that flies and turns on."""
    for i in range(n):
        x = place_of_node(bodies, i)
        near, far = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        alive = 0
        sound = 1 - bodies.border[i]
        for m in range(bodies.cells.start_of_node[i], bodies.cells.start_of_node[i + 1]):
            s = bodies.cells.of_node[m]
            if bodies.cells.broken[s] == 1:
                sound = 0
            else:
                alive += 1
                corners = bodies.cells.n_corners[s]
                for k in range(corners):
                    if bodies.cells.corner[s][k] == i:
                        after = bodies.cells.corner[s][(k + 1) % corners]
                        before = bodies.cells.corner[s][(k + corners - 1) % corners]
                        opposite = bodies.cells.corner[s][(k + 2) % corners]
                        near = ti.max(near, (place_of_node(bodies, after) - x).norm())
                        near = ti.max(near, (place_of_node(bodies, before) - x).norm())
                        far = ti.max(far, (place_of_node(bodies, opposite) - x).norm())
        bodies.sound[i] = sound
        if sound == 1:
            bodies.disc[i] = 0.5 * ti.max(near, far)
        elif alive > 0:
            bodies.disc[i] = 0.5 * near


@ti.func
def inverse_mass(bodies: ti.template(), p):
    """(3,) 1/m of participant p [1/kg], 0 in the components that are prescribed."""
    w = ti.Vector([0.0, 0.0, 0.0], ti.f64)
    if ti.static(bodies.has_shell):
        if p < bodies.ns:
            w += 1.0 / ti.cast(bodies.nodes.mass[p], ti.f64)
            if ti.static(bodies.moves):
                if bodies.nodes.fixed[p] > 0:
                    for c in ti.static(range(3)):
                        if bodies.loads.mask[bodies.nodes.fixed[p] - 1][c] == 1:
                            w[c] = 0.0
    if ti.static(bodies.has_fluid):
        if p >= bodies.ns and p < bodies.ns + bodies.nf:
            w += 1.0 / ti.cast(bodies.fluid.mass[p - bodies.ns], ti.f64)
    if ti.static(bodies.has_rigids):
        if p >= bodies.ns + bodies.nf:
            r = p - bodies.ns - bodies.nf
            w += bodies.rigids.free[r] / bodies.rigids.mass[r]
    return w


@ti.func
def velocity_before(bodies: ti.template(), p, arm):
    """Velocity at the half step before of the point of p that lies `arm` from a rigid body's centre [m/s]."""
    v = arm * 0.0
    if ti.static(bodies.has_shell):
        if p < bodies.ns:
            v = ti.cast(bodies.nodes.v[p], ti.f64)
    if ti.static(bodies.has_fluid):
        if p >= bodies.ns and p < bodies.ns + bodies.nf:
            v = ti.cast(bodies.fluid.v[p - bodies.ns], ti.f64)
    if ti.static(bodies.has_rigids):
        if p >= bodies.ns + bodies.nf:
            r = p - bodies.ns - bodies.nf
            v = bodies.rigids.v[r] + spin_of(bodies.rigids, r).cross(arm)
    return v


@ti.func
def velocity_free(bodies: ti.template(), p, arm, kick, half_time, times):
    """The same at the half step to come, if there were no contact (T 3.17). times: the fluid's kick over that of the others."""
    v = arm * 0.0
    if ti.static(bodies.has_shell):
        if p < bodies.ns:
            force = bodies.nodes.force[p]
            if ti.static(bodies.pushes):
                force += bodies.loads.force.total[p]
            v = ti.cast(bodies.nodes.v[p] + kick / bodies.nodes.mass[p] * force, ti.f64)
            if ti.static(bodies.moves):
                if bodies.nodes.fixed[p] > 0:
                    g = bodies.nodes.fixed[p] - 1
                    for c in ti.static(range(3)):
                        if bodies.loads.mask[g][c] == 1:
                            v[c] = ti.cast(bodies.loads.velocity[g][c] * history(half_time, bodies.loads.rise[g]), ti.f64)
    if ti.static(bodies.has_fluid):
        if p >= bodies.ns and p < bodies.ns + bodies.nf:
            j = p - bodies.ns
            v = ti.cast(bodies.fluid.v[j] + times * kick / bodies.fluid.mass[j] * bodies.fluid.force[j], ti.f64)
    if ti.static(bodies.has_rigids):
        if p >= bodies.ns + bodies.nf:
            r = p - bodies.ns - bodies.nf
            L = bodies.rigids.L[r] + kick * bodies.rigids.torque[r]
            v = free_velocity(bodies.rigids, r, kick) + spun(bodies.rigids, r, bodies.rigids.q[r], L).cross(arm)
    return v


@ti.func
def mobility(bodies: ti.template(), p, arm, normal):
    """Change of the normal speed of that point by a unit impulse along the normal [1/kg]."""
    w = inverse_mass(bodies, p)
    result = (w * normal).dot(normal)
    if ti.static(bodies.has_rigids):
        if p >= bodies.ns + bodies.nf:
            r = p - bodies.ns - bodies.nf
            result += spun(bodies.rigids, r, bodies.rigids.q[r], arm.cross(normal)).cross(arm).dot(normal)
    return result

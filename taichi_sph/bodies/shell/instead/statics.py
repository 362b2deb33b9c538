"""Equilibrium by dynamic relaxation: the same forces, fictitious masses, and damping near the critical one.

    v <- ((1 - c dt/2) v + dt M^-1 f) / (1 + c dt/2),   u <- u + dt v           (Papadrakakis 1981)
    c  = 2 omega_0,   omega_0^2 = -sum du . df / sum du . M du                  Rayleigh quotient of the last move

M is diagonal in the frame of the director: across the shell a node weighs G_s / K of its mass along it, so that
bending, slow in a thin shell, moves at the pace of the membrane. The residual is the norm of the unbalanced
forces (couples over D) of the free components over that of the applied load.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .... import runtime
from ....errors import RunStopped
from ....pool import Pool
from ....runtime import ti
from ....scene.instead import COARSE, LARGEST, Static
from ....scene.plausible import follows
from ...nodal.loads import undrilled
from ...nodal.nodes import body_of
from ..build import by_node
from ..pressure import LEAVE
from ..stable_dt import largest_frequencies
from .freedom import Stiffness
from .newton import FARTHEST, Direction, Loads, Lost, Path, State, turn_per_cell

if TYPE_CHECKING:
    from ...body import Clocked
    from ..group import ShellGroup

LOOK = 25  # steps between two looks at residual and damping
ROOM = 1000  # factorisations of an increment


class Statics:
    """Brings all shells to equilibrium, increment by increment of the loads; they do not act on each other."""

    units = {"turn_per_cell": "rad"}

    def __init__(self, world: "Clocked", groups: "Sequence[ShellGroup]", static: Static):
        self.increments, self.static = static.increments, static
        self.relaxations = [Relaxation(world, group, static) for group in groups]

    def pools(self) -> list[Pool]:
        """All that has history."""
        return list(self.relaxations)

    def settle(self, time: float) -> None:
        """Equilibrium under the loads at pseudo-time `time`."""
        for relaxation in self.relaxations:
            relaxation.settle(time)

    @property
    def work(self) -> float:
        """Of the loads [J]."""
        return sum(relaxation.work for relaxation in self.relaxations)

    @property
    def steps(self) -> int:
        """Of relaxation, all together."""
        return sum(relaxation.steps for relaxation in self.relaxations)

    @property
    def rule(self) -> str:
        return f"{self.increments} {'steps along the path' if self.static.method == 'arc' else 'equal load increments'}"

    def status(self) -> dict[str, float]:
        """load: the part of the whole load that is borne; path_points: equilibria that were reached along the length of the path;
        turn_per_cell: by how much directors of neighbours have turned apart; unstable: how many groups stand where the least push would
        move them on."""
        many = self.relaxations
        return {
            "relaxation_steps": self.steps,
            "newton_steps": sum(one.iterations for one in many),
            "path_points": sum(one.points for one in many),
            "residual": float(max(one.residual.max() for one in many)),
            "load": min(one.level for one in many),
            "turn_per_cell": max(turn_per_cell(one.group) for one in many),
            "unstable": sum(int(one.unstable) for one in many),
        }


class Relaxation(Pool):
    """Brings a group to equilibrium under the loads of a pseudo-time. Each body has its own step, damping and residual, so that it
    moves as if it were alone."""

    kept = (
        *("steps", "iterations", "points", "load", "residual", "work", "u", "force", "director", "moment", "pressure"),
        *("level", "unstable", "onward", "onward_load", "length", "longest"),
    )

    def __init__(self, world: "Clocked", group: "ShellGroup", static: Static):
        super().__init__(f"relax{group.suffix}")
        self.world, self.group, self.tolerance, self.max_steps = world, group, static.residual, static.max_steps
        self.tangent: Stiffness | None = None
        if static.method in ("newton", "arc") or (static.method is None and group.nodes.n <= LARGEST):
            self.tangent = group.stiffness()
        # "both": Newton's method, with relaxation to fall back on
        self.method, self.increments = static.method or ("both" if self.tangent is not None else "relaxation"), static.increments
        nodes, n, dim = group.nodes, group.nodes.n, group.nodes.dim
        self.ratio = self.field("ratio", n, doc="weight across the shell over weight along it", keeps=True)
        self.before = self.field("before", n, dim, unit="N", doc="force of the step before")
        self.sums = self.field("sums", n, 3, doc="-du . df [J], du . M du, |f|^2 [N2]")
        bodies = len(group.shells)
        self.total = self.field("total", bodies, 3, "f64", doc="their sums over a body")
        self.dt = self.field("dt", bodies, unit="s", doc="step of a body")
        self.damping = self.field("damping", bodies, unit="1/s", doc="c of a body")
        self.spacing = self.field("spacing", bodies, unit="m", doc="of a body")
        if nodes.bends:
            self.before_couple = self.field("before_couple", n, 3, unit="N m", doc="couple of the step before")
            shear = runtime.get(group.points.shear, group.points.n)
            constants = zip(*(group.material.numbers(key) for key in ("young", "thickness", "poisson")))
            stiff = [young * e / (1.0 - nu**2) for young, e, nu in constants]
            firsts = [body.first_sheet for body in group.shells]
            stiffest = [max(stiff[k : k + len(body.made.sheets)]) for k, body in zip(firsts, group.shells)]
            ratios = [min(1.0, shear[body.points.rows].mean() / K) for body, K in zip(group.shells, stiffest)]
            runtime.put(self.ratio, by_node(group.shells, ratios))
        else:
            runtime.put(self.ratio, np.ones(nodes.n))
        frequencies, _ = largest_frequencies(group, 40, across=runtime.get(self.ratio, n).astype(np.float64))
        self._steps = 0.95 * 2.0 / frequencies
        runtime.put(self.dt, self._steps)
        runtime.put(self.spacing, np.array([body.mesh.spacing for body in group.shells]))
        self.load = np.zeros(bodies)  # norm of the applied load
        self.residual = np.zeros(bodies)
        self.steps, self.iterations, self.points = 0, 0, 0
        self.level, self.unstable = 0.0, False
        self.work = 0.0  # J, of the loads: trapezoidal over the increments, which start from no load
        # of the increment before: displacements [m], forces [N], directors, moments [N m]; those at rest before the first
        self.u, self.force = np.zeros((n, dim)), np.zeros((n, dim))
        self.director = runtime.get(nodes.N, n) if nodes.bends else np.zeros((n, 3))
        self.moment = np.zeros((n, 3))
        self.pressure = np.zeros(0 if group.pressures is None else len(group.pressures.pressed))
        # of a path that is followed: its direction now, and the next step along it
        self.onward, self.onward_load = np.zeros((n, dim + 3 if nodes.bends else dim)), 0.0
        self.length, self.longest = 0.0, 0.0

    def renew(self) -> None:
        """The loads follow from the time, or from the level that a path has reached."""
        self.group.loads.update(self.world.time)
        if self.method == "arc":
            loads = self.group.loads
            given = [*([self.force] if loads.pushes else []), *([self.moment] if loads.twists else [])]
            for load, values in zip(loads.given(), given):
                runtime.put(load.total, values)

    def settle(self, time: float) -> None:
        """Equilibrium under the loads at pseudo-time `time`, or one step along the path; RunStopped when it does not come."""
        duration = self.group.scene.duration
        if self.method == "arc":
            self._follow(duration)
            return
        self.group.loads.update(time)
        if self.method == "relaxation" or not self._climb(time):
            self._settle(time)
            self._reached(self._pressures(time))
            self.unstable = False
        self.level = time / duration

    def _pressures(self, time: float) -> np.ndarray:
        """Each pressure at that time [Pa]."""
        pressures = self.group.pressures
        return np.array([one.now(time) for one in pressures.pressed]) if pressures is not None else np.zeros(0)

    def _reached(self, pressure: np.ndarray) -> None:
        """An equilibrium: the work since the one before."""
        if self.group.pressures is not None:
            self.group.pressures.press_with(pressure)
            self.pressure = pressure
        if self.group.loads.moves:
            self.group.loads.supports.balance(self.group.nodes, self.group.loads)
        self._book()

    def _path(self, before: tuple, time: float) -> Path:
        """From the loads `before` (forces, moments, pressures) to those of a time."""
        group, n = self.group, self.group.nodes.n
        loads = group.loads
        loads.set(time)
        pairs = [
            (before[0], runtime.get(loads.force.total, n).astype(np.float64)) if loads.pushes else None,
            (before[1], runtime.get(loads.moment.total, n).astype(np.float64)) if loads.twists else None,
            (before[2], self._pressures(time)) if group.pressures is not None else None,
        ]
        assert self.tangent is not None
        return Path(group, self.tangent, Loads(*pairs), self.load, ROOM, self.method == "both")

    def _climb(self, time: float) -> bool:
        """Newton's method to the loads of a time; False where relaxation has to take over, from the last equilibrium it found."""
        path = self._path((self.force, self.moment, self.pressure), time)
        start = path.here()
        self.load = np.maximum(self.load, path.weigh(replace(start, s=1.0)))
        path.tolerance, path.unstable = self.tolerance * self.load, self.unstable
        unstable = self.unstable
        sure, books = [start], [self._booked()]  # the last equilibrium that a step of load found

        def reached(state: State) -> None:
            path.put(state)
            self._reached(Loads.between(path.loads.pressures, state.s))
            if path.points == 0:
                sure.append(state)
                books.append(self._booked())

        try:
            path.climb(start, reached)
            found = True
        except Lost:
            found = False
        self._count(path)
        if found:
            return True
        state = sure[-1]
        self.unstable = unstable
        self.work, self.u, self.force, self.director, self.moment, self.pressure = books[-1]
        coarse = _coarse(turn_per_cell(self.group, state.d))
        if self.method == "both" and not coarse:
            path.put(replace(state, s=1.0))
            return False
        worst = self._worst()
        self.residual = path.weigh(state) / np.maximum(self.load, 1e-300)
        self.level += state.s * (time / self.group.scene.duration - self.level)
        raise RunStopped(
            f"shell '{worst}': Newton's method found no equilibrium beyond {self.level:.4g} of the load{coarse};"
            " static.method = 'arc' follows the path over a limit point, 'relaxation' goes where the shell would settle",
            goes_on=True,
        )

    def _booked(self) -> tuple:
        """What `_book` goes on from."""
        return self.work, self.u, self.force, self.director, self.moment, self.pressure

    def _follow(self, duration: float) -> None:
        """One step along the path of loads in proportion; where all of them are borne, the path has ended."""
        if self.level >= 1.0:
            return
        n, dim = self.group.nodes.n, self.group.nodes.dim
        path = self._path((np.zeros((n, dim)), np.zeros((n, 3)), np.zeros(len(self.pressure))), duration)
        start = replace(path.here(), s=self.level)
        self.load = np.maximum(self.load, path.weigh(State(0.0 * start.u, 0.0 * start.d, 1.0, start.stresses)))
        path.tolerance = self.tolerance * self.load
        direction = Direction(self.onward, self.onward_load)
        try:
            if self.length == 0.0:
                direction = path.direction(start, None)
                self.length = 1.0 / (self.increments * direction.load)
                self.longest = FARTHEST * self.length
            state, onward, length = path.step(start, direction, self.length)
            self.length = min(length, self.longest)
        except Lost:
            path.put(start)
            self._count(path)
            coarse = _coarse(turn_per_cell(self.group, start.d))
            raise RunStopped(
                f"shell '{self._worst()}': the path cannot be followed beyond {self.level:.4g} of the load{coarse}; it may branch there:"
                " use more static.increments, or static.method = 'relaxation'",
                goes_on=True,
            ) from None
        self.onward, self.onward_load, self.level = onward.moves, onward.load, state.s
        path.put(state)
        self._reached(Loads.between(path.loads.pressures, state.s))
        self._count(path)

    def _count(self, path: Path) -> None:
        self.iterations += path.iterations
        self.points += path.points
        self.world.step += path.iterations
        self.residual = path.residual / np.maximum(self.load, 1e-300)
        self.unstable = path.unstable

    def _book(self) -> None:
        """External work of the increment that has just been settled."""
        group = self.group
        nodes, loads, n = group.nodes, group.loads, group.nodes.n
        u = runtime.get(nodes.u, n).astype(np.float64)
        force = runtime.get(loads.force.total, n).astype(np.float64) if loads.pushes else np.zeros_like(u)
        self.work += 0.5 * float(np.sum((force + self.force) * (u - self.u)))
        if nodes.bends:
            director = runtime.get(nodes.N, n) + runtime.get(nodes.d, n)
            if loads.twists:
                moment = runtime.get(loads.moment.total, n).astype(np.float64)
                axis = np.cross(self.director, director)  # the turn from one director to the next, as a vector
                sine = np.linalg.norm(axis, axis=1)
                angle = np.arctan2(sine, np.einsum("ni,ni->n", self.director, director))
                turn = axis * (angle / np.maximum(sine, 1e-300))[:, None]
                self.work += 0.5 * float(np.sum((moment + self.moment) * turn))
                self.moment = moment
            self.director = director
        self.u, self.force = u, force

    def _keep(self) -> None:
        nodes = self.group.nodes
        self._start = [(f, runtime.get(f, nodes.n)) for f in ([nodes.u, nodes.d] if nodes.bends else [nodes.u])]

    def _again(self) -> bool:
        """Back to the start of the increment with nodes four times heavier across the shell; False when they weigh
        the same in all directions already. A surface that curves in turns its membrane across itself."""
        n = self.group.nodes.n
        ratio = runtime.get(self.ratio, n)
        if ratio.min() >= 1.0:
            return False
        runtime.put(self.ratio, np.minimum(4.0 * ratio, 1.0))
        self._back()
        return True

    def _back(self) -> None:
        """To where the relaxation began."""
        for field, values in self._start:
            runtime.put(field, values)

    def _settle(self, time: float) -> None:
        group = self.group
        self._keep()
        self._rest()
        for k in range(self.max_steps):
            group.internal.strain(0.0)
            if group.pressures is not None:
                group.pressures.press(time, LEAVE)
            group.internal.force()
            _relax(self, group.nodes, group.loads, group.nodes.n)
            self.steps += 1
            self.world.step += 1
            self._since += 1
            if self._since % LOOK == 0 or self._since == 1:
                if self._look():
                    return
                if not (self.residual < 1e3).all():
                    if not self._again():
                        self._back()
                        raise RunStopped(
                            f"shell '{self._worst()}': the relaxation diverged after {k} steps at load {time:g}; the"
                            " load is likely beyond a limit point: use more static.increments, or static.method = 'arc'",
                            goes_on=True,
                        )
                    self._rest()
        path = "follow the path with static.method = 'arc', or " if follows(self.group.scene) else ""
        raise RunStopped(
            f"shell '{self._worst()}': no equilibrium at load {time:g} after {self.max_steps} steps; the residual is"
            f" {self.residual.max():.3g}, wanted {self.tolerance:g}: {path}raise static.max_steps or static.residual",
            goes_on=True,
        )

    def _rest(self) -> None:
        """Start from rest."""
        nodes = self.group.nodes
        runtime.fill(nodes.v, 0.0)
        if nodes.bends:
            runtime.fill(nodes.omega, 0.0)
        runtime.fill(self.damping, 0.0)
        self._since = 0

    def _worst(self) -> str:
        """Name of the body that is farthest from equilibrium, or of the first whose residual is no number."""
        return self.group.shells[int(np.argmax(np.where(np.isfinite(self.residual), self.residual, np.inf)))].name

    def _look(self) -> bool:
        """Residuals and dampings of the moment; True at equilibrium of all bodies."""
        _sum(self, self.group.nodes, self.group.nodes.n, len(self.group.shells))
        damping = []
        for b, (work, weight, force2) in enumerate(runtime.get(self.total, len(self.group.shells))):
            norm = float(np.sqrt(force2))
            if self._since == 1:
                self.load[b] = max(self.load[b], norm)
            else:
                damping.append(min(2.0 * np.sqrt(max(work / max(weight, 1e-300), 0.0)), 1.0 / self._steps[b]))
            self.residual[b] = norm / max(self.load[b], 1e-300)
        if damping:
            runtime.put(self.damping, np.array(damping))
        return self._since > 1 and bool((self.residual < self.tolerance).all())


def _coarse(turn: float) -> str:
    """A remark where cells are too coarse for what the shell turns [rad]: the path of the equations turns back there, not that of the
    shell."""
    if turn < COARSE:
        return ""
    angle = np.degrees(turn)
    return f", where neighbours have turned apart by {angle:.0f} degrees: take a finer spacing, or spread the load over more rows of nodes"


@ti.kernel
def _relax(relax: ti.template(), nodes: ti.template(), loads: ti.template(), n: ti.i32):
    for i in range(n):
        b = body_of(nodes, i)
        dt, c, spacing = relax.dt[b], relax.damping[b], relax.spacing[b]
        slow, quick = 1.0 - 0.5 * c * dt, 1.0 / (1.0 + 0.5 * c * dt)
        force = nodes.force[i]
        couple = force
        if ti.static(loads.pushes):
            force += loads.force.total[i]
        director = force
        if ti.static(nodes.bends):
            director = nodes.N[i] + nodes.d[i]
            couple = director.cross(nodes.couple[i])
            if ti.static(loads.twists):
                couple += loads.moment.total[i] - loads.moment.total[i].dot(director) * director
        if ti.static(loads.moves):
            if nodes.fixed[i] > 0:
                g = nodes.fixed[i] - 1
                for k in ti.static(range(nodes.dim)):
                    if loads.mask[g][k] == 1:
                        force[k] = 0.0
                if ti.static(nodes.bends):
                    for k in ti.static(range(3)):
                        if loads.spin_mask[g][k] == 1:
                            couple[k] = 0.0
                    couple = undrilled(loads, g, director, couple)
        push = force / nodes.mass[i]
        if ti.static(nodes.bends):
            push += (1.0 / relax.ratio[i] - 1.0) * push.dot(director) * director
            if ti.static(loads.moves):
                if nodes.fixed[i] > 0:
                    for k in ti.static(range(3)):
                        if loads.mask[nodes.fixed[i] - 1][k] == 1:
                            push[k] = 0.0
        # the last move led from the force before to this one; the next move would turn the sign of what is quick
        v = nodes.v[i]
        weight = nodes.mass[i] * v.dot(v)
        if ti.static(nodes.bends):
            weight += nodes.mass[i] * (relax.ratio[i] - 1.0) * v.dot(director) ** 2
        work = -v.dot(force - relax.before[i]) / dt
        v = (slow * v + dt * push) * quick
        norm = force.dot(force)
        relax.before[i] = force
        nodes.v[i] = v
        nodes.u[i] += dt * v
        if ti.static(nodes.bends):
            omega = nodes.omega[i]
            weight += nodes.inertia[i] * omega.dot(omega)
            work -= omega.dot(couple - relax.before_couple[i]) / dt
            omega = (slow * omega + dt / nodes.inertia[i] * couple) * quick
            norm += couple.dot(couple) / (spacing * spacing)
            relax.before_couple[i] = couple
            theta = dt * omega
            angle = ti.max(theta.norm(), 1e-30)
            turned = theta.cross(director)
            d = nodes.d[i] + ti.sin(angle) / angle * turned
            d += 2.0 * (ti.sin(0.5 * angle) / angle) ** 2 * theta.cross(turned)
            m = nodes.N[i] + d
            nodes.d[i] = d + 0.5 * (1.0 - m.dot(m)) * m
            nodes.omega[i] = omega
        relax.sums[i] = ti.Vector([work, weight, norm])


@ti.kernel
def _sum(relax: ti.template(), nodes: ti.template(), n: ti.i32, bodies: ti.i32):
    ti.loop_config(serialize=True)  # the order of the sum decides the damping: one thread
    for _ in range(1):
        for b in range(bodies):
            relax.total[b] *= 0.0
        for i in range(n):
            relax.total[body_of(nodes, i)] += ti.cast(relax.sums[i], ti.f64)

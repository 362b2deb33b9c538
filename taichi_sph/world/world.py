"""A running scene: groups of bodies, the couplings between them, and time."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from .. import launch, runtime
from ..bodies import kinds as body_kinds
from ..bodies.body import Entries, Now, common_schedule, holding
from ..couplings import kinds as coupling_kinds
from ..errors import RunStopped, SceneError
from ..frame import Frame
from ..observers.leak import UNITS, gauges
from ..pool import Pool, restore_all, state_of
from ..scene import Probe, Scene, StrainGauge
from . import growth, watchdog
from .ledger import balance, summed
from .step import step


class Clock(Pool):
    """time [s], step; dt, dt_before: the step to come and the one before [s]; injected: energy at t = 0 [J].

    refit: dt must become shorter. It does at the next step at which all groups are due.
    """

    kept = ("time", "step", "dt", "dt_before", "refit", "injected")

    def __init__(self) -> None:
        super().__init__("clock")
        self.time, self.step, self.dt, self.dt_before = 0.0, 0, 0.0, 0.0
        self.refit, self.injected = False, 0.0


class World:
    """Starts Taichi, builds the scene, and advances it.

    time [s], step, dt [s] of its clock, and `dt_rule` (what sets dt); groups and couplings; bytes of fields; compile_seconds until the
    first step could run, and of the kernels that are met on the way.
    """

    def __init__(self, scene: Scene, arch: str = "cpu", threads: int | None = None):
        self._how = arch, scene.numerics.precision, threads
        self.stepping = 0.0  # s of wall clock in steps, without what compiles
        began = clock.perf_counter()
        self.build(scene)
        self.compile_seconds = clock.perf_counter() - began
        self.compile_processor = 0.0  # s of all threads, for what is met on the way

    def build(self, scene: Scene) -> None:
        """All bodies of a scene at t = 0. What was there before is lost."""
        runtime.start(*self._how)
        self.scene = scene
        self.clock = Clock()
        self._booked: dict[str, float] | None = None  # what the last look has summed up, until it is asked for
        self.groups: list[Any] = []
        for kind in body_kinds():
            self.groups += kind.make(scene, self.groups)
        self.couplings = [made for kind in coupling_kinds() for made in kind.make(scene, self.groups)]
        self.every = common_schedule(self.groups)
        self.leaks = gauges(scene, self.groups)
        self._probed = [(p, *self._followed(p)) for p in scene.output.probes]
        timed = scene.modes is None and scene.limit is None
        self.given_at_start: dict[str, float] = {}  # J, entries of the ledger at t = 0 that the first step tells
        self.strain_gauges = [self._glued(gauge) for gauge in (scene.output.gauges if timed else ())]
        for one in (*self.groups, *self.couplings):
            one.start()
        self.grown = growth.Grown(growth.names_of(self)) if growth.grows(scene) else None
        self._fit_dt()
        for coupling in self.couplings:
            coupling.foresee(Now(dt=self.dt))
        if self.grown is not None and (wanted := self._wanted()):  # a striker stands before elements
            self.build(growth.widened(scene, wanted))
            return
        self.instead = self._instead()
        if self.instead is not None:
            self.dt = scene.duration / scene.increments
        for group in self.groups:
            group.strain(Now())  # so that the first step finds its kernels ready
        runtime.ti.sync()

    def _followed(self, probe: Probe) -> tuple[Any, int]:
        """The group and the number in it of what a probe follows; of a body in parts the nearest one."""
        parts = [(group, span.name) for group in self.groups for span in group.bodies if self.scene.body(span.name).name == probe.body]
        found = [(group, group.probed(probe.point, name)) for group, name in parts]
        if len(found) == 1:
            return found[0]
        return min(found, key=lambda one: float(np.linalg.norm(one[0].mesh.points[one[1]] - np.asarray(probe.point))))

    def _glued(self, said: StrainGauge) -> Any:
        """A strain gauge on its shell; of one in parts on the nearest."""
        spans = [(group, span.name) for group in self.groups for span in group.bodies]
        parts = [(group, name) for group, name in spans if self.scene.body(name).name == said.body]
        found = min((group.gauge(said, name) for group, name in parts), key=lambda gauge: gauge.away)
        if not found.flat:
            raise SceneError(f"gauge '{said.name}': along {said.along} points out of the shell '{said.body}'; it must lie in its surface")
        return found

    def _instead(self) -> Any:
        """What is done in place of motion (bodies.body.InPlace); None where bodies move."""
        for kind in dict.fromkeys(group.kind for group in self.groups):
            alike = [group for group in self.groups if group.kind == kind]
            if (found := alike[0].instead(self, alike)) is not None:
                return found
        return None

    @property
    def time(self) -> float:
        return self.clock.time

    @time.setter
    def time(self, value: float) -> None:
        self.clock.time = value

    @property
    def step(self) -> int:
        return self.clock.step

    @step.setter
    def step(self, value: int) -> None:
        self.clock.step = value

    @property
    def dt(self) -> float:
        return self.clock.dt

    @dt.setter
    def dt(self, value: float) -> None:
        self.clock.dt = value

    def _only(self, kind: str) -> Any:
        """The group of that kind; None where there is none."""
        found = [group for group in self.groups if group.kind == kind]
        if len(found) > 1:
            raise ValueError(f"there are {len(found)} groups of kind '{kind}': say which")
        return found[0] if found else None

    def group_of(self, name: str) -> Any:
        """The group of the body of that name."""
        return holding(self.groups, name)[0]

    @property
    def shell(self) -> Any:
        """The only group of shells; None where there is none."""
        return self._only("shell")

    @property
    def rigids(self) -> Any:
        """The pool of rigid bodies; None where there is none."""
        group = self._only("rigid")
        return None if group is None else group.rigids

    @property
    def fluid(self) -> Any:
        """The only fluid; None where there is none."""
        group = self._only("fluid")
        return None if group is None else group.body

    @property
    def leak(self) -> Any:
        """The only gauge of leaks; None where there is none."""
        return self.leaks[0] if len(self.leaks) == 1 else None

    @property
    def contact(self) -> Any:
        """The solver of contact; None where nothing can meet."""
        return next((c.contact for c in self.couplings if hasattr(c, "contact")), None)

    def _fit_dt(self) -> None:
        """The stable step, shortened so that a whole number of steps ends the run."""
        left = self.scene.duration - self.time
        longest = self.longest
        self.dt = left / self._whole(max(1, math.ceil(left / longest * (1 - 1e-12)))) if left > 0 else longest
        self.clock.refit = False

    def _whole(self, steps: int) -> int:
        """So many steps, or a few more: all groups are due after them."""
        return math.ceil(steps / self.every) * self.every

    def _steps(self) -> dict[str, float]:
        """The longest step of the clock by each group, by what rules it [s]."""
        own = _shortest(group.longest_step() for group in self.groups)
        steps = own or _shortest(group.alone() for group in self.groups) or {"a hundredth of the duration": self.scene.duration / 100}
        ruling = min(steps, key=steps.__getitem__)
        of_bodies = steps[ruling]
        for coupling in self.couplings:
            for rule, longest in coupling.longest_step().items():
                # it makes stiffer what it acts on: squares of frequencies add up
                key = ruling if own and longest > of_bodies else rule
                steps[key] = min(steps.get(key, math.inf), (longest**-2 + of_bodies**-2) ** -0.5)
        return steps

    @property
    def longest(self) -> float:
        """The longest step that is stable [s]."""
        return min(self._steps().values())

    @property
    def dt_rule(self) -> str:
        """What rules dt, in words."""
        if self.instead is not None:
            return self.instead.rule
        steps = self._steps()
        return min(steps, key=steps.__getitem__)

    @property
    def n_nodes(self) -> int:
        """Nodes and particles."""
        return sum(group.n_nodes for group in self.groups)

    @property
    def stress_points(self) -> int:
        return sum(group.stress_points for group in self.groups)

    @property
    def bytes(self) -> int:
        return runtime.current().bytes

    @property
    def steps_left(self) -> int:
        return max(0, round((self.scene.duration - self.time) / self.dt))

    def take(self, dt_before: float, dt: float) -> None:
        """One step of the bodies; the clock stays."""
        self._booked = None
        step(self.groups, self.couplings, Now(self.time, self.step, dt_before, dt))

    def advance(self, steps: int) -> None:
        """That many steps; RunStopped when the watchdog sees nonsense at the end of them.

        Of a static scene: that many load increments, each brought to equilibrium.
        """
        if self.instead is not None:
            for _ in range(steps):
                before, self.time = self.time, self.time + self.dt
                try:
                    self.instead.settle(self.time)
                except RunStopped:
                    self.time = before  # the increment is not done
                    raise
            return
        began, compiled, worked = launch.working(), launch.Spent.seconds, launch.Spent.processor
        for _ in range(steps):
            self.take(self.clock.dt_before, self.dt)
            if self.step == 0:
                # the kinetic energy that the scheme conserves, 1/2 m v_-1/2 . v_+1/2: for a step load it starts
                # below 1/2 m v_0^2 by 1/8 m (dt a_0)^2 and stays there
                kinetic = sum(group.entries().kinetic for group in self.groups)
                self.clock.injected = kinetic + sum(one.given() for one in (*self.groups, *self.couplings))
                self.given_at_start = {"kinetic": kinetic, "injected": self.clock.injected}
            self.clock.dt_before = self.dt
            self.time += self.dt
            self.step += 1
            now = Now(self.time, self.step, self.dt, self.dt)
            self.clock.refit |= any([group.hastens(now) for group in self.groups])
            if self.grown is not None and self.step % self.every == 0 and (wanted := self._wanted()):
                growth.grow(self, wanted)
            if self.clock.refit and self.step % self.every == 0:
                self._fit_dt()
        self.compile_seconds += launch.Spent.seconds - compiled
        self.compile_processor += launch.Spent.processor - worked
        self.stepping += launch.working() - began
        self.look()

    def _wanted(self) -> dict[str, tuple[int, ...]]:
        """Elements that patches must hold from now on."""
        return {one.name: one.wanted for one in self.couplings if getattr(one, "wanted", ())}

    def entries(self) -> Entries:
        """Of all groups and couplings, and what was booked of patches that grew."""
        found = summed(self.groups, self.couplings)
        if self.grown is not None:
            self.grown.add_to(found)
        return found

    def look(self) -> None:
        """RunStopped when something cannot be true any more. A sample is often due after it: its sums are kept for that."""
        names = [body.name for group in self.groups for body in group.bodies]
        nothing = sum(group.negligible(self.dt) for group in self.groups)
        booked = self.energies()
        watchdog.look(self.groups, names, booked, Now(self.time, self.step), nothing)
        self._booked = booked

    def advance_to(self, time: float) -> None:
        """Whole steps until `time` is reached, but for the rounding of their sum, or passed."""
        while (steps := math.ceil((time - self.time) / self.dt - 0.5e-6)) > 0:
            self.advance(self._whole(self.step + steps) - self.step)  # dt may become shorter on the way

    def energies(self) -> dict[str, float]:
        """The ledger [J] at the time of the last force evaluation, `time` [s] among them."""
        if self._booked is not None:
            booked, self._booked = self._booked, None
            return booked
        found = self.entries()
        if self.instead is not None:  # nothing moves; the loads do their work from increment to increment
            found.kinetic = 0.0
            found.external = self.instead.work + sum(group.pressed() for group in self.groups)
        told = {"time": self.time - self.clock.dt_before, **balance(found, self.clock.injected)}
        if self.step == 0:  # nothing was given yet, and what rounding leaves is no error
            told |= {"B_percent": 0.0, "closed_residual_percent": 0.0}
        return told

    def status(self) -> dict[str, int]:
        """Small numbers for the progress line: the sum of all, and of percentages the largest."""
        if self.instead is not None:
            return self.instead.status()
        numbers: dict[str, int] = {}
        for one in (*self.groups, *self.couplings):
            for name, value in one.status().items():
                before = numbers.get(name, 0)
                numbers[name] = max(before, value) if name.startswith("%") else before + value
        return numbers

    @property
    def status_units(self) -> dict[str, str]:
        """Units of the entries of `status` that have one."""
        return getattr(self.instead, "units", {})

    def probes(self) -> dict[str, dict[str, float]]:
        """Displacement [m] and velocity [m/s] at the probes of the scene."""
        return {probe.name: group.probe(i) for probe, group, i in self._probed}

    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]:
        """By the name of its history: what is followed of each rigid body (bodies.rigid.group), and the leak (observers.leak), looked at
        now or as it was at the last look."""
        if look:
            for leak in self.leaks:
                leak.look(self.time)
        found = {leak.name: leak.row for leak in self.leaks} | {gauge.name: gauge.read() for gauge in self.strain_gauges}
        for group in self.groups:
            found |= group.tracks(look)
        return found

    def track_units(self) -> dict[str, dict[str, str]]:
        """Units of the columns of each history in `tracks`."""
        found = {leak.name: UNITS for leak in self.leaks} | {gauge.name: gauge.units for gauge in self.strain_gauges}
        for group in self.groups:
            found |= {name: {c: group.track_units[c] for c in row} for name, row in group.tracks(look=False).items()}
        return found

    def contact_report(self) -> dict[str, float] | None:
        """How contact was solved, and its share of the steps of this session; None where there is none."""
        report = None if self.contact is None else self.contact.report()
        return report and report | {"share": report["seconds"] / max(self.stepping, 1e-300)}

    def overlap_report(self) -> dict[str, float] | None:
        """How elements and particles were tied, and its share of the steps of this session: the worst of all shells in parts; None where
        there is none."""
        ties = [coupling for coupling in self.couplings if hasattr(coupling, "tie")]
        if not ties:
            return None
        found = [tie.report() for tie in ties]
        worst = {key: max(one[key] for one in found) for key in found[0]}
        grown = {} if self.grown is None else {"growths": self.grown.events}
        return worst | {"share": sum(tie.seconds for tie in ties) / max(self.stepping, 1e-300)} | grown

    def frame(self) -> Frame:
        """All bodies now."""
        bodies = [body for group in self.groups for body in group.frames()]
        shown = {leak.span.name: leak.shows() for leak in self.leaks}
        bodies = [replace(body, point_data=body.point_data | shown.get(body.name, {})) for body in bodies]
        return Frame(self.time, self.step, tuple(bodies))

    @property
    def pools(self) -> list[Pool]:
        """All that has fields or history."""
        parts = [*self.groups, *self.couplings, *([self.instead] if self.instead is not None else [])]
        grown = [] if self.grown is None else [self.grown]
        return [self.clock, *(pool for part in parts for pool in part.pools()), *self.leaks, *grown]

    @property
    def unset(self) -> frozenset[str]:
        """Last parts of names in `state`: what may be no finite number, for it has not happened yet."""
        return frozenset(name for pool in self.pools for name in pool.unset)

    def state(self) -> dict[str, np.ndarray]:
        """All that is history, for a checkpoint."""
        return state_of(self.pools) | growth.patches(self.scene)

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Continue exactly from `state()`; SceneError, and nothing is touched, where it does not fit."""
        self._booked = None
        if self.grown is not None and (scene := growth.as_in(self.scene, state)) is not None:
            self.build(scene)
        restore_all(self.pools, state)


def _shortest(said: Iterable[dict[str, float]]) -> dict[str, float]:
    """Of steps by what rules them [s] the shortest of each rule."""
    steps: dict[str, float] = {}
    for one in said:
        for rule, longest in one.items():
            steps[rule] = min(longest, steps.get(rule, math.inf))
    return steps

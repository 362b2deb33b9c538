"""One run from scene to answer: plan, compute, write, tell. And its continuation after an interrupt.

Events (samples, frames, checkpoints) are due at even times; at the first whole step at or past its time each
is done once. What was done by a time follows from that time alone, so a resumed run goes on exactly
where the checkpoint stands: later frames and rows of histories are dropped first, then made again.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import threading
import time as clock
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Protocol

from ..errors import RunInterrupted, RunStopped, SceneError, nearest
from ..output import files
from ..output.lock import locked
from ..scene import Scene, dump, load_scene
from ..scene.units import show
from . import speed
from .draw import draw
from .gate import LOG_FILE, SCENE_FILE, STOPPED, SUMMARY_FILE, check_out, checked_plan, default_out
from .plan import Made, Plan
from .progress import Pace, Progress, progress_line
from .tell import contact_text, overlap_text, tell_plan

RESUMED = ("static.method", "static.residual", "static.max_steps")  # what a resumed search for equilibrium may change
NEXT_FILE = "scene.next.json"  # while a resumed run changes to another scene
LONGER = ("duration", "until", "until.share", "output.frames", "output.samples", "output.checkpoints")  # the same of a run in time
BEAT = 0.5  # s of wall clock between looks at the clock, the keyboard and the screen
FEW_STEPS = 100  # below, the rate of a run says how long it took to start


class WorldLike(Protocol):
    """What the run needs of world.world.World (tests use a small stand-in)."""

    @property
    def time(self) -> float: ...
    @property
    def step(self) -> int: ...
    @property
    def dt(self) -> float: ...
    @property
    def dt_rule(self) -> str: ...
    @property
    def n_nodes(self) -> int: ...
    @property
    def stress_points(self) -> int: ...
    @property
    def bytes(self) -> int: ...
    @property
    def compile_seconds(self) -> float: ...
    @property
    def compile_processor(self) -> float: ...
    @property
    def unset(self) -> Collection[str]: ...  # last parts of the names of what may hold a NaN or an infinity in `state`

    def advance_to(self, time: float) -> None: ...
    def probes(self) -> dict[str, dict[str, float]]: ...
    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]: ...
    def track_units(self) -> dict[str, dict[str, str]]: ...
    def contact_report(self) -> dict[str, float] | None: ...

    def overlap_report(self) -> dict[str, float] | None: ...
    def frame(self) -> Any: ...
    def energies(self) -> dict[str, float]: ...
    def status(self) -> dict[str, Any]: ...
    def state(self) -> dict[str, Any]: ...
    def restore(self, state: dict[str, Any]) -> None: ...


@dataclass
class Every:
    """`count` even instants over `duration`; `following` is the number of the next one."""

    count: int
    duration: float
    following: int = 0

    def at(self, number: int) -> float:
        return self.duration * number / self.count if self.count else float("inf")

    def skip(self, time: float) -> None:
        """Everything up to `time` [s] is done."""
        while self.count and self.following <= self.count and self.at(self.following) <= time:
            self.following += 1

    def due(self, time: float) -> bool:
        """Whether an instant was reached; it counts as done."""
        if not self.count or self.following > self.count or self.at(self.following) > time:
            return False
        self.skip(time)
        return True

    @property
    def next_time(self) -> float:
        return self.at(self.following) if self.following <= self.count else float("inf")


@dataclass
class Clocks:
    """Seconds spent, over all sessions of a run, and how it was started."""

    command: str
    threads: int
    compile: float = 0.0
    advance: float = 0.0
    write: float = 0.0
    processor: float = 0.0  # of all threads while advancing: what other programs on the machine take is not in it

    @property
    def seconds(self) -> dict[str, float]:
        return {"compile": self.compile, "advance": self.advance, "write": self.write}


def run(
    scene: Scene,
    out: Path | None = None,
    *,
    arch: str = "cpu",
    threads: int | None = None,
    pictures: bool = True,
    command: str = "",
    progress: Progress | None = None,
    simulation: Callable[..., WorldLike] | None = None,
) -> Path:
    """Runs a scene into the folder `out`, where it replaces an earlier run, and returns it. SceneError before anything
    is written.

    `command`: how the user would run it again, for the record.
    """
    out = out or default_out(scene)
    progress = progress or Progress()
    planned = checked_plan(scene, arch)
    check_out(out, planned.disk)
    tell_plan(scene, planned, progress, pictures)
    with locked(out, progress.say):
        with _signals() as asked:
            clocks = Clocks(command=command or f"taichi-sph run {out / SCENE_FILE}", threads=threads or os.cpu_count() or 1)
            sim = _simulation(scene, arch, threads, progress, simulation)
            clocks.compile = sim.compile_seconds
            _check_histories(scene, sim)
            _clear(out)
            with files.whole(out / SCENE_FILE) as file:
                file.write(dump(scene))
            progress.log_to(out / LOG_FILE)
            session = _Session(scene, out, sim, arch, clocks, progress, asked, None)
            session.planned = uncorrected(planned, speed.recall(scene, arch))
            session.compute()
        return session.finish(pictures)


def uncorrected(planned: Plan, costs: speed.Costs) -> Plan:
    """A plan as it is without what earlier runs took."""
    drawing, writing = planned.drawing / costs.draw, planned.writing / costs.write
    return replace(planned, seconds=planned.seconds / costs.pace, writing=writing, drawing=drawing, made=Made({}, {}))


def resume(
    out: Path,
    *,
    arch: str = "cpu",
    threads: int | None = None,
    pictures: bool = True,
    settings: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    simulation: Callable[..., WorldLike] | None = None,
) -> Path:
    """Goes on from the newest checkpoint of a run, as if it had never stopped. settings: keys of RESUMED with new values, for a search for
    equilibrium that has stopped; keys of LONGER, for a run in time that is to go on beyond its end. Steps stay as long as they are; a run
    started with that end would fit them to it."""
    from ..output import checkpoint, record

    out = Path(out)
    if not (out / SCENE_FILE).is_file():
        raise SceneError(f"'{out}' is not a run: it has no {SCENE_FILE}")
    files.check_links(out, files.RUN)
    progress = progress or Progress()
    with locked(out, progress.say):
        _complete(out)
        scene = load_scene(out / SCENE_FILE)
        _may_change(scene, settings or {})
        changed = load_scene(out / SCENE_FILE, settings) if settings else scene
        if (out / SUMMARY_FILE).is_file():
            _may_go_on(out, scene, changed)
        saved, refused = checkpoint.newest_whole(out / "checkpoints", record.scene_hash(scene))
        if changed.duration < saved.time and changed.static is None:
            raise SceneError(
                f"duration = {show(changed.duration, 's')}: the run has come to {show(saved.time, 's')} already; give a later end"
            )
        for path, why in refused.items():
            progress.say(f"{why}; it was put aside as {checkpoint.put_aside(path).name}, the one before it is taken")
        progress.say(f"resuming '{scene.name}' at t = {show(saved.time, 's')}, step {saved.step}")
        with _signals() as asked:
            sim = _simulation(changed, arch, threads, progress, simulation)
            sim.restore(saved.state)
            clocks = _clocks_of(saved.extra)
            clocks.threads = threads or os.cpu_count() or 1
            clocks.compile += sim.compile_seconds
            progress.log_to(out / LOG_FILE, append=True)
            session = _Session(changed, out, sim, arch, clocks, progress, asked, saved.time)
            if changed is not scene:
                clocks.command = " ".join([clocks.command, *(f"--set {key}={value}" for key, value in (settings or {}).items())])
                with files.whole(out / NEXT_FILE) as file:
                    file.write(dump(changed))
                session.keep()  # of the scene to come, often in place of that of the scene before: from here on `_complete` goes on
                _switch(out)
            session.compute()
        return session.finish(pictures)


def _check_histories(scene: Scene, sim: WorldLike) -> None:
    """SceneError where a quantity reads a history, or a column of one, that the run will not write."""
    from ..output.summary import derived

    written = {"energies": set(sim.energies()), "progress": {"time", "step", "dt", *sim.status()}}
    written |= {f"probe_{name}": {"time", *values} for name, values in (sim.probes() if scene.output.probes else {}).items()}
    written |= {name: {"time", *units} for name, units in sim.track_units().items()}
    written |= {name: set(units) for name, units in derived(scene).items()}
    for quantity in scene.quantities:
        history, column = (str(quantity.options.get(key, "")) for key in ("history", "column"))
        what = f"quantity '{quantity.name}'"
        if history and history not in written:
            raise SceneError(f"{what}: this run writes no history '{history}'{nearest(history, written)}")
        if history and column and column not in written[history]:
            raise SceneError(f"{what}: the history '{history}' has no column '{column}'{nearest(column, written[history])}")


def _switch(out: Path) -> None:
    """The scene to come becomes that of the run."""
    (out / SUMMARY_FILE).unlink(missing_ok=True)
    os.replace(out / NEXT_FILE, out / SCENE_FILE)


def _complete(out: Path) -> None:
    """Where a switch to another scene was killed: it is made where a checkpoint of that scene stands already, else forgotten."""
    from ..output import checkpoint, record

    if not (out / NEXT_FILE).is_file():
        return
    try:
        checkpoint.newest_whole(out / "checkpoints", record.scene_hash(load_scene(out / NEXT_FILE)))
    except SceneError:
        (out / NEXT_FILE).unlink()
    else:
        _switch(out)


def _may_go_on(out: Path, scene: Scene, changed: Scene) -> None:
    """SceneError where a finished run is given no later end."""
    if scene.static is not None:
        raise SceneError(f"the run in '{out}' is finished: there is nothing to resume")
    if changed.until != scene.until or (changed.duration > scene.duration and scene.until is None):
        return
    if scene.until is not None:
        raise SceneError(
            f"the run in '{out}' is finished: there is nothing to resume; it ends by `until`, and goes on without: --set until=null, or "
            "with a smaller until.share"
        )
    kept = any((out / "checkpoints").glob("*.checkpoint"))
    hint = f"it goes on with a later end than {show(scene.duration, 's')}: --set duration=..." if kept else "and it kept no checkpoint"
    raise SceneError(f"the run in '{out}' is finished: there is nothing to resume; {hint}")


def _may_change(scene: Scene, settings: Mapping[str, Any]) -> None:
    """SceneError where a run cannot go on with those settings."""
    allowed, what = (LONGER, "run") if scene.static is None else (RESUMED, "search for equilibrium")
    for key in settings:
        if key not in allowed:
            near = nearest(key, allowed)
            hint = "" if near.startswith("; valid") else near  # they stand there already
            raise SceneError(f"--set {key}: a resumed {what} takes {', '.join(allowed)}{hint}; run it anew with another scene")


def _clocks_of(extra: dict[str, Any]) -> Clocks:
    """The clocks that a checkpoint holds; what is missing there, or is no number, begins at nothing."""
    found = {f.name: extra.get(f.name) for f in fields(Clocks)}
    kept: dict[str, Any] = {k: v for k, v in found.items() if isinstance(v, str if k == "command" else int | float)}
    every: dict[str, Any] = {"command": "", "threads": 1} | kept
    return Clocks(**every)


class _Session:
    """The loop of one run, from t = 0 or from a checkpoint on."""

    def __init__(
        self,
        scene: Scene,
        out: Path,
        sim: WorldLike,
        arch: str,
        clocks: Clocks,
        progress: Progress,
        asked: list[str],
        resumed_at: float | None,
    ) -> None:
        from ..output.frames import FramesWriter
        from ..output.histories import HistoryWriter

        self.scene, self.out, self.sim, self.arch, self.clocks = scene, out, sim, arch, clocks
        self.progress, self.asked = progress, asked
        self.planned: Plan | None = None  # without what was learnt; of a run from its start
        self.answered: str | None = None  # why the run may end before its duration
        self.first: dict[str, float] | None = None  # a row of the energies that waits for the first step
        self.frames_at = -1.0  # s, of the last frame
        self.energies = sim.energies()
        self.frames = FramesWriter(out / "frames", resumed_at)
        # energies are known at the time of the last force evaluation, a step before the state's
        energies_at = None if resumed_at is None else self.energies["time"]
        columns = {"time": "s"} | {k: "%" if k.endswith("_percent") else "J" for k in self.energies if k != "time"}
        self.history = HistoryWriter(out / "histories" / "energies.csv", columns, energies_at)
        self.counts = HistoryWriter(
            out / "histories" / "progress.csv",
            {"time": "s", "step": "-", "dt": "s"} | {k: getattr(sim, "status_units", {}).get(k, "-") for k in sim.status()},
            resumed_at,
        )
        self.probes = {
            name: HistoryWriter(
                out / "histories" / f"probe_{name}.csv",
                {"time": "s"} | {k: "m/s" if k.startswith("v") else "m" for k in values},
                resumed_at,
            )
            for name, values in (sim.probes() if scene.output.probes else {}).items()
        }
        self.tracks = {
            name: HistoryWriter(out / "histories" / f"{name}.csv", {"time": "s"} | units, resumed_at)
            for name, units in sim.track_units().items()
        }
        o = scene.output
        self.sample = Every(o.samples, scene.duration)
        self.picture = Every(o.frames, scene.duration)
        self.save = Every(o.checkpoints, scene.duration, following=1)
        if resumed_at is not None:
            for every in (self.sample, self.picture, self.save):
                every.skip(self._now)

    @property
    def _now(self) -> float:
        """The time, but for the rounding of a sum of steps."""
        return self.sim.time + 1e-6 * self.sim.dt

    def compute(self) -> None:
        """To the end of the scene, or to what ends it before."""
        try:
            self._loop()
        except RunStopped as stop:
            self._keep_stopped()
            self.progress.say(f"the state was saved in {self.out / STOPPED}")
            if stop.goes_on:
                self._checkpoint("checkpoints")
                self.progress.say(f"go on with another {', '.join(RESUMED)}: taichi-sph resume {self.out} --set static.residual=...")
            self.progress.note(str(stop))
            raise
        except RunInterrupted as interrupt:
            self.progress.note(str(interrupt))
            raise
        finally:
            self._begin()
            self.history.close()
            self.counts.close()
            for writer in (*self.probes.values(), *self.tracks.values()):
                writer.close()
            self.progress.close()

    def _loop(self) -> None:
        sim, duration = self.sim, self.scene.duration
        beat_steps, pace = 1, Pace(duration)
        self._events()
        while self._now < duration and self.answered is None:
            if self.asked:
                self._interrupt()
            target = min(duration, self.sample.next_time, self.picture.next_time, self.save.next_time)
            # a smaller target only returns earlier, it never changes a step
            target = min(target, sim.time + beat_steps * sim.dt)
            before, steps, compiled = clock.monotonic(), sim.step, sim.compile_seconds
            worked = clock.process_time() - sim.compile_processor
            sim.advance_to(target)
            spent = clock.monotonic() - before
            compiled = sim.compile_seconds - compiled  # what is met on the way, a rupture, is compiled then
            self.clocks.compile += compiled
            self.clocks.advance += spent - compiled
            self.clocks.processor += clock.process_time() - sim.compile_processor - worked
            if spent > 0 and sim.step > steps:
                beat_steps = max(1, min(4 * beat_steps, int((sim.step - steps) / spent * BEAT)))
            self._events()
            self.progress.update(
                progress_line(sim.time, duration, sim.dt, sim.dt_rule, pace.left(sim.time), self.energies, sim.status()),
                force=self._now >= duration,
            )
        if self.answered is not None:
            self.progress.say(self.answered)
            if self.frames_at < sim.time:
                self.frames.append(sim.frame())
            if self.scene.output.checkpoints:
                self._checkpoint("checkpoints")  # the run may be wanted to go on
        if self.asked:
            self._interrupt()

    def _events(self) -> None:
        before = clock.monotonic()
        sim = self.sim
        if sim.step > 0:
            self._begin()
        if self.sample.due(self._now):
            self.energies = sim.energies()
            if sim.step == 0 and self.scene.increments is None and hasattr(sim, "given_at_start"):
                self.first = self.energies  # what moves is known after the first step
            else:
                self.history.append(self.energies)
            self.counts.append({"time": sim.time, "step": sim.step, "dt": sim.dt, **sim.status()})
            for name, values in (sim.probes() if self.probes else {}).items():
                self.probes[name].append({"time": sim.time, **values})
            for name, values in (sim.tracks() if self.tracks else {}).items():
                self.tracks[name].append({"time": sim.time, **values})
            if self.scene.until is not None:
                from .until import answered

                self.answered = answered(self.scene, self.out / "histories")
        if self.picture.due(self._now):
            self.frames.append(sim.frame())
            self.frames_at = sim.time
        if self.save.due(self._now):
            self._checkpoint("checkpoints")
        self.clocks.write += clock.monotonic() - before

    def _begin(self) -> None:
        """Writes the first row of the energies: that of what moves at t = 0, and what it was given, are those of the first step."""
        if self.first is None:
            return
        row, self.first = self.first, None
        told: dict[str, float] = getattr(self.sim, "given_at_start", {})
        self.history.append(row | {key: value for key, value in told.items() if key in row})

    def keep(self) -> None:
        """A checkpoint now."""
        self._checkpoint("checkpoints")

    def _checkpoint(self, folder: str) -> Path:
        from ..output import checkpoint, record

        return checkpoint.save(
            self.out / folder,
            scene_hash=record.scene_hash(self.scene),
            time=self.sim.time,
            step=self.sim.step,
            dt=self.sim.dt,
            state=self.sim.state(),
            unset=None if folder == STOPPED else self.sim.unset,
            extra=asdict(self.clocks),
        )

    def _interrupt(self) -> None:
        path = self._checkpoint("checkpoints")
        raise RunInterrupted(
            f"interrupted by {self.asked[0]} at t = {show(self.sim.time, 's')}; checkpoint {path} was written, "
            f"go on with: taichi-sph resume {self.out}"
        )

    def _keep_stopped(self) -> None:
        """Beside the checkpoints, not among them: a resume must not start from a state that failed."""
        self._checkpoint(STOPPED)
        with contextlib.suppress(ValueError):
            self.frames.append(self.sim.frame())

    def finish(self, pictures: bool) -> Path:
        """Record, summary, pictures, and the answer."""
        self.progress.log_to(self.out / LOG_FILE, append=True)
        try:
            self._write_results(pictures)
        finally:
            self.progress.close()
        return self.out

    def _write_results(self, pictures: bool) -> None:
        from ..output.answer import answer
        from ..output.folder import RunFolder
        from ..output.record import write_record
        from ..output.summary import write_summary

        sim, c = self.sim, self.clocks
        how: dict[str, Any] = {"command": c.command, "arch": self.arch, "threads": c.threads, "steps": sim.step, "seconds": c.seconds}
        write_record(self.out, self.scene, state=sim.state(), **how)
        with RunFolder(self.out) as folder:
            counted: dict[str, Any] = {
                "nodes": sim.n_nodes,
                "stress_points": sim.stress_points,
                "processor": c.processor,
                "bytes": sim.bytes,
            }
            summary = write_summary(folder, **counted, contact=sim.contact_report(), overlap=sim.overlap_report(), **how)
            lines = answer(folder, summary)
        began = clock.monotonic()
        drawn = draw(self.out, self.progress) if pictures else []
        # shorter ones measure the start; one that went on was built twice
        # and steps of a search for equilibrium are no steps
        if self.planned is not None and summary["steps"] >= FEW_STEPS and self.answered is None and self.scene.increments is None:
            speed.remember(self.scene, self.arch, self.planned, c.seconds | {"draw": clock.monotonic() - began if drawn else 0.0})
        if "contact" in summary:
            lines = [*lines, contact_text(summary["contact"])]
        if "overlap" in summary:
            lines = [*lines, overlap_text(summary["overlap"])]
        for line in ("", *lines, ""):
            self.progress.say(line)
        self.progress.say(f"written: {self.out}{os.sep} with {SUMMARY_FILE}, record.json, histories, frames (for ParaView)")
        for path in drawn:
            self.progress.say(f"picture: {path}")


def _simulation(scene: Scene, arch: str, threads: int | None, progress: Progress, factory: Callable[..., WorldLike] | None) -> WorldLike:
    progress.say(f"compiling for {arch} (kept for the next run) ...")
    began = clock.monotonic()
    if factory is None:
        from ..world.world import World

        factory = World
    sim = factory(scene, arch=arch, threads=threads)
    progress.say(f"compiled and built in {clock.monotonic() - began:.1f} s; dt {show(sim.dt, 's')}, ruled by {sim.dt_rule}")
    return sim


@contextlib.contextmanager
def _signals() -> Iterator[list[str]]:
    """Ctrl-C and SIGTERM become entries of a list; a second Ctrl-C ends at once."""
    asked: list[str] = []
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return

    def note(number: int, _: Any) -> None:
        if asked and number == signal.SIGINT:
            raise KeyboardInterrupt
        asked.append(signal.Signals(number).name)

    before = {s: signal.signal(s, note) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _clear(out: Path) -> None:
    """Removes what an earlier run left, and nothing else."""
    for name in files.RUN if (out / SCENE_FILE).is_file() else ():
        if name == SCENE_FILE:  # replaced when the new one is complete
            continue
        path = out / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)

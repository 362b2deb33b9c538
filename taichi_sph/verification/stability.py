"""Stability at the extremes, as a map: for each knob the range in which runs hold, its ends found by bisection, beside what is
predicted; and which waves on a stretched lattice grow (lattice.py).

    time step      over 2/omega_max: of random motion in the linear range (shell/instead/limit.py), and of runs that tear, strike and
                   slosh. Predicted 1
    support        h/D, by the spectrum. Below 1/sqrt(2) a node does not reach its diagonal neighbours, and a fit of order 2 has
                   no xy
    poisson        by the spectrum. Plane stress is positive definite for -1 < nu < 1
    thickness      e/D, by the limit of the step, which must be the predicted one. Nothing is predicted to end it
    irregularity   nodes moved at random by up to that many D, by the spectrum. Quadrangles are surely convex up to 1/4;
                   triangles are Delaunay's and exist up to 1/2, where two nodes may meet
    stretch        of a lattice, by its waves. Predicted where the continuum itself gives way, and nothing above but for nodes
                   alone with an Eulerian kernel: any tension (Swegle)
    speed          of a rigid ball. Predicted the speed of sound: a node struck faster runs into its neighbours
    steps          of a free shell in f32, until its energy is off by DRIFT. Predicted DRIFT / eps, all rounding one way

The spectrum holds on 6 x 6 cells with three zero modes, no growing one and the next six within FACTOR of the true ones. A
run holds where the watchdog lets it go on and the closed residual stays below RESIDUAL. The keys of a scene are narrower than
that; here they are set past their checks.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import SceneError, TaichiSphError, nearest
from ..scene import (
    Box,
    Cylinder,
    Delay,
    Disc,
    Fluid,
    Material,
    Mazars,
    Numerics,
    Pinball,
    Plate,
    PrescribedVelocity,
    Rigid,
    Scene,
    Shell,
    ShellFill,
    StepLimit,
    material,
)

FILE = Path("benchmarks") / "stability.json"
PICTURE = Path("renders") / "stability.png"
RESIDUAL = 5.0  # % of what was given
DRIFT = 0.01  # of the energy
FACTOR = 3.0  # between a frequency and the true one
D = 1e-3  # m
STEEL = {"name": "steel", "young": 210e9, "poisson": 0.3, "density": 7800.0}
SOUND = math.sqrt(210e9 / 7800.0 / (1 - 0.3**2))  # m/s
CELLS = (("quad", 0.0), ("quad", 0.25), ("triangle", 0.0), ("triangle", 0.25))

Holds = Callable[[float], str]  # of a value: why it does not hold, or nothing


@dataclass(frozen=True)
class Range:
    """A knob of one case: it holds from low to high, None where it holds as far as was looked; what is predicted for both
    ends; why it does not hold beyond."""

    knob: str
    case: str
    low: float | None
    high: float | None
    predicted: tuple[float | None, float | None]
    why: str
    seconds: float

    def __str__(self) -> str:
        ends = [
            f"{'any' if v is None else f'{v:.4g}'} ({'any' if p is None else f'{p:.4g}'})"
            for v, p in zip((self.low, self.high), self.predicted)
        ]
        return f"{self.knob:14s} {self.case:44s} {ends[0]:>18s} to {ends[1]:18s} {self.why}"


def edge(holds: Holds, inside: float, outside: float, resolution: float) -> tuple[float | None, str]:
    """The last value on the way from inside to outside that holds, to `resolution` of it, and why the next one does not;
    None where all do. SceneError where inside does not hold. Of values of one sign the steps are geometric."""
    said = holds(inside)
    if said:
        raise SceneError(f"nothing to bisect: {inside:g} does not hold, {said}")
    why = holds(outside)
    if not why:
        return None, ""
    geometric = inside * outside > 0
    while abs(outside - inside) > resolution * max(abs(inside), 0.0 if geometric else 0.1):
        middle = math.copysign(math.sqrt(inside * outside), inside) if geometric else 0.5 * (inside + outside)
        said = holds(middle)
        inside, outside, why = (inside, middle, said) if said else (middle, outside, why)
    return inside, why


# --- what holds -------------------------------------------------------------------------------------


def _past_checks(model: Any, **changes: Any) -> Any:
    """A copy with other values, dotted keys, none of them checked."""
    for key, value in changes.items():
        head, _, rest = key.partition("__")
        if rest:
            value = _past_checks(getattr(model, head), **{rest: value})
        model = model.model_copy(update={head: value})
    return model


def sheet(cells: str = "quad", irregularity: float = 0.0, formulation: str = "galerkin", n: int = 8, **more: Any) -> Scene:
    """A free square of steel in its plane."""
    shell = Shell(name="plate", surface=Plate(length=n * D, width=n * D), thickness=D, material=Material(**STEEL), motion="in_plane")
    numerics = Numerics(spacing=D, cells=cells, irregularity=irregularity, formulation=formulation)
    return Scene(name="sheet", title="Sheet", source="", shells=[shell], duration=1e-5, numerics=numerics, **more)


def wall(thickness: float, cells: str = "quad", irregularity: float = 0.25) -> Scene:
    """A free piece of a pipe, 8 x 8 cells, thickness in spacings."""
    side = 8 * D
    plain = sheet(cells, irregularity, limit=StepLimit())
    shell = plain.shells[0].model_copy(
        update={
            "surface": Cylinder(radius=side, length=side, axis="y", angle=1.0),
            "motion": "free",
            "thickness": thickness * D,
        }
    )
    return plain.model_copy(update={"shells": (shell,)})


def by_spectrum(scene: Scene) -> str:
    """Why the scene's operator is none that holds, by its modes on a free square; or nothing."""
    from .spectrum import RIGID, compare

    try:
        with np.errstate(all="ignore"):
            s = compare(scene, cells=6, count=6)
    except (TaichiSphError, np.linalg.LinAlgError, ArithmeticError) as error:
        return str(error)
    if s.growth > 1e-6:
        return "a mode grows"
    if s.rigid != RIGID:
        return f"{s.rigid} zero modes"
    ratio = s.ours / s.fine
    worst = float(ratio[np.argmax(np.abs(np.log(np.maximum(ratio, 1e-12))))])
    return "" if 1 / FACTOR < worst < FACTOR else f"a frequency is {worst:.2g} of the true one"


def limit(scene: Scene) -> tuple[float, float]:
    """Measured and predicted limit of the step [s]."""
    from ..bodies.shell.instead.limit import LimitSearch
    from ..world.world import World

    sim = World(scene, threads=1)
    sim.advance(1)
    search = sim.instead
    assert isinstance(search, LimitSearch)
    return search.measured, search.predicted


def by_run(scene: Scene, looks: int = 10, whole: bool = False) -> str:
    """Why a run does not hold, or nothing. whole: nothing may be damaged in it."""
    from .. import runtime
    from ..world.world import World

    try:
        sim = World(scene, threads=1)
        for k in range(looks):
            sim.advance_to(scene.duration * (k + 1) / looks)
            residual = sim.energies()["closed_residual_percent"]
            if not abs(residual) < RESIDUAL:
                return f"closed residual {residual:.3g} %"
            if whole and (damage := float(runtime.get(sim.shell.cells.delayed, sim.shell.cells.n).max())) > 0:
                return f"damage {damage:.2g} where there should be none"
    except TaichiSphError as error:
        return str(error)
    return ""


# --- small scenes ------------------------------------------------------------------------------------


def pulled(strain: float, duration: float, safety: float = 0.9) -> Scene:
    """A sheet of concrete that breaks at a strain of 8.5e-5, its ends drawn apart."""
    concrete = Material(
        name="concrete", young=32e9, poisson=0.2, density=2450.0, damage=Mazars(threshold=8.5e-5, A=1, B=7300),
        delay=Delay(a=10, tau_c="1 us"), critical_damage=0.99,
    )  # fmt: skip
    n = 12
    plain = sheet("quad", 0.25, n=n)
    v = 0.5 * strain * n * D / duration
    ends = [(Box(hi=(0, None, None)), -v), (Box(lo=(n * D, None, None)), v)]
    motions = tuple(PrescribedVelocity(shell="plate", where=where, velocity=(speed, 0, 0)) for where, speed in ends)
    shells = (plain.shells[0].model_copy(update={"material": concrete}),)
    return _past_checks(
        plain.model_copy(update={"shells": shells, "motions": motions, "duration": duration}),
        numerics__time_step_safety=safety,
    )


def struck(velocity: float, metal: bool = False, safety: float = 0.9) -> Scene:
    """A rigid ball of 22 mm on a free disc of 30 mm and 0.8 mm, until it has moved by 1 mm (6 mm where the disc yields and
    tears), 10 us at least."""
    e, radius = 0.8e-3, 11e-3
    steel = material("steel, perforated plate") if metal else Material(**STEEL)
    plate = Shell(name="plate", surface=Disc(radius=15e-3), thickness=e, material=steel, motion="free")
    ball = Rigid(
        name="ball",
        mass=0.154,
        pinballs=[Pinball(centre=(0, 0, radius + 0.5 * e + 1e-6), radius=radius)],
        velocity=(0, 0, -1.0),
    )
    ball = ball.model_copy(update={"velocity": (0.0, 0.0, -velocity)})
    scene = Scene(
        name="struck", title="Struck", source="", shells=[plate], rigids=[ball], numerics=Numerics(spacing=D),
        duration=max((6e-3 if metal else 1e-3) / velocity, 1e-5),
    )  # fmt: skip
    return _past_checks(scene, numerics__time_step_safety=safety)


def sloshing(velocity: float, safety: float = 0.9) -> Scene:
    """A can of water hit by a bullet, until that has moved by 5 mm, 50 us at least."""
    ball = Pinball(centre=(0.041, 0, 0.04), radius=0.01)
    can = Shell(
        name="can",
        surface=Cylinder(radius=0.03, length=0.08, ends="discs"),
        thickness=1e-3,
        material=Material(**STEEL),
        motion="free",
    )
    bullet = Rigid(name="bullet", mass=0.03, pinballs=[ball], velocity=(-1.0, 0, 0)).model_copy(update={"velocity": (-velocity, 0.0, 0.0)})
    scene = Scene(
        name="can", title="Can", source="", shells=[can], fluids=[Fluid(name="water", fill=ShellFill(shell="can"))], rigids=[bullet],
        duration=max(0.005 / velocity, 5e-5), numerics=Numerics(spacing=0.01),
    )  # fmt: skip
    return _past_checks(scene, numerics__time_step_safety=safety)


# --- the knobs ---------------------------------------------------------------------------------------

Found = tuple[str, float | None, float | None, tuple[float | None, float | None], str]


def time_step() -> Iterator[Found]:
    for cells, irregularity in CELLS:
        measured, predicted = limit(sheet(cells, irregularity, limit=StepLimit()))
        yield f"membrane, {cells}s{_moved(irregularity)}", None, measured / predicted, (None, 1.0), "random motion grows"
    for cells in ("quad", "triangle"):
        measured, predicted = limit(wall(1.0, cells))
        yield f"bent shell, {cells}s{_moved(0.25)}", None, measured / predicted, (None, 1.0), "random motion grows"
    try:
        measured, predicted = limit(sheet(formulation="collocation", limit=StepLimit()))
        yield "membrane, collocation", None, measured / predicted, (None, 1.0), "random motion grows"
    except TaichiSphError as error:
        yield "membrane, collocation", None, 0.0, (None, 1.0), str(error)
    runs: dict[str, Callable[[float], str]] = {
        "could tear, at a third of its threshold": lambda s: by_run(pulled(3e-5, 200e-6, s), whole=True),
        "tears, at thirty times its threshold": lambda s: by_run(pulled(2.7e-3, 40e-6, s)),
        "a ball on an elastic disc, 40 m/s": lambda s: by_run(struck(40.0, safety=s)),
        "a ball through a metal disc, 150 m/s": lambda s: by_run(struck(150.0, True, s)),
        "a bullet at a can of water, 100 m/s": lambda s: by_run(sloshing(100.0, s)),
    }
    for case, holds in runs.items():
        high, why = edge(holds, 0.9, 3.0, 0.02)
        yield case, None, high, (None, 1.0), why


def support() -> Iterator[Found]:
    for cells, irregularity in CELLS:

        def holds(h: float, cells: str = cells, irregularity: float = irregularity) -> str:
            return by_spectrum(_past_checks(sheet(cells, irregularity), numerics__formulation__support=h))

        low, why = edge(holds, 1.2, 0.4, 0.05)
        high, beyond = edge(holds, 1.2, 4.0, 0.05)
        yield f"{cells}s{_moved(irregularity)}", low, high, (math.sqrt(0.5), None), _both(why, beyond)


def poisson() -> Iterator[Found]:
    for cells, irregularity in CELLS[1:4:2]:
        scene = sheet(cells, irregularity)

        def holds(nu: float, scene: Scene = scene) -> str:
            shell = _past_checks(scene.shells[0], material__poisson=nu)
            return by_spectrum(scene.model_copy(update={"shells": (shell,)}))

        low, why = edge(holds, 0.0, -1.1, 0.02)
        high, beyond = edge(holds, 0.0, 1.1, 0.02)
        yield f"{cells}s{_moved(irregularity)}", low, high, (-1.0, 1.0), _both(why, beyond)


def thickness() -> Iterator[Found]:
    def holds(e: float) -> str:
        try:
            measured, predicted = limit(wall(e))
        except TaichiSphError as error:
            return str(error)
        return "" if 0.999 < measured / predicted < 1.1 else f"the limit is {measured / predicted:.3g} of the predicted one"

    low, why = edge(holds, 1.0, 1e-6, 0.5)
    high, beyond = edge(holds, 1.0, 1e4, 0.5)
    yield "bent shell, quads moved by 0.25 D", low, high, (None, None), _both(why, beyond)


def irregularity() -> Iterator[Found]:
    for cells, certain in (("quad", 0.25), ("triangle", 0.5)):

        def holds(move: float, cells: str = cells) -> str:
            said = (by_spectrum(_past_checks(sheet(cells), numerics__irregularity=move, numerics__seed=seed)) for seed in range(3))
            return next(filter(None, said), "")

        high, why = edge(holds, 0.0, 1.5, 0.1)
        yield f"{cells}s, three draws", None, high, (None, certain), why


def stretch() -> Iterator[Found]:
    from .lattice import NOTHING, least_stretch

    for one in waves():
        sound = one.worst.min(axis=1) > -NOTHING
        at = int(np.argmin(np.abs(one.stretches - 1)))
        below, above = np.flatnonzero(~sound[:at]), np.flatnonzero(~sound[at:])
        low = float(one.stretches[below[-1] + 1]) if len(below) else None
        high = float(one.stretches[at + above[0] - 1]) if len(above) else None
        blind = float(2 / one.waves[np.flatnonzero(one.worst[at] < NOTHING)[0]]) if (one.worst[at] < NOTHING).any() else 0.0
        tension = 1.0 if one.name == "Eulerian kernel, nodes alone" else None  # Swegle's criterion: W'' > 0 at the next node
        yield (
            one.name,
            low,
            high,
            (least_stretch(), tension),
            f"blind at waves of {blind:.3g} D" if blind else "no blind wave",
        )


def speed() -> Iterator[Found]:
    for case, scene, sound in (
        ("a ball on an elastic disc", lambda v: struck(v), SOUND),
        ("a ball through a metal disc", lambda v: struck(v, True), SOUND),
        ("a bullet at a can of water", lambda v: sloshing(v), 1450.0),
    ):

        def holds(v: float, scene: Callable[[float], Scene] = scene) -> str:
            return by_run(scene(v))

        high, why = edge(holds, 50.0, 2e4, 0.1)
        yield case, None, high, (None, sound), why


def steps() -> Iterator[Found]:
    for case, spin, flight in (
        ("f32, flies and rings", 0.0, 10.0),
        ("f32, turns 10 times a second", 63.0, 0.0),
        ("f32, turns 100 times a second", 630.0, 0.0),
    ):
        high, why = _drift(spin, flight)
        yield case, None, high, (None, DRIFT / float(np.finfo(np.float32).eps)), why


def _drift(spin: float, flight: float, most: int = 100_000) -> tuple[float | None, str]:
    """Steps until the energy of a small free shell in f32 is off by DRIFT, and what was lost by then."""
    from .. import runtime
    from ..world.world import World

    plain = wall(0.2)
    scene = plain.model_copy(
        update={
            "limit": None,
            "duration": 1e3,
            "numerics": plain.numerics.model_copy(update={"precision": "f32", "time_step_safety": 0.85}),
        }
    )
    sim = World(scene, threads=1)
    nodes, n = sim.shell.nodes, sim.shell.nodes.n
    N, mass, X = (runtime.get(k, n).astype(float) for k in (nodes.N, nodes.mass, nodes.X))
    X -= mass @ X / mass.sum()
    turn = np.array([0.2, 0.3, 1.0]) / np.linalg.norm([0.2, 0.3, 1.0]) * spin
    v = np.cross(turn, X) + [flight, 0, 0] + 0.3 * np.random.default_rng(0).standard_normal((n, 3))
    runtime.put(nodes.v, v.astype(np.float32))
    runtime.put(nodes.omega, (turn - (N @ turn)[:, None] * N).astype(np.float32))

    def state() -> tuple[float, float]:
        e = sim.energies()
        return e["kinetic"] + e["elastic"], float(np.linalg.norm(mass @ runtime.get(nodes.v, n).astype(float)) / mass.sum())

    sim.advance(100)
    energy, speed_of_centre = state()
    while sim.step < most:
        try:
            sim.advance(1000)
        except TaichiSphError as error:
            return float(sim.step), str(error)
        now, moved = state()
        if not abs(now / energy - 1) < DRIFT:
            return float(sim.step), f"energy {100 * (now / energy - 1):+.2g} %"
    return (
        None,
        f"energy {100 * (now / energy - 1):+.2g} %, mass centre {moved - speed_of_centre:+.1e} m/s after {sim.step} steps",
    )


def _moved(irregularity: float) -> str:
    return f" moved by {irregularity:g} D" if irregularity else " in rows"


def _short(why: str) -> str:
    """Without advice."""
    return why.split("; likely")[0].split("; the time step is likely")[0]


def _both(low: str, high: str) -> str:
    said = [f"{word}: {why}" for word, why in (("below", low), ("above", high)) if why]
    return "; ".join(said)


KNOBS: dict[str, Callable[[], Iterator[Found]]] = {
    "time step": time_step,
    "support h/D": support,
    "Poisson's ratio": poisson,
    "e/D": thickness,
    "irregularity": irregularity,
    "stretch": stretch,
    "speed [m/s]": speed,
    "steps": steps,
}
_waves: list[Any] = []


def waves() -> list[Any]:
    """The stability domains of all forms, made once."""
    from .lattice import domains

    if not _waves:
        _waves.extend(domains(np.linspace(0.5, 1.5, 41), np.linspace(0.025, 1, 40)))
    return _waves


# --- the command --------------------------------------------------------------------------------------


def main(only: Sequence[str] = (), record: bool = False) -> list[Range]:
    """Prints the map, line by line; where asked to, records it as JSON, other knobs as they were, and draws the waves."""
    from ..output.folder import write_json
    from ..output.record import commit, machine
    from ..run.draw import can_draw
    from ..run.progress import Progress

    for name in only:
        if name not in KNOBS:
            raise SceneError(f"--only {name}: there is no such knob{nearest(name, KNOBS)}")
    found: list[Range] = []
    print("holds from to (predicted), why not beyond", flush=True)
    for knob in only or KNOBS:
        began = clock.perf_counter()
        for case, low, high, predicted, why in KNOBS[knob]():
            now = clock.perf_counter()
            found.append(Range(knob, case, low, high, predicted, _short(why), now - began))
            began = now
            print(found[-1], flush=True)
    if record:
        old = [] if not FILE.is_file() or not only else [r for r in _recorded() if r["knob"] not in only]
        rows = sorted([*old, *map(asdict, found)], key=lambda r: list(KNOBS).index(r["knob"]))
        content = {
            "command": "taichi-sph stability --record",
            "commit": commit(),
            "machine": machine(),
            "seconds": sum(r["seconds"] for r in rows),
            "ranges": rows,
        }
        print(f"recorded: {write_json(FILE, content)}")
        if "stretch" in (only or KNOBS) and can_draw(Progress()):
            from ..render.domains import render_domains
            from .lattice import POISSON, SUPPORT, least_stretch

            title = f"Waves on a square lattice stretched along x (h/D = {SUPPORT:g}, Poisson's ratio {POISSON:g})"
            print(f"drawn: {render_domains(waves(), title, least_stretch(), PICTURE)}")
    return found


def _recorded() -> list[dict[str, Any]]:
    import json

    return json.loads(FILE.read_text(encoding="utf-8"))["ranges"]

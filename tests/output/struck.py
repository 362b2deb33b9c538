"""Drawn runs with several bodies: a plate that a ball perforates, a tank that a ball crosses, empty or full of water.

Kinematics are given, not computed: numbers that the measures must find again stand at the head.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from taichi_sph.frame import NO_CELLS, BodyFrame, Frame
from taichi_sph.geometry.surfaces import generate
from taichi_sph.observers.leak import UNITS
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesWriter
from taichi_sph.output.histories import write_history
from taichi_sph.output.measures.pattern import cell_centres, node_spacing
from taichi_sph.output.summary import write_summary
from taichi_sph.scene import (
    CappedTank,
    Delay,
    Disc,
    Fluid,
    Material,
    Mazars,
    Numerics,
    Output,
    Pinball,
    Quantity,
    Rigid,
    Scene,
    Shell,
    ShellFill,
    dump,
)
from taichi_sph.scene import Plate as Rectangle

PLATE, PLUG, PETALS, CRACKED = 0.015, 0.00425, 7, 0.009  # m: radii; number of radial cracks
PLUG_SPEED, BALL, BALL_SPEED, BALL_EXIT, HIT = 310.0, 0.0055, 300.0, 255.0, 5e-6
PLATE_END = 8e-5  # s

TANK, HEIGHT, CRACK, OPENING = 0.15, 0.6, 0.44, 0.012  # m
SHOT, SHOT_SPEED, SHOT_HIT, WATER_EXIT = 0.009, 730.0, 2e-5, 88.0
JET, LEAK = 60.0, 3.1  # m/s, l/s
RIGID_UNITS = (
    {"time": "s"} | dict.fromkeys("xyz", "m") | dict.fromkeys(("vx", "vy", "vz"), "m/s") | dict.fromkeys(("fx", "fy", "fz", "f_max"), "N")
)
LEAK_UNITS = {"time": "s"} | UNITS


def steel(**changes: object) -> Material:
    return Material(
        name="metal", young=70e9, poisson=0.3, density=2700, damage=Mazars(threshold=1e-3, A=1, B=100),
        delay=Delay(a=1, tau_c=1e-8), critical_damage=0.25, **changes,
    )  # fmt: skip


def shell_frame(
    name: str, X: np.ndarray, x: np.ndarray, v: np.ndarray, cells: np.ndarray, rupture: np.ndarray, time: float, plastic: np.ndarray
) -> BodyFrame:
    broken = rupture <= time
    return BodyFrame(
        name, x, cells, {"reference": X, "velocity": v},
        {
            "damage": np.where(broken, 1.0, np.clip(plastic / 0.5, 0, 0.24)),
            "broken": broken.astype(np.uint8),
            "rupture_time": np.where(broken, rupture, np.nan),
            "plastic": plastic,
            "thickness": np.full(len(cells), 8e-4),
        },
    )  # fmt: skip


def ball_frame(name: str, centres: np.ndarray, start: np.ndarray, velocity: np.ndarray, radius: float) -> BodyFrame:
    n = len(centres)
    data = {"radius": np.full(n, radius), "velocity": np.tile(velocity, (n, 1)), "reference": start}
    return BodyFrame(name, centres, NO_CELLS, data, {}, "rigid")


# --- the plate ------------------------------------------------------------------------------------


def plate_scene(spacing: float = 5e-4) -> Scene:
    return Scene(
        name="drawn_perforation",
        title="Ball through a clamped plate",
        source="tests",
        quality="draft",
        shells=[Shell(name="plate", surface=Disc(radius=PLATE), thickness=8e-4, material=steel(), motion="free")],
        rigids=[Rigid(name="ball", pinballs=[Pinball(centre=(0, 0, 0.007), radius=BALL)], mass=0.154, velocity=(0, 0, -BALL_SPEED))],
        duration=PLATE_END,
        numerics=Numerics(spacing=spacing),
        output=Output(frames=8),
        quantities=[
            Quantity(name="plug_diameter", unit="m", value=2 * PLUG, tolerance=2 * spacing, source="drawn"),
            Quantity(name="petals", value=PETALS, tolerance=0, source="drawn"),
            Quantity(name="striker_speed", unit="m/s", value=BALL_EXIT, tolerance=0.1, source="drawn"),
        ],
    )


def ball_at(t: float) -> tuple[float, float]:
    """Height [m] and speed [m/s] of the ball: it slows down evenly over 30 us."""
    slow = np.clip((t - HIT) / 3e-5, 0, 1)
    travelled = BALL_SPEED * t - (BALL_SPEED - BALL_EXIT) * (0.5 * slow**2 * 3e-5 + max(0.0, t - HIT - 3e-5))
    return 0.007 - travelled, BALL_SPEED - (BALL_SPEED - BALL_EXIT) * slow


def perforated(t: float, X: np.ndarray, cells: np.ndarray) -> BodyFrame:
    """The plate at `t`: dished, a plug that flies on, petals that bend about the ends of the cracks."""
    D = node_spacing(X, cells)
    since = max(0.0, t - HIT)
    r, phi = np.hypot(X[:, 0], X[:, 1]), np.arctan2(X[:, 1], X[:, 0])
    er = np.column_stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)])
    up = np.array([0.0, 0.0, 1.0])
    dish = 0.0025 * np.clip(since / 2e-5, 0, 1)
    w = -dish * np.clip(1 - r / PLATE, 0, 1) ** 2 / (1 - CRACKED / PLATE) ** 2
    angle = np.radians(62) * np.clip((since - 1e-5) / 4e-5, 0, 1)
    arm = np.clip(CRACKED - r, 0, None)
    rim = -dish
    x = X + w[:, None] * up
    petal = r < CRACKED
    x[petal] = ((r + arm * (1 - np.cos(angle)))[:, None] * er + (rim - arm * np.sin(angle))[:, None] * up)[petal]
    plug = r < PLUG
    x[plug] = X[plug] + (rim - PLUG_SPEED * since - 0.002 * (1 - (r[plug, None] / PLUG) ** 2)) * up
    centre = cell_centres(X, cells)
    rc, pc = np.hypot(centre[:, 0], centre[:, 1]), np.arctan2(centre[:, 1], centre[:, 0])
    turn = (pc * PETALS / (2 * np.pi) + 0.31) % 1.0
    aside = np.minimum(turn, 1 - turn) * 2 * np.pi / PETALS * rc
    rim_cells = np.abs(rc - PLUG) < 0.75 * D
    cracks = (rc > PLUG) & (rc < CRACKED) & (aside < 0.71 * D)
    rupture = np.where(rim_cells, HIT + 4e-6, np.where(cracks, HIT + 4e-6 + (rc - PLUG) / 400, np.inf))
    plastic = 0.6 * np.clip(since / 3e-5, 0, 1) * np.exp(-np.abs(rc - PLUG) / 0.003)
    v = np.zeros_like(X)
    v[plug, 2] = -PLUG_SPEED if since > 0 else 0.0
    return shell_frame("plate", X, x, v, cells, rupture, t, plastic)


def write_plate(folder: Path, spacing: float = 5e-4, count: int = 9) -> RunFolder:
    scene = plate_scene(spacing)
    mesh = generate(scene.shells[0].surface, scene.numerics)
    start = np.array([[0, 0, 0.007]])

    def frame(t: float, step: int) -> Frame:
        z, speed = ball_at(t)
        ball = ball_frame("ball", np.array([[0, 0, z]]), start, np.array([0, 0, -speed]), BALL)
        return Frame(t, step, (perforated(t, mesh.points, mesh.cells), ball))

    time = np.linspace(0, PLATE_END, 400)
    z, v = np.array([ball_at(t) for t in time]).T
    history = {"time": time, "x": 0 * z, "y": 0 * z, "z": z, "vx": 0 * z, "vy": 0 * z, "vz": -v, "fx": 0 * z, "fy": 0 * z}
    history["fz"] = 0.154 * -np.gradient(v, time)
    history["f_max"] = 1.25 * np.abs(history["fz"])  # as if a step between two samples had more
    return _write(folder, scene, frame, count, {"rigid_ball": (RIGID_UNITS, history)}, PLATE_END)


# --- the tank -------------------------------------------------------------------------------------


def tank_scene(full: bool, spacing: float = 0.01) -> Scene:
    wall = CappedTank(radius=TANK, length=HEIGHT, cap="flat", origin=(0, 0, -HEIGHT / 2))
    balls = [Pinball(centre=(-TANK - 0.03 - 0.006 * i, 0, 0), radius=SHOT) for i in range(2)]
    return Scene(
        name="drawn_tank",
        title=f"Ball through a tank, {'full of water' if full else 'empty'}",
        source="tests",
        quality="draft",
        shells=[Shell(name="tank", surface=wall, thickness=1e-3, material=steel(), motion="free")],
        rigids=[Rigid(name="ball", pinballs=balls, mass=0.031, velocity=(SHOT_SPEED, 0, 0))],
        fluids=[Fluid(name="water", fill=ShellFill(shell="tank"))] if full else [],
        duration=2.1e-3 if full else 6e-4,
        numerics=Numerics(spacing=spacing),
        output=Output(frames=8),
    )


def shot_at(t: float, full: bool) -> tuple[float, float]:
    """x [m] and speed [m/s] of the ball: drag in the water, a step at each wall when empty."""
    if full:
        k = np.log(SHOT_SPEED / WATER_EXIT) / 2.1e-3
        return -TANK - 0.03 + SHOT_SPEED * (1 - np.exp(-k * t)) / k, SHOT_SPEED * np.exp(-k * t)
    after = 2.0 * TANK / 688.0 + 3e-5
    if t < 3e-5:
        return -TANK - 0.03 + SHOT_SPEED * t, SHOT_SPEED
    if t < after:
        return -TANK - 0.03 + SHOT_SPEED * 3e-5 + 688.0 * (t - 3e-5), 688.0
    return -TANK - 0.03 + SHOT_SPEED * 3e-5 + 688.0 * (after - 3e-5) + 640.0 * (t - after), 640.0


def holed(t: float, X: np.ndarray, cells: np.ndarray, full: bool, end: float) -> BodyFrame:
    """The tank at `t`: a hole in front (and behind when empty), a crack along the front and a bulge when full."""
    D = node_spacing(X, cells)
    centre = cell_centres(X, cells)
    wall = np.abs(centre[:, 2]) < HEIGHT / 2 - 1e-6
    front, back = wall & (centre[:, 0] < 0), wall & (centre[:, 0] > 0)
    away = np.hypot(centre[:, 1], centre[:, 2])
    rupture = np.where(front & (away < SHOT + 0.3 * D), 3e-5, np.inf)
    if not full:
        rupture = np.where(back & (away < SHOT + 0.6 * D), 4.6e-4, rupture)
    grown = np.clip((t - 6e-4) / 1e-3, 0, 1) if full else 0.0
    if full:
        line = front & (np.abs(centre[:, 1]) < 0.51 * D) & (np.abs(centre[:, 2]) < CRACK / 2)
        rupture = np.where(line & ~np.isfinite(rupture), 6e-4 + 1e-3 * np.abs(centre[:, 2]) / (CRACK / 2), rupture)
    x, v = X.copy(), np.zeros_like(X)
    side = np.abs(X[:, 2]) < HEIGHT / 2 - 1e-6
    er = np.column_stack([X[:, 0], X[:, 1], 0 * X[:, 2]]) / TANK
    if full:
        x += (side * 0.012 * t / end * np.cos(np.pi * X[:, 2] / HEIGHT))[:, None] * er
        wide = OPENING * np.sqrt(np.clip(1 - (2 * X[:, 2] / CRACK) ** 2, 0, 1)) * grown
        arc = np.arctan2(X[:, 1], -X[:, 0])
        lip = side & (X[:, 0] < 0)
        shift = 0.5 * np.sign(arc) * wide * np.exp(-np.abs(arc) * TANK / 0.05) * lip
        x += shift[:, None] * np.column_stack([-er[:, 1], er[:, 0], 0 * arc]) * -1
    else:
        for sign, began in ((-1, 3e-5), (1, 4.6e-4)):
            here = side & (sign * X[:, 0] > 0)
            push = 0.012 * np.clip((t - began) / 6e-5, 0, 1) * np.exp(-np.hypot(X[:, 1], X[:, 2]) / 0.02)
            x[:, 0] += here * push
    moving = np.zeros(len(X), dtype=bool)
    moving[np.unique(cells)] = True
    moving[np.unique(cells[~np.isfinite(rupture)])] = False
    if not full:
        for sign, began in ((-1, 3e-5), (1, 4.6e-4)):
            x[moving & (sign * X[:, 0] > 0), 0] += 640 * max(0.0, t - began)
    v[:, 0] = np.where(moving & (np.abs(X[:, 2]) < 2 * SHOT), 640.0, 0.0)
    plastic = 0.35 * np.exp(-away / 0.02) * ((t > 3e-5) & front | (t > 4.6e-4) & back & (not full))
    if full:
        plastic = plastic + front * 0.25 * grown * np.exp(-np.abs(centre[:, 1]) / 0.025) * (np.abs(centre[:, 2]) < CRACK / 2 * grown + 0.02)
    return shell_frame("tank", X, x, v, cells, rupture, t, plastic)


def water(t: float, X: np.ndarray, spacing: float, end: float) -> BodyFrame:
    """Water at `t`: a pressure wave from where the ball entered, and particles that left through the crack."""
    entry = np.array([-TANK, 0, 0])
    rng = np.random.default_rng(1)
    since = max(0.0, t - 3e-5)
    away = np.linalg.norm(X - entry, axis=1)
    front = 1450 * since
    pressure = 2e7 * np.exp(-(((away - front) / 0.03) ** 2)) * (0.05 / np.maximum(away, 0.05)) ** 0.4 + 2e6 * (away < front)
    pressure += 1e5 * rng.standard_normal(len(X))
    ball = np.array([shot_at(t, True)[0], 0, 0])
    d = np.linalg.norm(X - ball, axis=1)
    pressure = np.where(d < 0.06, pressure + 1.2e7 * np.exp(-((d / 0.03) ** 2)), pressure)
    cavity = (X[:, 0] < ball[0]) & (np.hypot(X[:, 1], X[:, 2]) < 0.02)
    pressure[cavity] = 0
    v = 20 * np.exp(-d / 0.05)[:, None] * (X - ball) / np.maximum(d, 1e-9)[:, None]
    # those nearest to the crack leave first
    depth = X[:, 0] + np.sqrt(np.maximum(TANK**2 - X[:, 1] ** 2, 0))
    near = (np.abs(X[:, 1]) < 0.02) & (np.abs(X[:, 2]) < CRACK / 2) & (depth < 0.03)
    leaves = np.where(near, 7e-4 + 1e-3 * rng.random(len(X)) * (0.3 + np.abs(X[:, 2]) / CRACK), np.inf)
    outside = leaves <= t
    x = X.copy()
    speed = JET * (1 + 0.25 * rng.standard_normal(len(X)))
    spread = 0.12 * rng.standard_normal((len(X), 3))
    fly = np.clip(t - np.where(np.isfinite(leaves), leaves, t), 0, None)
    direction = np.array([-1.0, 0, 0]) + spread
    x[outside] = (np.column_stack([np.full(len(X), -TANK), X[:, 1] * 0.3, X[:, 2]]) + (speed * fly)[:, None] * direction)[outside]
    v[outside] = (speed[:, None] * direction)[outside]
    pressure[outside] = 0
    data = {
        "reference": X, "velocity": v, "pressure": pressure, "density": np.full(len(X), 1000.0),
        "diameter": np.full(len(X), spacing), "outside": outside.astype(np.uint8),
    }  # fmt: skip
    return BodyFrame("water", x, NO_CELLS, data, {}, "fluid")


def lattice(spacing: float) -> np.ndarray:
    a = np.arange(-TANK + spacing / 2, TANK, spacing)
    z = np.arange(-HEIGHT / 2 + spacing / 2, HEIGHT / 2, spacing)
    X = np.stack(np.meshgrid(a, a, z, indexing="ij"), axis=-1).reshape(-1, 3)
    return X[np.hypot(X[:, 0], X[:, 1]) < TANK - 0.4 * spacing]


def write_tank(folder: Path, full: bool, spacing: float = 0.01, particles: float = 0.02, count: int = 8) -> RunFolder:
    scene = tank_scene(full, spacing)
    end = scene.duration
    mesh = generate(scene.shells[0].surface, scene.numerics)
    start = np.array([ball.centre for ball in scene.rigids[0].pinballs])
    X = lattice(particles)

    def frame(t: float, step: int) -> Frame:
        place, speed = shot_at(t, full)
        ball = ball_frame("ball", start + [place - start[0, 0], 0, 0], start, np.array([speed, 0, 0]), SHOT)
        bodies = [holed(t, mesh.points, mesh.cells, full, end), ball]
        return Frame(t, step, (*bodies, *([water(t, X, particles, end)] if full else [])))

    histories = {"rigid_ball": (RIGID_UNITS, flown(full, end))}
    if full:
        histories["leak"] = (LEAK_UNITS, leaked(LEAK, end))
    return _write(folder, scene, frame, count, histories, end)


def flown(full: bool, end: float) -> dict[str, np.ndarray]:
    """The history of the ball."""
    time = np.linspace(0, end, 400)
    x, v = np.array([shot_at(t, full) for t in time]).T
    zero = np.zeros_like(x)
    rigid = {"time": time, "x": x, "y": zero, "z": zero, "vx": v, "vy": zero, "vz": zero}
    rigid |= {"fx": 0.031 * np.gradient(v, time), "fy": zero, "fz": zero}
    return rigid | {"f_max": 1.25 * np.abs(rigid["fx"])}


def leaked(litres: float, end: float) -> dict[str, np.ndarray]:
    """The history of a leak of so many litres of water a second."""
    time = np.linspace(0, end, 400)
    rate, zero = np.where(time > 7e-4, litres, 0.0), np.zeros(400)
    mass = litres * np.clip(time - 7e-4, 0, None)
    return {
        "time": time, "escaped_mass": mass, "escaped_count": mass * 1e4, "rate": rate,
        "jet_speed": np.where(rate > 0, JET, np.nan), "jet_x": -1 + zero, "jet_y": zero, "jet_z": zero,
        "opening_area": 0.6 * OPENING * CRACK * np.clip((time - 6e-4) / 1e-3, 0, 1),
    }  # fmt: skip


APART = 0.25  # m, the middle of each of two tanks from that of both
SIDES = {"left": -APART, "right": APART}
LEAKS = {"left": LEAK, "right": 2 * LEAK}  # l/s


def two_tanks_scene(spacing: float = 0.02, **more: object) -> Scene:
    """Two full tanks side by side, each hit by its own ball."""
    one = tank_scene(True, spacing)
    wall, balls = one.shells[0].surface, one.rigids[0].pinballs

    def moved(pinball: Pinball, y: float) -> Pinball:
        return pinball.model_copy(update={"centre": (pinball.centre[0], y, pinball.centre[2])})

    def named(**parts: object) -> dict[str, object]:
        return {k: getattr(one, k) for k in ("source", "quality", "duration", "numerics", "output")} | parts

    return Scene(**named(
        name="drawn_two_tanks",
        title="Two tanks, a ball through each",
        shells=[
            one.shells[0].model_copy(update={"name": n, "surface": wall.model_copy(update={"origin": (0, y, -HEIGHT / 2)})})
            for n, y in SIDES.items()
        ],
        rigids=[
            one.rigids[0].model_copy(update={"name": f"ball_{n}", "pinballs": tuple(moved(b, y) for b in balls)}) for n, y in SIDES.items()
        ],
        fluids=[Fluid(name=f"water_{n}", fill=ShellFill(shell=n)) for n in SIDES],
        **more,
    ))  # fmt: skip


def write_two_tanks(folder: Path, spacing: float = 0.02, particles: float = 0.03, count: int = 4) -> RunFolder:
    scene = two_tanks_scene(spacing)
    end = scene.duration
    mesh = generate(tank_scene(True, spacing).shells[0].surface, scene.numerics)
    start = np.array([ball.centre for ball in tank_scene(True).rigids[0].pinballs])
    X = lattice(particles)

    def aside(body: BodyFrame, name: str, y: float) -> BodyFrame:
        by = np.array([0, y, 0])
        return replace(body, name=name, points=body.points + by, point_data={**body.point_data, "reference": body.reference + by})

    def frame(t: float, step: int) -> Frame:
        place, speed = shot_at(t, True)
        ball = ball_frame("ball", start + [place - start[0, 0], 0, 0], start, np.array([speed, 0, 0]), SHOT)
        tank, inside = holed(t, mesh.points, mesh.cells, True, end), water(t, X, particles, end)
        bodies = [(tank, ""), (inside, "water_"), (ball, "ball_")]
        return Frame(t, step, tuple(aside(body, prefix + n, y) for n, y in SIDES.items() for body, prefix in bodies))

    histories = {f"rigid_ball_{n}": (RIGID_UNITS, flown(True, end)) for n in SIDES}
    histories |= {f"leak_water_{n}": (LEAK_UNITS, leaked(litres, end)) for n, litres in LEAKS.items()}
    return _write(folder, scene, frame, count, histories, end)


def write_dam(folder: Path, spacing: float = 0.02, count: int = 6) -> RunFolder:
    """A column of water that falls apart: only a fluid."""
    scene = Scene(
        name="drawn_dam", title="Water column in a tank", source="tests", quality="draft", duration=0.4,
        numerics=Numerics(spacing=spacing), gravity=(0, 0, -9.81),
        rigids=[Rigid(name="block", pinballs=[Pinball(centre=(2.2, 0, 0.1), radius=0.1)], mass=4.0)],
    )  # fmt: skip
    x, z = np.meshgrid(np.arange(0.5 * spacing, 1.0, spacing), np.arange(0.5 * spacing, 0.5, spacing), indexing="ij")
    X = np.column_stack([x.ravel(), 0 * x.ravel(), z.ravel()])

    def frame(t: float, step: int) -> Frame:
        s = 1 + 6 * t**2 * np.exp(-X[:, 2] / 0.4)
        points = np.column_stack([X[:, 0] * s, X[:, 1], X[:, 2] / s])
        data = {
            "reference": X, "velocity": np.column_stack([12 * t * X[:, 0], 0 * t * X[:, 0], -2 * t * X[:, 2]]),
            "pressure": 9810 * np.clip(0.5 / s - points[:, 2], 0, None), "density": np.full(len(X), 1000.0),
            "diameter": np.full(len(X), spacing), "outside": np.zeros(len(X), dtype=np.uint8),
        }  # fmt: skip
        place = np.array([[2.2, 0, 0.1]])
        return Frame(
            t, step, (ball_frame("block", place, place, np.zeros(3), 0.1), BodyFrame("water", points, NO_CELLS, data, {}, "fluid"))
        )

    return _write(folder, scene, frame, count, {}, 0.4)


def write_pond(folder: Path, spacing: float = 0.02, count: int = 4) -> RunFolder:
    """Water on an elastic plate: nothing is struck and nothing can leak."""
    elastic = Material(name="plastic", young=4e8, poisson=0.3, density=4000)
    plate = Shell(name="plate", surface=Rectangle(length=0.2, width=0.2), thickness=5e-3, material=elastic, motion="free")
    scene = Scene(
        name="drawn_pond", title="Plate under water", source="tests", quality="draft", duration=0.2, shells=[plate],
        numerics=Numerics(spacing=spacing), gravity=(0, 0, -9.81),
    )  # fmt: skip
    mesh = generate(plate.surface, scene.numerics)
    places = [np.arange(0.5 * spacing, size, spacing) for size in (0.2, 0.2, 0.1)]
    X = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 3)
    none = np.zeros(len(mesh.cells))

    def frame(t: float, step: int) -> Frame:
        cell_data = {"damage": none, "broken": none.astype(np.uint8), "rupture_time": none + np.nan, "thickness": none + 5e-3}
        dry = BodyFrame("plate", mesh.points, mesh.cells, {"reference": mesh.points, "velocity": 0 * mesh.points}, cell_data)
        data = {
            "reference": X, "velocity": 0 * X, "pressure": 9810 * (0.1 - X[:, 2]), "density": np.full(len(X), 1000.0),
            "diameter": np.full(len(X), spacing), "outside": np.zeros(len(X), dtype=np.uint8),
        }  # fmt: skip
        return Frame(t, step, (dry, BodyFrame("water", X, NO_CELLS, data, {}, "fluid")))

    return _write(folder, scene, frame, count, {}, 0.2)


def _write(folder: Path, scene: Scene, frame, count: int, histories: dict, end: float) -> RunFolder:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.json").write_text(dump(scene))
    writer = FramesWriter(folder / "frames")
    for i, t in enumerate(np.linspace(0, end, count)):
        writer.append(frame(float(t), 100 * i))
    for name, (units, columns) in histories.items():
        write_history(folder / "histories" / f"{name}.csv", units, columns)
    time = np.linspace(0, end, 50)
    energies = {"time": time, "kinetic": 8000 - 1000 * time / end, "external": np.full(50, 8000.0), "B_percent": np.zeros(50)}
    write_history(folder / "histories/energies.csv", {"time": "s", "kinetic": "J", "external": "J", "B_percent": "%"}, energies)
    run = RunFolder(folder)
    how = {"command": "taichi-sph run drawn", "arch": "cpu", "threads": 2, "nodes": 1, "stress_points": 1, "steps": 100 * (count - 1)}
    write_summary(run, **how, seconds={"compile": 1.0, "advance": 1.0})
    return run

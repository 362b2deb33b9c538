"""A plate with a drawn crack whose path and speed are known: what the output tests measure."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from taichi_sph.frame import BodyFrame, Frame
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.frames import FramesWriter
from taichi_sph.output.histories import write_history
from taichi_sph.output.summary import write_summary
from taichi_sph.scene import Cut, Delay, Material, Mazars, Numerics, Plate, Quantity, Scene, Shell, dump

LENGTH, WIDTH = 0.1, 0.04  # m, the plate of B1
TIP = (0.05, 0.02)
SPEED = 1000.0  # m/s along the axis
BIFURCATION = 0.07  # m
ANGLE = np.radians(30)


def grid(spacing: float, triangles: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 3) and cells (M, 4) of the plate."""
    nx, ny = round(LENGTH / spacing) + 1, round(WIDTH / spacing) + 1
    x, y = np.meshgrid(np.linspace(0, LENGTH, nx), np.linspace(0, WIDTH, ny))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    corner = (np.arange(ny - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
    quads = np.column_stack([corner, corner + 1, corner + nx + 1, corner + nx]).astype(np.int32)
    if not triangles:
        return points, quads
    both = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return points, np.column_stack([both, np.full(len(both), -1)]).astype(np.int32)


def branched(spacing: float = 0.0005, branches: int = 2, triangles: bool = False) -> tuple[BodyFrame, np.ndarray]:
    """Body at rest and rupture times (M,) [s, nan while sound] of one crack, then `branches` (1 or 2).

    The front runs along x at SPEED; the branches leave at BIFURCATION under ANGLE.
    """
    points, cells = grid(spacing, triangles)
    corner = np.where(cells < 0, cells[:, :1], cells)
    centre = np.mean(points[corner], axis=1) if not triangles else np.mean(points[cells[:, :3]], axis=1)
    x, y = centre[:, 0], centre[:, 1] - TIP[1]
    slope = np.tan(ANGLE)
    reach = spacing * 0.75
    broken = (x > TIP[0]) & (x <= BIFURCATION) & (np.abs(y) < reach)
    if branches == 1:
        broken |= (x > BIFURCATION) & (np.abs(y) < reach)
    else:
        broken |= (x > BIFURCATION) & (np.abs(np.abs(y) - slope * (x - BIFURCATION)) < reach / np.cos(ANGLE))
    rupture = np.where(broken, 5e-6 + (x - TIP[0]) / SPEED, np.nan)
    body = BodyFrame("plate", points, cells, {"reference": points, "velocity": np.zeros_like(points)}, {})
    return body, rupture


def frame_at(body: BodyFrame, rupture: np.ndarray, time: float, step: int) -> Frame:
    """The drawn crack as it stands at `time`, opening slowly under a vertical pull."""
    broken = rupture <= time
    grown = np.nan_to_num(time - rupture + 2e-6, nan=-1.0)
    damage = np.where(broken, 1.0, np.clip(grown / 4e-6, 0, 0.95))
    y = body.points[:, 1] - TIP[1]
    passed = np.clip((TIP[0] + SPEED * time - body.points[:, 0]) / LENGTH, 0, 1)
    lift = np.zeros_like(body.points)
    lift[:, 1] = np.sign(y) * passed * 2e-5 * time / 5e-5
    centre = body.points[np.where(body.cells < 0, body.cells[:, :1], body.cells)].mean(axis=1)
    near = np.exp(-np.abs(centre[:, 1] - TIP[1]) / 0.003)
    return Frame(
        time,
        step,
        (
            BodyFrame(
                body.name,
                body.points + lift,
                body.cells,
                {"reference": body.points, "velocity": lift / max(time, 1e-9)},
                {
                    "damage": np.maximum(damage, 0.3 * near * (centre[:, 0] < TIP[0] + SPEED * time)),
                    "broken": broken.astype(np.uint8),
                    "rupture_time": np.where(broken, rupture, np.nan),
                },
            ),
        ),
    )


def frames(count: int = 11, duration: float = 6e-5, **options: object) -> list[Frame]:
    body, rupture = branched(**options)
    return [frame_at(body, rupture, t, 100 * i) for i, t in enumerate(np.linspace(0, duration, count))]


def plate_scene(**changes: object) -> Scene:
    """The drawn plate as a scene: B1 moved so that its corner is the origin."""
    concrete = Material(
        name="concrete",
        young=32e9,
        poisson=0.2,
        density=2450,
        damage=Mazars(threshold=8.5e-5, A=1, B=7300),
        delay=Delay(a=10, tau_c=1e-6),
        critical_damage=0.99,
    )
    scene = Scene(
        name="drawn_plate",
        title="Drawn crack in a plate",
        source="tests",
        quality="draft",
        shells=[
            Shell(
                name="plate",
                surface=Plate(length=LENGTH, width=WIDTH),
                thickness=0.004,
                material=concrete,
                cuts=[Cut(start=(0, TIP[1], 0), end=(*TIP, 0))],
            )
        ],
        duration=6e-5,
        numerics=Numerics(spacing=5e-4),
        quantities=[
            Quantity(name="branch_count", value=2, tolerance=0, source="drawn"),
            Quantity(name="edge_arrival", unit="s", value=5.5e-5, tolerance=1e-6, source="drawn"),
            Quantity(name="tip_speed_plateau", unit="m/s"),
            Quantity(name="asymmetry", value=0.0, tolerance=0.0),
        ],
    )
    return scene.derive(**changes) if changes else scene


def write_run(folder: Path, count: int = 7, scene: Scene | None = None, **options: object) -> RunFolder:
    """A finished run folder with frames, energies and a summary, as run.py leaves it."""
    scene = scene or plate_scene()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.json").write_text(dump(scene))
    writer = FramesWriter(folder / "frames")
    for frame in frames(count, **options):
        writer.append(frame)
    time = np.linspace(0, 6e-5, 50)
    released = 0.02 * np.clip(time / 6e-5 - 0.2, 0, 1)
    external, damage = 0.1 * (time / 6e-5) ** 2, 0.03 * (time / 6e-5) ** 3
    columns = {
        "time": time,
        "kinetic": 0.4 * (external - damage - released),
        "elastic": 0.6 * (external - damage - released),
        "damage": damage,
        "released": released,
        "external": external,
        "B_percent": np.full(50, -0.13),
        "closed_residual_percent": np.full(50, 0.02),
    }
    units = {k: "s" if k == "time" else "%" if k.endswith("percent") else "J" for k in columns}
    write_history(folder / "histories/energies.csv", units, columns)
    run = RunFolder(folder)
    write_summary(
        run,
        command="taichi-sph run drawn_plate",
        arch="cpu",
        threads=2,
        nodes=16281,
        stress_points=16000,
        steps=600,
        seconds={"compile": 4.0, "advance": 4.0},
    )
    return run

"""A stand-in for the simulation: one oscillating plate of four nodes, exact under restart, quick to build."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from taichi_sph.errors import RunStopped, SceneError
from taichi_sph.frame import BodyFrame, Frame
from taichi_sph.scene import Scene

STEPS = 40  # over the duration


class FakeWorld:
    """What run.py needs of a World; `stop_at` makes the watchdog bite at that step."""

    unset = ()
    stop_at: int | None = None
    on_step: Any = None  # called with the simulation after each step
    long: float | None = None  # s, a step; None: the duration over STEPS
    asked: list[dict[str, Any]] = []

    def __init__(self, scene: Scene, arch: str = "cpu", threads: int | None = None) -> None:
        if arch not in ("cpu",):
            raise SceneError(f"arch: '{arch}' is not known; choose one of cpu")
        type(self).asked.append({"scene": scene, "arch": arch, "threads": threads})
        self.scene = scene
        self.time, self.step, self.dt, self.dt_rule = 0.0, 0, type(self).long or scene.duration / STEPS, "a rule"
        self.n_nodes, self.stress_points, self.bytes, self.compile_seconds = 4, 1, 1000, 0.25
        self.compile_processor = 0.0
        self.x, self.v = 1.0, 0.0

    def advance_to(self, time: float) -> None:
        steps = math.ceil((time - self.time) / self.dt - 0.5e-6)
        for _ in range(steps):
            self.v -= 0.1 * self.x
            self.x += 0.1 * self.v
            self.time += self.dt
            self.step += 1
            if type(self).on_step:
                type(self).on_step(self)
            if self.step == type(self).stop_at:
                raise RunStopped("body 'plate', node 3 at (0, 1, 0) m, t = 1 us: velocity is not finite; the step is too long")

    def energies(self) -> dict[str, float]:
        return {
            "time": max(self.time - self.dt, 0.0),
            "kinetic": 0.5 * self.v**2,
            "elastic": 0.5 * self.x**2,
            "B_percent": 0.1,
            "closed_residual_percent": 0.01,
        }

    def status(self) -> dict[str, int]:
        return {"broken": self.step // 10, "loose nodes": 0}

    def tracks(self, look: bool = True) -> dict[str, dict[str, float]]:
        return {}

    def track_units(self) -> dict[str, dict[str, str]]:
        return {}

    def contact_report(self) -> None:
        return None

    def overlap_report(self) -> None:
        return None

    def frame(self) -> Frame:
        reference = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float) * 0.01

        def body(name: str, aside: float) -> BodyFrame:
            at = reference + [aside, 0, 0]
            return BodyFrame(
                name,
                at * self.x,
                np.array([[0, 1, 2, 3]], np.int32),
                {"reference": at, "velocity": np.full((4, 3), self.v)},
                {"damage": np.array([0.5]), "broken": np.array([0], np.uint8), "rupture_time": np.array([np.nan])},
            )

        return Frame(self.time, self.step, tuple(body(s.name, 0.02 * k) for k, s in enumerate(self.scene.shells)))

    def state(self) -> dict[str, np.ndarray]:
        return {"xv": np.array([self.x, self.v]), "time": np.array(self.time), "step": np.array(self.step)}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        if set(state) != {"xv", "time", "step"}:
            raise SceneError("checkpoint: it belongs to another scene")
        self.x, self.v = map(float, state["xv"])
        self.time, self.step = float(state["time"]), int(state["step"])

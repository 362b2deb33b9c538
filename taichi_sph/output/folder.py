"""The run folder: where everything of a run lies, and a reader of it.

DIR/scene.json record.json summary.json log.txt
    frames/<body>.vtkhdf  histories/<name>.csv  checkpoints/step_*.checkpoint  pictures/
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, FiniteFloat

from ..bodies.shell.said import PARTICLES
from ..errors import SceneError, nearest
from ..frame import Kind
from ..scene import Scene, load_scene
from ..scene.check import checked
from . import files
from .files import read_json, write_json
from .frames import SUFFIX, FramesFile
from .histories import History, read_history

__all__ = ["RunFolder", "read_json", "write_json"]


class Judged(BaseModel):
    """A quantity of a summary beside its target."""

    model_config = ConfigDict(strict=True, extra="allow")
    value: float | None
    unit: str
    target: float | None
    tolerance: float | None
    source: str
    met: bool | None


class Summary(BaseModel):
    """What every summary of a run or a study holds, and what is read of it if it is there."""

    model_config = ConfigDict(strict=True, extra="allow")
    scene: str
    title: str
    quality: str
    settings: dict[str, bool | int | FiniteFloat | str]
    command: str
    scene_hash: str
    commit: str | None
    nodes: int
    steps: int
    seconds: dict[str, FiniteFloat]
    node_steps_per_second: FiniteFloat | None = None
    B_percent: float | None
    closed_residual_percent: float | None
    quantities: dict[str, Judged]
    cases: list[str] = []
    failed: dict[str, str] = {}


def whole_summary(found: Any, path: Path) -> dict[str, Any]:
    """What was read as the summary of a run or a study; SceneError where it is none."""
    checked(Summary, lambda: Summary.model_validate(found), f"'{path}' is not the summary of a run: ")
    return found


class RunFolder:
    """Reads what a run wrote; nothing is opened before it is asked for."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._frames: dict[str, FramesFile] = {}
        if not self.path.is_dir():
            raise SceneError(f"there is no run folder '{self.path}'")
        files.check_links(self.path, files.RUN)

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        for file in self._frames.values():
            file.close()
        self._frames.clear()

    @cached_property
    def scene(self) -> Scene:
        path = self.path / "scene.json"
        if not path.is_file():
            raise SceneError(f"'{self.path}' is not a run folder: it holds no scene.json")
        return load_scene(path)

    @property
    def summary(self) -> dict[str, Any]:
        return whole_summary(read_json(self.path / "summary.json"), self.path / "summary.json")

    @property
    def record(self) -> dict[str, Any]:
        return read_json(self.path / "record.json")

    @property
    def checkpoints(self) -> Path:
        return self.path / "checkpoints"

    @property
    def pictures(self) -> Path:
        return self.path / "pictures"

    def bodies(self) -> list[str]:
        """Names of the bodies that have frames, in the scene's order, then by name."""
        order = [body.name for body in self.scene.bodies]
        found = {p.stem for p in (self.path / "frames").glob("*" + SUFFIX)}
        return [n for n in order if n in found] + sorted(found - set(order))

    def frames(self, body: str | None = None) -> FramesFile:
        """The frames of `body` (the first one when none is named: for what all have, such as times); kept open until `close`."""
        names = self.bodies()
        name = body if body is not None else next(iter(names), None)
        if name is None:
            raise SceneError(f"'{self.path}' holds no frames")
        if name not in names:
            raise SceneError(f"'{self.path}' holds no frames of a body '{name}'{nearest(name, names)}")
        if name not in self._frames:
            self._frames[name] = FramesFile(self.path / "frames" / (name + SUFFIX))
        return self._frames[name]

    def torn(self, body: str) -> str:
        """Of a shell in parts the name of its particles, of all others their own."""
        particles = body + PARTICLES
        return particles if particles in self.bodies() else body

    def of_kind(self, kind: Kind) -> list[FramesFile]:
        """The frames of all bodies of a kind."""
        return [file for name in self.bodies() if (file := self.frames(name)).kind == kind]

    def the(self, kind: Kind, body: str | None = None) -> FramesFile:
        """The frames of a body of a kind: the one that is named, else the only one there is; of a shell in parts its particles, which may
        break."""
        if body is not None:
            file = self.frames(self.torn(body))
            if file.kind != kind:
                others = ", ".join(f.name for f in self.of_kind(kind))
                raise SceneError(f"body '{body}' is a {file.kind}, and a {kind} is needed: {others or 'the run has none'}")
            return file
        files = [file for file in self.of_kind(kind) if self.torn(file.name) == file.name]
        if not files:
            raise SceneError(f"'{self.path}' holds no frames of a {kind}")
        if len(files) > 1:
            raise SceneError(f"the run has {len(files)} bodies of kind {kind}: name one of {', '.join(f.name for f in files)}")
        return files[0]

    def histories(self) -> list[str]:
        return sorted(p.stem for p in (self.path / "histories").glob("*.csv"))

    def history(self, name: str) -> History:
        names = self.histories()
        if name not in names:
            raise SceneError(f"'{self.path}' holds no history '{name}'{nearest(name, names)}")
        return read_history(self.path / "histories" / f"{name}.csv")

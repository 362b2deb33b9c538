"""Every test here works in an empty folder, with its own cache, and with the stand-in where it asks for it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from taichi_sph import cli

from ..scene.examples import GOOD
from .fake import FakeWorld


@pytest.fixture(autouse=True)
def work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "work"
    folder.mkdir()
    monkeypatch.chdir(folder)
    monkeypatch.setenv("TAICHI_SPH_CACHE", str(tmp_path / "cache"))
    return folder


@pytest.fixture
def scene_file(work: Path) -> Path:
    path = work / "small.json"
    path.write_text(json.dumps(GOOD))
    return path


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> type[FakeWorld]:
    """Runs use the stand-in; `stop_at` and `on_step` may be set on it."""
    import sys
    import types

    module = types.ModuleType("taichi_sph.world.world")
    kind = type("Fake", (FakeWorld,), {"asked": []})
    module.World = kind  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "taichi_sph.world.world", module)
    return kind


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """call("run", "x", ...) -> exit code, stdout, stderr."""

    def run(*arguments: str) -> tuple[int, str, str]:
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main(arguments=list(arguments))
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run


def files(folder: Path) -> dict[str, bytes]:
    """Everything below a folder."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}

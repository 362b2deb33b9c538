"""The wheel: what is in it, and that it runs a scene where there is no checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("wheel")
    done = subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", out], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (found,) = out.glob("*.whl")
    return found


def test_what_is_in_it(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    modules = {str(path.relative_to(ROOT)) for path in (ROOT / "taichi_sph").rglob("*.py")}
    scenes = {f"taichi_sph/{path.relative_to(ROOT)}" for path in (ROOT / "scenes").glob("*.py")}
    about = {name.partition(".dist-info/")[2] for name in names if ".dist-info/" in name}
    assert modules | scenes | {"taichi_sph/py.typed"} <= names
    assert {"METADATA", "entry_points.txt", "licenses/LICENSE"} <= about
    assert not [name for name in names if not name.startswith("taichi_sph") or "/tests/" in name or "__pycache__" in name]


def test_its_description(wheel):
    with zipfile.ZipFile(wheel) as content:
        (name,) = (name for name in content.namelist() if name.endswith("METADATA"))
        said = content.read(name).decode()
    for line in ("License-Expression: Apache-2.0", "Description-Content-Type: text/markdown", "Author: The taichi_sph engineers"):
        assert line in said.splitlines()


@pytest.mark.long
@pytest.mark.timeout(1200)
def test_it_runs_a_scene_without_the_checkout(wheel, tmp_path):
    """A fresh environment, an empty folder: the scene comes out of the wheel."""
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "-q", "-c", ROOT / "requirements.lock", wheel], check=True)
    empty = tmp_path / "empty"
    empty.mkdir()
    env = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    for arguments in (["validate", "tank_leak"], ["run", "plate_modes", "--set", "edges=free", "--set", "nodes=regular", "--out", "out"]):
        command = [python.with_name("taichi-sph"), *arguments]
        done = subprocess.run(command, cwd=empty, env=env, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    assert (empty / "out" / "summary.json").is_file()

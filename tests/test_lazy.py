"""Heavy packages wait until they are needed: each line runs in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HEAVY = ("taichi", "vtk", "vtkmodules", "pyvista", "matplotlib", "PIL", "distributed", "pyarrow")  # SciPy itself looks at dask


def loaded(code: str, *arguments: str, cwd: Path = ROOT) -> tuple[set[str], str]:
    """Which heavy packages a piece of code loads, and what it prints."""
    watch = "import sys, json, atexit; atexit.register(lambda: print('|' + json.dumps(sorted({m.split('.')[0] for m in sys.modules}))))\n"
    done = subprocess.run([sys.executable, "-c", watch + code, *arguments], capture_output=True, text=True, cwd=cwd)
    out, _, names = done.stdout.rpartition("|")
    return set(json.loads(names)) & {*HEAVY, "pint", "scipy", "meshio", "h5py"}, out + done.stderr


@pytest.mark.parametrize("name", ["taichi_sph", "taichi_sph.scene", "taichi_sph.errors", "taichi_sph.cli", "taichi_sph.run.session"])
def test_imports(name):
    found, _ = loaded(f"import {name}")
    assert not found & set(HEAVY), found
    assert "pint" not in found and "meshio" not in found


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["run", "--help"], ["validate", "crack_branching"]], ids=" ".join)
def test_command_line(arguments):
    found, said = loaded("from taichi_sph.cli import main; main()", *arguments)
    heavy = set(HEAVY) - ({"dask"} if "pint" in found else set())  # pint looks at dask by itself where that is installed
    assert not found & heavy, found
    assert "taichi-sph" in said or "Usage" in said or "valid" in said


def test_the_output_reads_and_writes_without_taichi_or_vtk():
    found, said = loaded("import taichi_sph.output.summary, taichi_sph.output.frames, taichi_sph.output.answer")
    assert not found & set(HEAVY), said


def test_version_and_scripts():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"]["taichi-sph"] == "taichi_sph.cli:main"
    assert "version" in project["dynamic"]


def test_every_dependency_is_locked():
    import re

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = project["dependencies"] + sum(project["optional-dependencies"].values(), [])
    lines = [line for line in (ROOT / "requirements.lock").read_text().splitlines() if line and not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+==[A-Za-z0-9_.+-]+", line) for line in lines)
    locked = {line.partition("==")[0].lower().replace("_", "-") for line in lines}
    for requirement in wanted:
        name = re.match(r"[A-Za-z0-9_.-]+", requirement)[0].lower()
        assert name in locked and "<" in requirement, f"{requirement} is not locked or has no upper bound"


def test_the_readme_and_the_automatic_run_use_the_same_line():
    command = (ROOT / ".ci" / "run").read_text().rstrip().splitlines()[-1]
    assert command in (ROOT / "README.md").read_text(encoding="utf-8")


def test_no_name_of_the_scene_is_that_of_a_module():
    """A module that is loaded takes the place of a name of its package: `materials` was a function until some other name was asked for."""
    import pkgutil

    import taichi_sph.scene

    assert not set(taichi_sph.scene.__all__) & {module.name for module in pkgutil.iter_modules(taichi_sph.scene.__path__)}

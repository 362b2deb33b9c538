"""The house rule: a module imports only from rooms to its left and from the leaves (read from the source)."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "taichi_sph"
LAYERS = [
    *("scene", "geometry", "bodies", "couplings", "observers", "world", "output", "render", "run", "studies", "verification"),
    *("cli", "__main__"),
]
# what a leaf itself may use
LEAF_USES = {
    "errors": set(),
    "frame": set(),
    "runtime": {"errors"},
    "pool": {"errors", "runtime"},
    "numerics": {"errors", "runtime", "pool"},
    "laws": {"errors", "runtime", "numerics"},
}
LEAVES = set(LEAF_USES)
EXCEPTIONS = {("bodies", "couplings")}  # a fluid still makes what wets it
SAID = {
    "errors",
    "scene.base",
    "scene.kinds",
    "scene.units",
    "scene.materials",
    "scene.surfaces",
    "scene.regions",
    "scene.histories",
}  # what a said.py may use


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def part_of(path: Path) -> str:
    relative = path.relative_to(PACKAGE)
    return relative.parts[0] if len(relative.parts) > 1 else relative.stem


def imported(path: Path) -> set[str]:
    """Dotted names inside the package that a file imports, at its head or inside functions."""
    package = ["taichi_sph", *path.relative_to(PACKAGE).parts[:-1]]
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.split(".")[0] == "taichi_sph"}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = [*base, *(node.module.split(".") if node.module else [])]
            if base[:1] == ["taichi_sph"]:
                found |= {".".join([*base, alias.name]) for alias in node.names}
    return {name.removeprefix("taichi_sph").lstrip(".") for name in found} - {"", "__version__"}


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_leftward(path):
    here = part_of(path)
    for name in imported(path):
        there = name.split(".")[0]
        if here == "scene" and name in ("bodies", "couplings"):  # which kinds there are; what they say is a part of the scene
            continue
        if path.name == "said.py":  # what the user says of a body or a coupling: a part of the scene that lives beside its code
            assert ".".join(name.split(".")[:2]) in SAID or there in SAID, f"{path} imports {name}: what is said knows nothing of how"
        elif (here, name.split(".")[0]) in EXCEPTIONS:
            continue
        elif there == here or name.split(".")[-2:-1] == ["said"] or name.endswith(".said"):
            continue
        elif here in LEAF_USES:
            assert there in LEAF_USES[here], f"the leaf {here} imports {name}"
        elif here in LAYERS:
            assert there in set(LAYERS[: LAYERS.index(here)]) | LEAVES, f"{here} imports {name}, which stands to its right"
        else:
            assert here == "__init__", f"{here} belongs to no layer: give it one here"


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_only_the_runtime_imports_taichi_and_only_render_draws(path):
    heads = {
        (alias.name if isinstance(node, ast.Import) else node.module or "").split(".")[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, (ast.Import, ast.ImportFrom)) and not getattr(node, "level", 0)
        for alias in node.names
    }
    if path.name != "runtime.py":
        assert "taichi" not in heads
    if part_of(path) not in ("render", "doctor"):
        assert not heads & {"pyvista", "vtk", "vtkmodules", "matplotlib", "PIL"}

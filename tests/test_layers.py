"""The house rule: a module imports only from what stands above it in the map and from the leaves (read from the source)."""

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
    "frontend": set(),
    "launch": set(),
    "memory": set(),
    "runtime": {"errors", "frontend", "launch", "memory"},
    "pool": {"errors", "runtime"},
    "numerics": {"errors", "runtime", "pool"},
    "laws": {"errors", "runtime", "numerics"},
}
LEAVES = set(LEAF_USES)
NEXT_TO_TAICHI = {"runtime", "frontend", "launch", "memory"}
SHARED = {"nodal", "shell"}  # what kinds share
EXCEPTIONS = {  # module: what it still knows and should not; an entry that is not needed any more fails
    "couplings.wetted.coupling": {"bodies.fluid"},  # the one interaction that is of fluids by its nature
    "couplings.wetted.wetted": {"bodies.fluid"},
}
SAID = {
    "errors",
    "scene.base",
    "scene.kinds",
    "scene.units",
    "scene.laws",
    "scene.surfaces",
    "scene.solids",
    "scene.regions",
    "scene.histories",
}  # what a said.py may use


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")


def part_of(path: Path) -> str:
    return module_of(path).split(".")[0]


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


def room(name: str) -> str:
    """'bodies.fluid' of 'bodies.fluid.pool.Particles': a kind of body or an interaction; empty for all that is neither."""
    parts = name.split(".")
    inside = len(parts) > 1 and parts[0] in ("bodies", "couplings") and (PACKAGE / parts[0] / parts[1]).is_dir()
    return ".".join(parts[:2]) if inside and parts[1] not in SHARED else ""


def said(name: str) -> bool:
    return "said" in name.split(".")


def wrong(path: Path) -> set[str]:
    """What a module imports and must not."""
    here, module, found = part_of(path), module_of(path), set()
    own = room(f"{module}.")
    for name in imported(path):
        there = name.split(".")[0]
        if path.name == "said.py":  # what the user says of a body or a coupling: a part of the scene that lives beside its code
            parts = name.split(".")
            right = there in SAID or ".".join(parts[:2]) in SAID or (said(name) and parts[1] in SHARED)
        elif here == "scene" and name in ("bodies", "couplings"):  # which kinds there are; what they say is a part of the scene
            right = True
        elif said(name):
            right = True
        elif here in LEAF_USES:
            right = there == here or there in LEAF_USES[here]
        elif here in LAYERS:
            right = there == here or there in {*LAYERS[: LAYERS.index(here)], *LEAVES}
        else:
            right = here == "taichi_sph" or module == "__init__"
        if right and room(name) and not said(name) and here in ("bodies", "couplings", "world", "observers"):
            right = room(name) == own  # a kind knows no other kind, a coupling and the world know none
        if not right:
            found.add(name)
    return found


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_upward(path):
    excused = EXCEPTIONS.get(module_of(path), set())
    found = wrong(path)
    assert not {name for name in found if room(name) not in excused}, found
    assert excused == {room(name) for name in found}, "an exception is not needed any more: take it out"


def test_exceptions_are_of_modules_that_are_there():
    assert set(EXCEPTIONS) <= {module_of(path) for path in modules()}


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_only_the_runtime_imports_taichi_and_only_render_draws(path):
    heads = {
        (alias.name if isinstance(node, ast.Import) else node.module or "").split(".")[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, (ast.Import, ast.ImportFrom)) and not getattr(node, "level", 0)
        for alias in node.names
    }
    if module_of(path) not in NEXT_TO_TAICHI:
        assert "taichi" not in heads
    if part_of(path) not in ("render", "doctor"):
        assert not heads & {"pyvista", "vtk", "vtkmodules", "matplotlib", "PIL"}


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_no_module_with_kernels_puts_its_annotations_off(path):
    """Taichi reads the annotations of a kernel: they must not be strings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    off = any(isinstance(node, ast.ImportFrom) and node.module == "__future__" for node in tree.body)
    kernels = [
        node.name
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and {"ti.kernel", "ti.func"} & {ast.unparse(d) for d in node.decorator_list}
        and any(argument.annotation is not None for argument in node.args.args)
    ]
    assert not (off and kernels), kernels

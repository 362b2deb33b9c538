"""Every function outside kernels says the types of what it takes and gives: mypy passes over those that do not."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "taichi_sph"
KERNEL = {"func", "kernel", "real_func"}  # of Taichi, which reads their source: their types are its own


def outside_kernels(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            if any(isinstance(d, ast.Attribute) and d.attr in KERNEL for d in node.decorator_list):
                continue
            yield node
        yield from outside_kernels(node)


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_functions_say_their_types(path: Path):
    bare = []
    for function in outside_kernels(ast.parse(path.read_text(encoding="utf-8"))):
        a = function.args
        named = [*a.posonlyargs, *a.args, *a.kwonlyargs]
        if any(arg.annotation is None for arg in named if arg.arg not in ("self", "cls")):
            bare.append(f"{function.name} (line {function.lineno}): an argument")
        if function.returns is None and function.name != "__init__":
            bare.append(f"{function.name} (line {function.lineno}): what it returns")
    assert not bare, "; ".join(bare)

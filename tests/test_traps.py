"""What Taichi 1.7.4 does wrong without a word, and no kernel of the package may ask for."""

import ast
from collections import defaultdict
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "taichi_sph"


def late_constants(function: ast.FunctionDef) -> list[str]:
    """Accesses like `rows[k][3]` that follow one like `rows[k][j]` to the same row: Taichi takes the 3 as a number of bytes then."""
    loops = [n for n in ast.walk(function) if isinstance(n, ast.For) and ast.unparse(n.iter).startswith("ti.static(")]
    static = {t.id for n in loops for t in ast.walk(n.target) if isinstance(t, ast.Name)}
    rows = defaultdict(list)
    for n in ast.walk(function):
        if isinstance(n, ast.Subscript) and isinstance(n.value, ast.Subscript) and not isinstance(n.value.value, ast.Subscript):
            varies = {x.id for x in ast.walk(n.slice) if isinstance(x, ast.Name)} - static
            rows[ast.unparse(n.value)].append((n.lineno, bool(varies), ast.unparse(n)))
    found = []
    for uses in rows.values():
        uses.sort(key=lambda use: use[0])
        if uses[0][1]:
            found += [text for _, varies, text in uses if not varies and not text.endswith("[0]")]
    return found


def test_a_row_is_not_asked_for_a_number_and_then_for_a_constant():
    for path in sorted(PACKAGE.rglob("*.py")):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef) and {"ti.kernel", "ti.func"} & {ast.unparse(d) for d in function.decorator_list}:
                assert not late_constants(function), f"{path.name}, {function.name}: {late_constants(function)}"


def test_it_would_be_seen():
    (bad,) = ast.parse("def f():\n    for j in range(3):\n        c[k][j] = m\n        c[k][3] = m\n").body
    assert isinstance(bad, ast.FunctionDef) and late_constants(bad) == ["c[k][3]"]

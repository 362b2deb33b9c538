"""What README, the other pages and docstrings name is there: every path, every file of a module, every symbol of the code."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted(p for p in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "benchmarks").rglob("*.md")))
LINK = re.compile(r"!?\[[^\]]*\]\(([^)#\s]*)(?:#[^)]*)?\)")
FILE = re.compile(r"(?<![\w/.-])((?:[\w-]+/)*[\w-]+\.(?:py|json|md|gif|png|toml|lock))\b")
WRITTEN = ("DIR/", "pictures/", "summary.json", "record.json", "both.png")  # by runs
MADE = {"scenes/x.py", "x.py", "scene.py"}  # what a reader is to write
UNDRAWN = {"taichi_sph/output/measures"}


def files() -> set[str]:
    """Every file of the checkout, by its path and by all ends of the path."""
    found = set()
    for folder in ("taichi_sph", "scenes", "tests", "benchmarks", "docs", "renders"):
        for path in (ROOT / folder).rglob("*"):
            parts = path.relative_to(ROOT).parts
            found |= {"/".join(parts[k:]) for k in range(len(parts))}
    return found | {path.name for path in ROOT.iterdir()}


@pytest.fixture(scope="module")
def known() -> set[str]:
    return files()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_pages(page, known):
    text = page.read_text(encoding="utf-8")
    links = {link for link in LINK.findall(text) if link and "://" not in link}
    lost = {link for link in links if not (page.parent / link).exists()}
    lost |= {name for name in FILE.findall(LINK.sub("", text)) if name not in known | MADE and not name.startswith(WRITTEN)}
    assert not lost, sorted(lost)


@pytest.mark.parametrize("path", sorted((ROOT / "taichi_sph").rglob("*.py")), ids=lambda p: str(p.relative_to(ROOT)))
def test_docstrings(path, known):
    """Paths in docstrings: those with a folder in them."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    texts = [ast.get_docstring(n) or "" for n in ast.walk(tree) if isinstance(n, (ast.Module, ast.ClassDef, ast.FunctionDef))]
    lost = {
        name for text in texts for name in FILE.findall(text) if "/" in name and name not in known | MADE and not name.startswith(WRITTEN)
    }
    assert not lost, sorted(lost)


def test_the_map_of_the_folders():
    """The README's map names each folder of the package, and nothing that is not there."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    drawn = readme.partition("## Map")[2].partition("```\n")[2].partition("```")[0]
    named, above = set(), {0: ROOT}
    for line in (line for line in drawn.splitlines() if not line.startswith(" " * 12)):
        inside, name = len(line) - len(line.lstrip()), line.split()[0]
        above[inside + 2] = path = above[inside] / name
        assert path.exists(), f"{path.relative_to(ROOT)} is drawn and is not there"
        named.add(path)
    folders = {path.parent for path in (ROOT / "taichi_sph").rglob("__init__.py")}
    assert not (left := {str(path.relative_to(ROOT)) for path in folders - named} - UNDRAWN), f"not drawn: {sorted(left)}"


def test_the_symbols():
    """Each name in the code that the table of symbols gives stands somewhere in the package."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    table = readme.partition("## Symbols")[2].partition("\n## ")[0]
    code = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "taichi_sph").rglob("*.py"))
    for line in table.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 3 and cells[1] not in ("in the code", "---"):
            for name in re.findall(r"`([\w.]+)`", cells[1]):
                last = name.rpartition(".")[2]
                assert re.search(rf"\b{re.escape(last)}\b", code), f"{name} is nowhere in the code"

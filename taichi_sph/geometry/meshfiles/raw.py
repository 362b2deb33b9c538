"""What every reader of a mesh file gives, and what the readers of text files share: lines with their numbers, strict
numbers, one sentence for what is wrong."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from ...errors import SceneError

LARGEST = 2**31 - 2  # number of a node or an element that a file may use


@dataclass
class Raw:
    """What a file says. points (N, 3) in the file's unit; cells (M, 4) rows of `points`, -1 behind a triangle.

    node_ids (N,), cell_ids (M,): the file's own numbers; of a file without them its order, from `first`.
    owners: the instance that a node (node_owner) or a cell (cell_owner) belongs to, where numbers repeat.
    regions: rows of cells by name. thickness: in the file's unit, by region. notes: what was read otherwise than
    written. unit: of length [m], where the file says so. shared: points in one place are one node (no connectivity).
    """

    points: np.ndarray
    cells: np.ndarray
    node_ids: np.ndarray
    cell_ids: np.ndarray
    first: int | None = None
    node_owner: np.ndarray | None = None
    cell_owner: np.ndarray | None = None
    owners: tuple[str, ...] = ()
    regions: dict[str, np.ndarray] = field(default_factory=dict)
    thickness: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    unit: float | None = None
    shared: bool = False
    cell_word: str = "cell"

    def node(self, row: int) -> str:
        """How the file names a node."""
        owner = "" if self.node_owner is None else self.owners[self.node_owner[row]] + "."
        return f"{owner}{self.node_ids[row]}"

    def cell(self, row: int) -> str:
        """How the file names a cell."""
        owner = "" if self.cell_owner is None else self.owners[self.cell_owner[row]] + "."
        return f"{owner}{self.cell_ids[row]}"


class Text:
    """The lines of a text file and where the reader stands, for its sentences."""

    def __init__(self, path: Path):
        data = path.read_bytes()
        self.name = path.name
        if b"\0" in data:
            raise refused(f"mesh {self.name} is no text file: a zero byte stands at {data.index(0)}")
        self.lines = data.decode("utf-8", errors="replace").splitlines()
        self.number = 0

    def __iter__(self) -> Iterator[str]:
        while self.number < len(self.lines):
            self.number += 1
            yield self.lines[self.number - 1]

    def fail(self, why: str, line: int | None = None) -> NoReturn:
        raise refused(f"mesh {self.name}, line {line or self.number}: {why}")

    def integer(self, text: str, what: str = "a whole number") -> int:
        """A number of a node or an element, 0 to 2^31."""
        digits = text.strip()
        if len(digits) < 10 and digits.isdecimal():
            return int(digits)
        if not (digits.isascii() and digits.lstrip("+-").isdigit() and len(digits) < 20):
            self.fail(f"{shown(text)} stands where {what} should")
        value = int(digits)
        if abs(value) > LARGEST:
            self.fail(f"{shown(text)} is no number of a node or an element: at most {LARGEST}")
        return value

    def real(self, text: str, what: str = "a number") -> float:
        """A finite number; the exponent may be Fortran's (1.0D-3)."""
        try:
            value = float(text)
        except ValueError:
            try:
                value = float(text.replace("d", "e").replace("D", "e"))
            except ValueError:
                value = math.nan
        if not math.isfinite(value) or "_" in text:
            self.fail(f"{shown(text)} stands where {what} should")
        return value


def refused(why: str) -> SceneError:
    """The error of a sentence: on one line, whatever names and words of the file stand in it."""
    plain = "".join(c if c.isprintable() else "?" for c in why)
    return SceneError(plain if len(plain) <= 390 else f"{plain[:380]} ...")


def shown(text: str) -> str:
    """A piece of the file on one line, in quotes."""
    plain = "".join(c if c.isprintable() else "?" for c in text.strip())
    return f"'{plain[:40]}{'...' if len(plain) > 40 else ''}'"


def fixed(line: str, *widths: int) -> list[str]:
    """The fields of a line of fixed columns, stripped; empty where the line is short."""
    fields, start = [], 0
    for width in widths:
        fields.append(line[start : start + width].strip())
        start += width
    return fields


class Nodes:
    """Nodes by number, as they come: each once, or again in the same place."""

    def __init__(self, text: Text):
        self.text = text
        self.row: dict[int, int] = {}
        self.points: list[tuple[float, float, float]] = []

    def add(self, number: int, point: tuple[float, float, float]) -> None:
        if number <= 0:
            self.text.fail(f"node {number}: nodes have numbers from 1")
        before = self.row.get(number)
        if before is None:
            self.row[number] = len(self.points)
            self.points.append(point)
        elif self.points[before] != point:
            self.text.fail(f"node {number} is given twice, in two places")


class Cells:
    """Cells as they come: number, corners by node number, region; the line of each for sentences."""

    def __init__(self, text: Text):
        self.text = text
        self.seen: dict[int, int] = {}
        self.corners: list[tuple[int, ...]] = []
        self.lines: list[int] = []
        self.regions: dict[str, list[int]] = {}

    def add(self, number: int, corners: tuple[int, ...], region: str | None = None) -> int:
        if number <= 0:
            self.text.fail(f"element {number}: elements have numbers from 1")
        if number in self.seen:
            self.text.fail(f"element {number} is given twice (first in line {self.lines[self.seen[number]]})")
        if len(corners) == 4 and corners[3] in (corners[2], 0):
            corners = corners[:3]  # how LS-DYNA, Radioss and others write a triangle
        row = self.seen[number] = len(self.corners)
        self.corners.append(corners)
        self.lines.append(self.text.number)
        if region is not None:
            self.regions.setdefault(region, []).append(row)
        return row

    def numbers(self) -> np.ndarray:
        return np.fromiter(self.seen, np.int64, len(self.seen))

    def arrays(self, nodes: Nodes) -> np.ndarray:
        """(M, 4) rows of nodes."""
        result = np.full((len(self.corners), 4), -1, np.int64)
        row = nodes.row
        for k, corners in enumerate(self.corners):
            for c, number in enumerate(corners):
                at = row.get(number)
                if at is None:
                    which = list(self.seen)[k]
                    self.text.fail(f"element {which} refers to node {number}, which the file does not give", self.lines[k])
                result[k, c] = at
        return result


def raw(nodes: Nodes, cells: Cells, **more: object) -> Raw:
    """The `Raw` of a file with one numbering."""
    return Raw(
        points=np.array(nodes.points, np.float64).reshape(-1, 3),
        cells=cells.arrays(nodes),
        node_ids=np.fromiter(nodes.row, np.int64, len(nodes.row)),
        cell_ids=cells.numbers(),
        regions={name: np.array(rows, np.int64) for name, rows in cells.regions.items()},
        cell_word="element",
        **more,  # type: ignore[arg-type]
    )


def left_out(counts: dict[str, int]) -> list[str]:
    """The note of what stands beside the shells: '12 B31, 3 MASS left out'."""
    return [", ".join(f"{n} {kind}" for kind, n in counts.items()) + " left out: a shell is made of its shell elements"] if counts else []

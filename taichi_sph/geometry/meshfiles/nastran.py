"""Nastran bulk data (.bdf, .nas): GRID in any coordinate system, CQUAD4, CTRIA3 and their kin, PSHELL.

Small, large and free fields. Each property is a region "pid N". Eight- and six-node elements give their corners.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .raw import Cells, Nodes, Raw, Text, left_out, raw, refused, shown

SHELLS = {"CQUAD4": (4, 4, 6), "CQUADR": (4, 4, 6), "CTRIA3": (3, 3, 5), "CTRIAR": (3, 3, 5), "CQUAD8": (4, 8, 13), "CTRIA6": (3, 6, 8)}
BESIDE = tuple("CBAR CBEAM CBEND CROD CONROD CTUBE CBUSH CELAS CONM CMASS CDAMP CVISC CGAP CWELD CFAST CSEAM RBE RBAR RROD RSPLINE".split())
BESIDE += tuple("PLOTEL CBEAM3 CBUSH1D CBUSH2D CSHEAR GENEL".split())
SOLIDS = tuple("CHEXA CPENTA CTETRA CPYRAM CTRIAX CQUADX CHEX20 CHACAB".split())
# cards that begin with C and are neither elements nor systems
HARMLESS = tuple("CAERO CORD3G CREEP CSET CSUPER CSUPEXT CLOAD CYAX CYJOIN CYSUP CYSYM CBARAO COMBWLD CONV CONTRLT CAMPBLL CIFQUAD".split())
BARE = re.compile(r"([+-]?[0-9.]+)([+-][0-9]+)$")  # 1.5-3 is 1.5e-3


def read(path: Path) -> Raw:
    return _Reader(Text(path)).read()


class _Reader:
    def __init__(self, text: Text):
        self.text = text
        self.grids: dict[int, tuple[int, tuple[float, float, float], int]] = {}  # number: system, coordinates, line
        self.systems: dict[int, tuple[str, list[str], int]] = {}
        self.ready: dict[int, tuple[str, np.ndarray, np.ndarray]] = {0: ("R", np.zeros(3), np.eye(3))}
        self.open: list[int] = []
        self.beside: dict[str, int] = {}
        self.offsets = self.dropped = 0

    def read(self) -> Raw:
        text, cells = self.text, Cells(self.text)
        thickness: dict[str, float] = {}
        default = 0
        waiting: list[tuple[int, int, tuple[float, float, float], int]] = []
        for name, f in self._cards():
            if name in SHELLS:
                corners, count, offset = SHELLS[name]
                number = self._int(f, 0)
                pid = self._int(f, 1, number)
                own = [self._int(f, k) for k in range(2, 2 + corners)]
                if count > corners:
                    self.dropped += 1
                if f[offset : offset + 1] not in ([], [""]) and self._real(f, offset) != 0.0:
                    self.offsets += 1
                if any(n <= 0 for n in own):
                    text.fail(f"element {number} lacks a node")
                cells.add(number, tuple(own), f"pid {pid}")
            elif name == "GRID":
                number = self._int(f, 0)
                at = (self._real(f, 2), self._real(f, 3), self._real(f, 4))
                waiting.append((number, self._int(f, 1, -1), at, text.number))
            elif name == "GRDSET":
                default = self._int(f, 1, 0)
            elif name in ("CORD2R", "CORD2C", "CORD2S"):
                self._keep(self._int(f, 0), name, f)
            elif name in ("CORD1R", "CORD1C", "CORD1S"):
                self._keep(self._int(f, 0), name, f[:4])
                if len(f) > 4 and f[4]:
                    self._keep(self._int(f, 4), name, f[4:8])
            elif name == "PSHELL":
                if len(f) > 2 and f[2]:
                    thickness[f"pid {self._int(f, 0)}"] = self._real(f, 2)
            elif name.startswith("INCLUDE"):
                text.fail("INCLUDE is not followed: merge the files")
            elif name.startswith(SOLIDS):
                text.fail(f"{name} is a solid; a shell is made of CQUAD4 and CTRIA3")
            elif name.startswith(BESIDE):
                self.beside[name] = self.beside.get(name, 0) + 1
            elif name.startswith("C") and not name.startswith(HARMLESS):
                text.fail(f"card {shown(name)} is not known; shells are CQUAD4, CTRIA3, CQUADR, CTRIAR, CQUAD8 and CTRIA6")
            elif name in ("SEBULK", "SELOC", "SEMPLN", "SPOINT1") or name.startswith("BEGIN"):
                text.fail(f"{name}: superelements are not followed")
        for number, system, at, line in waiting:
            before = self.grids.get(number)
            system = default if system < 0 else system
            if before and before[:2] != (system, at):
                text.fail(f"node {number} is given twice, in two places", line)
            self.grids[number] = (system, at, line)
        nodes = Nodes(text)
        for number, point in self._placed().items():
            nodes.add(number, point)
        if not cells.corners:
            raise refused(
                f"mesh {text.name} has no shell elements (CQUAD4, CTRIA3){'; ' + left_out(self.beside)[0] if self.beside else ''}"
            )
        notes = left_out(self.beside)
        if self.offsets:
            notes.append(f"offsets (ZOFFS) of {self.offsets} elements are not followed: the nodes are the mid-surface")
        if self.dropped:
            notes.append("elements with nodes at the middle of their sides: their corners only")
        return raw(nodes, cells, thickness={k: v for k, v in thickness.items() if k in cells.regions}, notes=notes)

    def _keep(self, number: int, name: str, f: list[str]) -> None:
        if number <= 0:
            self.text.fail(f"{name}: a coordinate system has a number from 1")
        if number in self.systems and self.systems[number][:2] != (name, f):
            self.text.fail(f"coordinate system {number} is given twice")
        self.systems[number] = (name, f, self.text.number)

    def _cards(self) -> Iterator[tuple[str, list[str]]]:
        """(name, fields) of each card of the bulk data; `text.number` is the line of its name meanwhile."""
        text = self.text
        begin = next((k for k, line in enumerate(text.lines) if re.match(r"\s*BEGIN\s*(,|\s)?\s*BULK", line, re.I)), None)
        for line in text.lines[:begin]:
            if begin is not None and re.match(r"\s*INCLUDE\b", line, re.I):
                text.fail("INCLUDE is not followed: merge the files", text.lines.index(line) + 1)
        text.number = 0 if begin is None else begin + 1
        name, fields, at, ended, before = "", [], 0, False, ""
        for line in text:
            line = line.split("$")[0].rstrip()
            if not line:
                continue
            if re.match(r"\s*INCLUDE\b", line, re.I):
                text.fail("INCLUDE is not followed: merge the files")
            first, more, mark = self._split(line)
            if first.upper().startswith("ENDDATA"):
                ended = True
                break
            if not first or first[0] in "+*":
                if not name:
                    text.fail(f"{shown(line)} continues no card")
                here = first.lstrip("+*").strip()
                if here and before and here.upper() != before.upper():
                    text.fail(f"continuation {shown(first)} stands behind a card that goes on with {shown(before)}: sort the lines")
                fields += more
                before = mark
                continue
            if first.startswith("="):
                text.fail("cards repeated with = are not followed: write each card")
            if name:
                number, text.number = text.number, at
                yield name, fields
                text.number = number
            name, fields, at, before = first.rstrip("*").strip().upper(), more, text.number, mark
        if begin is not None and not ended:
            text.fail("the file has no ENDDATA: it is cut off")
        if name:
            text.number = at
            yield name, fields

    def _split(self, line: str) -> tuple[str, list[str], str]:
        """Name (or continuation mark), the data fields of a line, 8 or, large, 4, and the mark behind them."""
        if "," in line:
            first, *more = [f.strip() for f in line.split(",")]
            size = 4 if first.endswith("*") or first.startswith("*") else 8
            if len(more) > size + 1:
                self.text.fail(f"{shown(line)} has {len(more)} fields behind its name; at most {size} and a continuation mark")
            mark = more[size] if len(more) > size else ""
        else:
            line = line.expandtabs(8)
            first = line[:8].strip()
            mark = line[72:80].strip()
            size, width = (4, 16) if "*" in first else (8, 8)
            more = [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(size)]
        return first, (more + [""] * size)[:size], mark.lstrip("+*").strip()

    def _int(self, f: list[str], k: int, missing: int | None = None) -> int:
        text = f[k] if k < len(f) else ""
        if not text:
            if missing is not None:
                return missing
            self.text.fail(f"field {k + 2} is empty; a whole number should stand there")
        return self.text.integer(text)

    def _real(self, f: list[str], k: int) -> float:
        text = f[k] if k < len(f) else ""
        if not text:
            return 0.0
        bare = BARE.match(text)
        return self.text.real(f"{bare[1]}e{bare[2]}" if bare else text)

    def _system(self, number: int, line: int) -> tuple[str, np.ndarray, np.ndarray]:
        """Kind (R, C, S), origin and rows x, y, z of a system, in the basic one."""
        if number in self.ready:
            return self.ready[number]
        if number not in self.systems:
            self.text.fail(f"coordinate system {number} is not given (CORD2R, CORD2C, CORD2S, CORD1R, CORD1C, CORD1S)", line)
        if number in self.open or len(self.open) > 100:
            self.text.fail(f"coordinate system {number} rests on itself", line)
        name, f, at = self.systems[number]
        self.open.append(number)
        self.text.number = at
        if name.startswith("CORD1"):
            points = np.array([self._grid(self._int(f, k), at) for k in (1, 2, 3)])
        else:
            given = np.array([[self._real(f, 2 + 3 * p + c) for c in range(3)] for p in range(3)])
            points = self._in_basic(self._int(f, 1, 0), given, at)
        self.open.pop()
        a, z = points[0], points[1] - points[0]
        y = np.cross(z, points[2] - a)
        if not np.linalg.norm(y) > 1e-9 * np.linalg.norm(z) * np.linalg.norm(points[2] - a):
            self.text.fail(f"the points of coordinate system {number} lie on one line: they give no axes", at)
        y, z = y / np.linalg.norm(y), z / np.linalg.norm(z)
        self.ready[number] = (name[-1], a, np.stack([np.cross(y, z), y, z]))
        return self.ready[number]

    def _in_basic(self, system: int, points: np.ndarray, line: int) -> np.ndarray:
        """(N, 3) coordinates of a system in the basic one."""
        kind, origin, axes = self._system(system, line)
        if kind == "C":
            r, theta, z = points[:, 0], np.radians(points[:, 1]), points[:, 2]
            points = np.column_stack([r * np.cos(theta), r * np.sin(theta), z])
        elif kind == "S":
            r, theta, phi = points[:, 0], np.radians(points[:, 1]), np.radians(points[:, 2])
            points = np.column_stack([r * np.sin(theta) * np.cos(phi), r * np.sin(theta) * np.sin(phi), r * np.cos(theta)])
        return points if system == 0 else origin + points @ axes

    def _grid(self, number: int, line: int) -> np.ndarray:
        if number not in self.grids:
            self.text.fail(f"a coordinate system refers to node {number}, which the file does not give", line)
        system, at, where = self.grids[number]
        return self._in_basic(system, np.array([at]), where)[0]

    def _placed(self) -> dict[int, tuple[float, float, float]]:
        by: dict[int, list[int]] = {}
        for number, (system, _, _) in self.grids.items():
            by.setdefault(system, []).append(number)
        points: dict[int, tuple[float, float, float]] = {}
        for system, numbers in by.items():
            if system == 0:
                points |= {n: self.grids[n][1] for n in numbers}
                continue
            at = self._in_basic(system, np.array([self.grids[n][1] for n in numbers]), self.grids[numbers[0]][2])
            points |= {n: tuple(p) for n, p in zip(numbers, at.tolist())}
        self.text.number = len(self.text.lines)
        return {n: points[n] for n in self.grids if math.isfinite(sum(points[n])) or self._lost(n)}

    def _lost(self, number: int) -> bool:
        self.text.fail(f"node {number} has no finite place", self.grids[number][2])

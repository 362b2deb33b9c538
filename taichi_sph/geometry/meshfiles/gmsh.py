"""Gmsh meshes (.msh), version 2.2 and 4.1, text and binary: triangles and quadrangles of first order, physical groups as regions.

A cell that stands in several groups is written several times in version 2.2: it is one cell in all of them.
"""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

import numpy as np

from .raw import LARGEST, Raw, refused, shown

# number of nodes by type; what is no shell by name
NODES = {1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 10: 9, 11: 10, 12: 27, 13: 18, 14: 14, 15: 1, 16: 8, 17: 20, 18: 15, 19: 13}
NODES |= {20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 26: 4, 27: 5, 28: 6}
BESIDE = (15, 1, 8, 26, 27, 28)  # points and curves of the geometry
SOLID = {4: "tetra", 5: "hexahedron", 6: "wedge", 7: "pyramid", 9: "triangle6", 10: "quad9", 16: "quad8", 11: "tetra10"}


def read(path: Path) -> Raw:
    return _Reader(path).read()


class _Reader:
    def __init__(self, path: Path):
        self.name, self.data, self.place = path.name, path.read_bytes(), 0
        self.binary = False
        self.order = "<"

    def fail(self, why: str) -> NoReturn:
        line = self.data.count(b"\n", 0, self.place) + 1
        raise refused(f"mesh {self.name}, {'byte ' + str(self.place) if self.binary else 'line ' + str(line)}: {why}")

    def read(self) -> Raw:
        if self.data.lstrip()[:1] == b"(":
            self.fail("this is a mesh of ANSYS Fluent, not of Gmsh; write it as .vtu or .obj (with meshio: file_format='gmsh')")
        self.section("MeshFormat")
        version, kind, size = (self.line().split() + ["", "", ""])[:3]
        if version not in ("2.2", "2", "2.1", "4.1"):
            self.fail(f"version {shown(version)} of Gmsh's format is not supported: save it as 4.1 or 2.2")
        if kind not in ("0", "1") or size != "8":
            self.fail("the line behind $MeshFormat is not 'version, 0 or 1, 8'")
        self.binary = kind == "1"
        if self.binary:
            one = self.data[self.place : self.place + 4]
            self.order = (
                "<"
                if one == b"\1\0\0\0"
                else ">"
                if one == b"\0\0\0\1"
                else self.fail("the number 1 that shows the order of bytes is missing")
            )
            self.place += 4
        self.end("MeshFormat")
        names: dict[tuple[int, int], str] = {}
        physical: dict[tuple[int, int], list[int]] = {}
        nodes: tuple[np.ndarray, np.ndarray] | None = None
        elements: tuple[np.ndarray, np.ndarray, list[list[int]]] | None = None
        seen: set[str] = set()
        while (section := self.next_section()) is not None:
            if section in seen:
                self.fail(f"${section} is there twice")
            seen.add(section)
            match section:
                case "PhysicalNames":
                    names = self.names()
                case "Entities":
                    physical = self.entities()
                case "Nodes":
                    nodes = self.nodes4() if version == "4.1" else self.nodes2()
                case "Elements":
                    elements = self.elements4(physical) if version == "4.1" else self.elements2()
                case "PartitionedEntities":
                    self.fail("a partitioned mesh is not supported: save it whole")
                case _:
                    self.skip(section)
                    continue
            self.end(section)
        if nodes is None or elements is None:
            self.fail("the file ends without its $Nodes and $Elements: it is cut off")
        return self.made(nodes, elements, names)

    # lines, sections, numbers
    def line(self) -> str:
        stop = self.data.find(b"\n", self.place)
        if stop < 0:
            stop = len(self.data)
        if self.place >= len(self.data):
            self.fail("the file ends too early: it is cut off")
        text = self.data[self.place : stop].decode("utf-8", errors="replace")
        self.place = stop + 1
        return text.strip()

    def next_section(self) -> str | None:
        while self.place < len(self.data):
            line = self.line()
            if line.startswith("$"):
                return line[1:]
            if line:
                self.fail(f"{shown(line)} stands between sections")
        return None

    def section(self, name: str) -> None:
        found = self.next_section()
        if found != name:
            self.fail(f"${name} is missing: this is no mesh of Gmsh")

    def end(self, name: str) -> None:
        while (line := self.line()) == "":
            pass
        if line != f"$End{name}":
            self.fail(f"{shown(line)} stands where $End{name} should: the counts of the section do not fit")

    def skip(self, name: str) -> None:
        stop = self.data.find(f"$End{name}".encode(), self.place)
        if stop < 0:
            self.fail(f"${name} has no end: the file is cut off")
        self.place = stop
        self.line()

    def count(self, text: str) -> int:
        if not (text.isascii() and text.isdigit() and int(text[:19]) <= len(self.data)):
            self.fail(f"{shown(text)} is no count that fits the length of the file")
        return int(text)

    def take(self, kind: str, number: int) -> np.ndarray:
        """`number` values: i (int32), n (size_t), d (double); of a binary file."""
        dtype = np.dtype(self.order + {"i": "i4", "n": "u8", "d": "f8"}[kind])
        if not 0 <= number * dtype.itemsize <= len(self.data) - self.place:
            self.fail("the file ends too early: it is cut off")
        values = np.frombuffer(self.data, dtype, number, self.place)
        self.place += number * dtype.itemsize
        if kind == "n":
            if number and values.max() > LARGEST:
                self.fail(f"{values.max()} is no number of a node or an element")
            return values.astype(np.int64)
        return values.astype(np.float64 if kind == "d" else np.int64)

    def whole(self, words: list[str], least: int = 1) -> list[int]:
        if len(words) < least or not all(w.lstrip("-").isascii() and w.lstrip("-").isdigit() and len(w) < 12 for w in words):
            self.fail(f"{shown(' '.join(words))}: at least {least} whole numbers should stand there")
        return [int(w) for w in words]

    def reals(self, words: list[str]) -> list[float]:
        try:
            values = [float(w) for w in words[:3] if "_" not in w]
        except ValueError:
            values = []
        if len(values) != 3:
            self.fail(f"{shown(' '.join(words))}: three coordinates should stand there")
        return values

    # sections
    def names(self) -> dict[tuple[int, int], str]:
        names = {}
        for _ in range(self.count(self.line())):
            line = self.line()
            words = line.split(None, 2)
            dim, tag = self.whole(words[:2], 2)
            names[dim, tag] = "".join(c for c in words[2].strip().strip('"') if c.isprintable()) if len(words) > 2 else str(tag)
        return names

    def entities(self) -> dict[tuple[int, int], list[int]]:
        """Physical groups of surfaces, by dimension and number of the entity."""
        found: dict[tuple[int, int], list[int]] = {}
        counts = self.take("n", 4).tolist() if self.binary else self.whole(self.line().split(), 4)[:4]
        for dim, number in enumerate(counts):
            if not 0 <= number <= len(self.data):
                self.fail(f"{number} is no count that fits the length of the file")
            for _ in range(number):
                if self.binary:
                    tag = int(self.take("i", 1)[0])
                    self.take("d", 3 if dim == 0 else 6)
                    groups = self.take("i", int(self.take("n", 1)[0])).tolist()
                    if dim:
                        self.take("i", int(self.take("n", 1)[0]))
                else:
                    words = self.line().split()
                    at = 4 if dim == 0 else 7
                    tag, n = self.whole([*words[:1], *words[at : at + 1]], 2)
                    groups = self.whole(words[at + 1 : at + 1 + n], max(n, 0)) if n else []
                found[dim, tag] = groups
        return found

    def nodes2(self) -> tuple[np.ndarray, np.ndarray]:
        n = self.count(self.line())
        if self.binary:
            size = 28 * n
            if size > len(self.data) - self.place:
                self.fail("the file ends too early: it is cut off")
            rows = np.frombuffer(self.data, np.dtype([("n", self.order + "i4"), ("x", self.order + "f8", 3)]), n, self.place)
            self.place += size
            return rows["n"].astype(np.int64), rows["x"].astype(np.float64)
        ids, points = [], []
        for _ in range(n):
            words = self.line().split()
            ids += self.whole(words[:1])
            points.append(self.reals(words[1:]))
        return np.array(ids, np.int64), np.array(points).reshape(-1, 3)

    def nodes4(self) -> tuple[np.ndarray, np.ndarray]:
        blocks, total, *_ = self.take("n", 4).tolist() if self.binary else self.whole(self.line().split(), 4)
        ids, points = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
        for _ in range(blocks):
            if self.binary:
                dim, _, parametric = self.take("i", 3).tolist()
                n = int(self.take("n", 1)[0])
                ids.append(self.take("n", n))
                width = 3 + (dim if parametric else 0)
                if not 3 <= width <= 6:
                    self.fail(f"{dim} is no dimension of an entity")
                points.append(self.take("d", width * n).reshape(n, width)[:, :3])
            else:
                *_, n = self.whole(self.line().split(), 4)
                n = self.count(str(n))
                ids.append(np.array([self.whole(self.line().split())[0] for _ in range(n)], np.int64))
                points.append(np.array([self.reals(self.line().split()) for _ in range(n)]).reshape(-1, 3))
        if sum(len(i) for i in ids) != total:
            self.fail(f"{total} nodes are announced, {sum(len(i) for i in ids)} are there")
        return np.concatenate(ids), np.concatenate(points)

    def elements2(self) -> tuple[np.ndarray, np.ndarray, list[list[int]]]:
        """Numbers, corners by node number (M, 4), physical groups of each."""
        total = self.count(self.line())
        ids, corners, groups = [], [], []

        def add(kind: int, number: int, tags: list[int], nodes: list[int]) -> None:
            if kind in BESIDE:
                return
            self.check(kind, nodes)
            ids.append(number)
            corners.append((nodes + [-1])[:4])
            groups.append(tags[:1] if tags and tags[0] else [])

        done = 0
        while done < total:
            if self.binary:
                kind, n, tags = self.take("i", 3).tolist()
                if kind not in NODES or n <= 0 or tags < 0 or n + done > total:
                    self.fail(f"{n} elements of type {kind} with {tags} tags: no such block")
                width = 1 + tags + NODES[kind]
                for row in self.take("i", n * width).reshape(n, width).tolist():
                    add(kind, row[0], row[1 : 1 + tags], row[1 + tags :])
                done += n
            else:
                number, kind, tags, *rest = self.whole(self.line().split(), 3)
                if kind not in NODES or tags < 0 or len(rest) != tags + NODES[kind]:
                    self.fail(f"element {number} has {len(rest)} numbers; type {kind} with {tags} tags has other ones")
                add(kind, number, rest[:tags], rest[tags:])
                done += 1
        return np.array(ids, np.int64), np.array(corners, np.int64).reshape(-1, 4), groups

    def elements4(self, physical: dict[tuple[int, int], list[int]]) -> tuple[np.ndarray, np.ndarray, list[list[int]]]:
        blocks, total, *_ = self.take("n", 4).tolist() if self.binary else self.whole(self.line().split(), 4)
        ids, corners, groups, seen = [], [], [], 0
        for _ in range(blocks):
            if self.binary:
                dim, tag, kind = self.take("i", 3).tolist()
                n = int(self.take("n", 1)[0])
            else:
                dim, tag, kind, n = self.whole(self.line().split(), 4)[:4]
                n = self.count(str(n))
            if kind not in NODES:
                self.fail(f"type {kind} of elements is not known")
            width = 1 + NODES[kind]
            rows = (
                self.take("n", n * width).reshape(n, width).tolist()
                if self.binary
                else [self.whole(self.line().split(), width) for _ in range(n)]
            )
            seen += n
            if kind in BESIDE:
                continue
            for row in rows:
                if len(row) != width:
                    self.fail(f"element {row[0]} has {len(row) - 1} nodes; type {kind} has {width - 1}")
                self.check(kind, row[1:])
                ids.append(row[0])
                corners.append((row[1:] + [-1])[:4])
                groups.append(physical.get((dim, tag), []))
        if seen != total:
            self.fail(f"{total} elements are announced, {seen} are there")
        return np.array(ids, np.int64), np.array(corners, np.int64).reshape(-1, 4), groups

    def check(self, kind: int, nodes: list[int]) -> None:
        if kind not in (2, 3):
            self.fail(f"an element is of type '{SOLID.get(kind, kind)}'; a shell is made of triangles and quadrangles of first order")
        if min(nodes) <= 0:
            self.fail(f"{min(nodes)} is no number of a node")

    def made(
        self,
        found: tuple[np.ndarray, np.ndarray],
        elements: tuple[np.ndarray, np.ndarray, list[list[int]]],
        names: dict[tuple[int, int], str],
    ) -> Raw:
        (ids, points), (numbers, corners, groups) = found, elements
        row = {int(n): k for k, n in enumerate(ids)}
        if len(row) < len(ids):
            number, count = np.unique(ids, return_counts=True)
            raise refused(f"mesh {self.name}: node {number[np.argmax(count)]} is given {count.max()} times")
        once: dict[tuple[int, ...], int] = {}
        cells: list[list[int]] = []
        keep: list[int] = []
        regions: dict[int, dict[int, bool]] = {}
        for k, nodes in enumerate(corners.tolist()):
            missing = next((n for n in nodes if n >= 0 and n not in row), None)
            if missing is not None:
                raise refused(f"mesh {self.name}: element {numbers[k]} refers to node {missing}, which the file does not give")
            tags = [abs(t) for t in groups[k]]
            key = tuple(sorted(nodes))
            before = once.get(key)
            if before is not None and tags and not any(before in regions.get(t, ()) for t in tags):
                place = before  # the same cell again, in another group
            else:
                place = once[key] = len(cells)
                cells.append([row[n] if n >= 0 else -1 for n in nodes])
                keep.append(k)
            for t in tags:
                regions.setdefault(t, {})[place] = True
        named = {names.get((2, t), str(t)): np.array(list(rows), np.int64) for t, rows in regions.items()}
        return Raw(points, np.array(cells, np.int64).reshape(-1, 4), ids, numbers[keep], regions=named, cell_word="element")

"""Surfaces as text or as bytes: OBJ, PLY, STL, OFF. Numbers of nodes and cells are their order in the file.

Counts are held against the length of the file before anything is read by them.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, Protocol

import numpy as np

from .raw import Raw, Text, refused, shown

SCALARS = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"}
SCALARS |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
REFUSED_IN_OBJ = ("curv", "curv2", "surf", "cstype", "call", "csh", "bzp", "bsp", "cdc", "res", "trace_obj")


Property = tuple[str, str, str | None]  # name, dtype, dtype of the length of a list
Taker = Callable[[str, int, list[Property]], dict[str, Any]]  # name, count, properties of an element -> columns


class Fail(Protocol):
    """Raises what is wrong with a file."""

    def __call__(self, why: str) -> NoReturn: ...


def _raw(points: list | np.ndarray, cells: list | np.ndarray, first: int, **more: object) -> Raw:
    points = np.array(points, np.float64).reshape(-1, 3)
    cells = np.array(cells, np.int64).reshape(-1, 4)
    return Raw(points, cells, first + np.arange(len(points)), first + np.arange(len(cells)), first=first, **more)  # type: ignore[arg-type]


def _corners(count: int) -> str:
    return f"has {count} corners; a shell is made of triangles and quadrangles"


def obj(path: Path) -> Raw:
    """Faces in any notation (v, v/t, v//n, v/t/n), numbers from 1 or, negative, back from the latest; groups and objects are regions."""
    text = Text(path)
    points: list[tuple[float, ...]] = []
    cells: list[list[int]] = []
    lines: list[int] = []
    regions: dict[str, list[int]] = {}
    group: list[str] = []
    body: list[str] = []
    beside = 0
    held = ""
    for line in text:
        line = held + line.split("#")[0]
        if line.endswith("\\"):
            held = line[:-1] + " "
            continue
        held = ""
        words = line.split()
        if not words:
            continue
        match words[0]:
            case "v":
                if not 4 <= len(words) <= 8:
                    text.fail(f"{shown(line)} is no vertex: x, y, z")
                points.append(tuple(text.real(w, "a coordinate") for w in words[1:4]))
            case "f":
                if len(words) not in (4, 5):
                    text.fail(f"face {len(cells) + 1} {_corners(len(words) - 1)}")
                corners = []
                for w in words[1:]:
                    parts = w.split("/")
                    if len(parts) > 3:
                        text.fail(f"{shown(w)} is no corner of a face: v, v/t, v//n or v/t/n")
                    numbers = [text.integer(p, "a corner of a face (v, v/t, v//n or v/t/n)") for p in parts if p]
                    n = numbers[0] if parts[0] else 0
                    row = n - 1 if n > 0 else len(points) + n
                    if n == 0 or row < 0:
                        text.fail(f"face {len(cells) + 1} refers to vertex {shown(w)}, which does not exist")
                    corners.append(row)
                for name in dict.fromkeys(group + body):
                    regions.setdefault(name, []).append(len(cells))
                cells.append((corners + [-1])[:4])
                lines.append(text.number)
            case "g":
                group = words[1:]
            case "o":
                body = [" ".join(words[1:])] if words[1:] else []
            case "l" | "p":
                beside += 1
            case (
                "vn"
                | "vt"
                | "vp"
                | "s"
                | "usemtl"
                | "mtllib"
                | "usemap"
                | "maplib"
                | "lod"
                | "shadow_obj"
                | "mg"
                | "bevel"
                | "c_interp"
                | "d_interp"
            ):
                pass
            case _:
                text.fail(f"{shown(words[0])} is no keyword for a surface of faces (v, f, g, o)")
    if held:
        text.fail("the last line goes on (\\) and the file ends")
    for row, corners in enumerate(cells):
        if max(corners) >= len(points):
            text.fail(f"face {row + 1} refers to vertex {max(corners) + 1}; the file has {len(points)}", lines[row])
    notes = [f"{beside} lines and points left out"] if beside else []
    return _raw(points, cells, 1, regions={n: np.array(r, np.int64) for n, r in regions.items()}, notes=notes, cell_word="face")


def off(path: Path) -> Raw:
    text = Text(path)
    words: list[str] = []
    rows: list[tuple[int, list[str]]] = []
    for line in text:
        words = line.split("#")[0].split()
        if words:
            rows.append((text.number, words))
    if not rows or rows[0][1][0] != "OFF":
        text.fail("the file does not begin with OFF; its variants (COFF, NOFF, BINARY) are not supported", 1)
    rest = rows[0][1][1:]
    rows = ([(rows[0][0], rest)] if rest else []) + rows[1:]
    if not rows or len(rows[0][1]) < 2:
        text.fail("the numbers of vertices and faces are missing")
    text.number = rows[0][0]
    n, m = (text.integer(w) for w in rows[0][1][:2])
    if n < 0 or m < 0 or len(rows) - 1 != n + m:
        text.fail(f"{n} vertices and {m} faces are announced, and {len(rows) - 1} lines follow")
    points: list[list[float]] = []
    cells: list[list[int]] = []
    for text.number, words in rows[1 : n + 1]:
        if len(words) < 3:
            text.fail(f"{shown(' '.join(words))} is no vertex: x, y, z")
        points.append([text.real(w, "a coordinate") for w in words[:3]])
    for text.number, words in rows[n + 1 :]:
        count, *corners = (text.integer(w) for w in words[:5])
        if count not in (3, 4):
            text.fail(f"face {len(cells)} {_corners(count)}")
        if len(corners) < count or not all(0 <= c < n for c in corners[:count]):
            text.fail(f"face {len(cells)} refers to a vertex that does not exist ({n} vertices, counted from 0)")
        cells.append((corners[:count] + [-1])[:4])
    return _raw(points, cells, 0, cell_word="face")


def stl(path: Path) -> Raw:
    """Facets; corners in one place are one node. Each `solid` of a text file is a region."""
    data = path.read_bytes()
    fail = _failing(path)
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if count >= 0 and len(data) == 84 + 50 * count:
        facets = np.frombuffer(data, np.dtype([("normal", "<f4", 3), ("points", "<f4", (3, 3)), ("more", "<u2")]), count, 84)
        points = facets["points"].astype(np.float64).reshape(-1, 3)
        regions: dict[str, list[int]] = {}
    elif data[:1024].lstrip()[:5].lower() == b"solid" and b"\0" not in data:
        corners: list[list[float]] = []
        regions = {}
        name, state = "", -1  # state: corners of the open facet, -1 outside
        ended = True
        text = Text(path)
        for line in text:
            words = line.split()
            if not words:
                continue
            match words[0].lower():
                case "solid":
                    if not ended:
                        text.fail("a solid begins inside another")
                    name, ended = " ".join(words[1:]), False
                case "facet":
                    if state >= 0 or ended:
                        text.fail("a facet begins inside another, or outside a solid")
                    state = 0
                case "vertex":
                    if len(words) != 4 or not 0 <= state < 3:
                        text.fail(f"{shown(line)} is no corner of a triangle")
                    corners.append([text.real(w, "a coordinate") for w in words[1:]])
                    state += 1
                case "endfacet":
                    if state != 3:
                        text.fail(f"a facet has {max(state, 0)} corners; it needs three")
                    regions.setdefault(name, []).append(len(corners) // 3 - 1)
                    state = -1
                case "endsolid":
                    if ended or state >= 0:
                        text.fail("endsolid ends no solid")
                    ended = True
                case "outer" | "endloop":
                    pass
                case _:
                    text.fail(f"{shown(words[0])} is no word of an STL file")
        if not ended:
            text.fail("the file ends inside a solid: it is cut off")
        points = np.array(corners, np.float64).reshape(-1, 3)
        regions.pop("", None)
    elif count >= 0:
        fail(f"{count} triangles are announced, {84 + 50 * count} bytes; the file has {len(data)}: it is cut off or no STL")
    else:
        fail("the file is no STL: it has neither 'solid' nor 84 bytes of header")
    triangles = np.arange(len(points)).reshape(-1, 3)
    cells = np.column_stack([triangles, np.full(len(triangles), -1)])
    found = {n: np.array(r, np.int64) for n, r in regions.items()}
    return _raw(points, cells, 1, regions=found, shared=True, cell_word="facet")


def ply(path: Path) -> Raw:
    data = path.read_bytes()
    fail = _failing(path)
    if data[:4] not in (b"ply\n", b"ply\r"):
        fail("the file does not begin with 'ply'")
    end = data.find(b"end_header")
    stop = data.find(b"\n", end)
    if end < 0:
        fail("the header has no end_header: it is cut off")
    stop = len(data) if stop < 0 else stop + 1
    kind, elements = _ply_header(data[:end].decode("latin-1"), fail)
    body = data[stop:]
    points, cells = np.zeros((0, 3)), np.zeros((0, 4), np.int64)
    least = sum(count * max(1, sum(1 if kind == "ascii" else np.dtype(p[1]).itemsize for p in props)) for _, count, props in elements)
    if least > len(body):
        fail(f"its header announces at least {least} bytes; {len(body)} follow: it is cut off")
    take = _ascii_taker(body, fail) if kind == "ascii" else _binary_taker(body, ORDERS[kind], fail)
    for name, count, props in elements:
        columns = take(name, count, props)
        if name == "vertex":
            if not all(isinstance(columns.get(c), np.ndarray) for c in "xyz"):
                fail("its vertices lack x, y or z")
            points = np.column_stack([columns[c] for c in "xyz"]).astype(np.float64)
        elif name == "face":
            lists = next((columns[c] for c in ("vertex_indices", "vertex_index") if c in columns), None)
            if not isinstance(lists, list):
                fail("its faces have no list vertex_indices")
            cells = np.full((count, 4), -1, np.int64)
            for row, corners in enumerate(lists):
                if len(corners) not in (3, 4):
                    fail(f"face {row} {_corners(len(corners))}")
                cells[row, : len(corners)] = corners
            wrong = (cells[:, :3] < 0).any(axis=1) | (cells >= len(points)).any(axis=1)
            if wrong.any():
                fail(f"face {int(np.argmax(wrong))} refers to a vertex that does not exist ({len(points)} vertices, counted from 0)")
        elif name in ("tristrips",):
            fail("its surface is written as strips (tristrips); write faces")
    take("", 0, [])
    return _raw(points, cells, 0, cell_word="face")


def _ply_header(header: str, fail: Fail) -> tuple[str, list[tuple[str, int, list[Property]]]]:
    """Format and elements: name, count, properties (name, dtype, dtype of the length of a list)."""
    kind = ""
    elements: list[tuple[str, int, list[Property]]] = []
    for line in header.splitlines()[1:]:
        words = line.split()
        match words:
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", found, _] if found in ORDERS:
                kind = found
            case ["element", name, count] if count.isascii() and count.isdigit() and len(count) < 12:
                elements.append((name, int(count), []))
            case ["property", "list", size, value, name] if elements and {size, value} <= SCALARS.keys() and SCALARS[size][0] != "f":
                elements[-1][2].append((name, SCALARS[value], SCALARS[size]))
            case ["property", value, name] if elements and value in SCALARS:
                elements[-1][2].append((name, SCALARS[value], None))
            case _:
                fail(f"{shown(line)} is no line of a PLY header")
    if not kind:
        fail("the header names no format (ascii, binary_little_endian, binary_big_endian)")
    for names in ([e[0] for e in elements], *([p[0] for p in e[2]] for e in elements)):
        if len(set(names)) < len(names):
            fail("the header announces an element or a property twice")
    return kind, elements


def _ascii_taker(body: bytes, fail: Fail) -> Taker:
    words = body.split()
    place = 0

    def real(word: bytes) -> float:
        try:
            return float(word) if b"_" not in word else np.nan
        except ValueError:
            fail(f"{shown(word.decode('latin-1'))} stands where a number should")

    def whole(word: bytes) -> int:
        if not (word.lstrip(b"+-").isdigit() and len(word) < 12):
            fail(f"{shown(word.decode('latin-1'))} stands where a whole number should")
        return int(word)

    def take(name: str, count: int, props: list[Property]) -> dict[str, Any]:
        nonlocal place
        columns: dict[str, list] = {p[0]: [] for p in props}
        if not name and place < len(words):
            fail(f"{len(words) - place} numbers stand behind the last element: the counts of its header do not fit")
        for _ in range(count):
            for prop, dtype, size in props:
                length = 1
                if place >= len(words):
                    fail("the file ends too early: it is cut off")
                if size:
                    length = whole(words[place])
                    place += 1
                    if not 0 <= length <= len(words) - place:
                        fail("a list is longer than the file: it is cut off")
                taken = words[place : place + length]
                place += length
                values = [real(w) if dtype[0] == "f" else whole(w) for w in taken]
                columns[prop].append(values if size else values[0])
        return {n: c if p[2] else np.array(c, np.float64) for p, (n, c) in zip(props, columns.items())}

    return take


def _binary_taker(body: bytes, order: str, fail: Fail) -> Taker:
    place = 0

    def take(name: str, count: int, props: list[Property]) -> dict[str, Any]:
        nonlocal place
        if not name:
            if place < len(body):
                fail(f"{len(body) - place} bytes stand behind the last element: the counts of its header do not fit")
            return {}
        if not any(p[2] for p in props):
            row = np.dtype([(f"p{k}", order + p[1]) for k, p in enumerate(props)])
            if count * row.itemsize > len(body) - place:
                fail("the file ends too early: it is cut off")
            rows = np.frombuffer(body, row, count, place)
            place += count * row.itemsize
            return {p[0]: rows[f"p{k}"].astype(np.float64) for k, p in enumerate(props)}
        columns: dict[str, list] = {p[0]: [] for p in props}
        for _ in range(count):
            for prop, dtype, size in props:
                length = 1
                if size:
                    where = np.dtype(order + size)
                    if place + where.itemsize > len(body):
                        fail("the file ends too early: it is cut off")
                    length = int(np.frombuffer(body, where, 1, place)[0])
                    place += where.itemsize
                what = np.dtype(order + dtype)
                if not 0 <= length * what.itemsize <= len(body) - place:
                    fail("a list is longer than the file: it is cut off")
                values = np.frombuffer(body, what, length, place)
                place += length * what.itemsize
                columns[prop].append(values.tolist() if size else float(values[0]))
        return {n: c if p[2] else np.array(c, np.float64) for p, (n, c) in zip(props, columns.items())}

    return take


def _failing(path: Path) -> Fail:
    def fail(why: str) -> NoReturn:
        raise refused(f"mesh {path.name}: {why}")

    return fail

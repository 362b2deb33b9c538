"""OpenRadioss starter files (.rad): /NODE, /SHELL, /SH3N, /PART, /PROP/SHELL, /GRSHEL, /GRSH3N; fields of 10 and 20 columns.

Each part is a region, by its title where that is unique, and as "pid N". The unit of /BEGIN is held against `scale`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .raw import Cells, Nodes, Raw, Text, fixed, left_out, raw, refused, shown

BESIDE = ("BEAM", "TRUSS", "SPRING", "RBODY", "RBE2", "RBE3", "RWALL", "ADMAS", "XELEM")
SOLIDS = ("BRICK", "BRIC20", "TETRA4", "TETRA10", "PENTA6", "SHEL16", "SPHCEL", "QUAD", "TRIA")
METRES = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "km": 1e3}


def read(path: Path) -> Raw:
    text = Text(path)
    nodes, cells = Nodes(text), Cells(text)
    titles: dict[int, str] = {}
    props: dict[int, str] = {}
    thick: dict[str, float] = {}
    sets: dict[str, list[int]] = {}
    beside: dict[str, int] = {}
    unit: float | None = None
    singly = 0
    ended = False

    def block(words: list[str], at: int, lines: list[tuple[int, str]]) -> None:
        nonlocal unit, singly
        text.number = at
        kind = words[0]

        def number() -> int:
            if len(words) < 2:
                text.fail(f"/{kind} needs the number of its part")
            return text.integer(words[-1] if kind in ("SHELL", "SH3N") else words[1], "the number of a part")

        if kind == "NODE":
            for text.number, line in lines:
                n, x, y, z = fixed(line, 10, 20, 20, 20)
                if not (n and x and y and z):
                    text.fail(f"{shown(line)} is no node: number in 10 columns, x, y, z in 20 each")
                nodes.add(text.integer(n, "the number of a node"), tuple(text.real(f, "a coordinate") for f in (x, y, z)))  # type: ignore[arg-type]
        elif kind in ("SHELL", "SH3N"):
            pid, corners = number(), 4 if kind == "SHELL" else 3
            if not lines:
                text.fail(f"/{kind}/{pid} has no elements")
            for text.number, line in lines:
                f = fixed(line, *[10] * (corners + 1))
                if "" in f[:4]:
                    text.fail(f"{shown(line)} is no shell: number and {corners} nodes in 10 columns each")
                element, *c = (text.integer(v or "0", "the number of a node or an element") for v in f)
                if 0 in c[:3]:
                    text.fail(f"{shown(line)} is no shell: number and {corners} nodes in 10 columns each")
                singly += any(text.real(v, "an angle or a thickness") for v in line[10 * (corners + 1) :].split())
                cells.add(element, tuple(c), f"pid {pid}")
        elif kind == "PART" and len(lines) >= 2:
            pid = number()
            titles[pid] = "".join(c for c in lines[0][1].strip() if c.isprintable())
            props[pid] = fixed(lines[1][1], 10)[0]
        elif kind == "PROP" and len(words) > 2 and words[1] in ("SHELL", "TYPE1") and len(lines) >= 4:
            text.number, line = lines[3]
            value = fixed(line, 20, 20)[1]
            if value:
                thick[words[2]] = text.real(value, "a thickness")
        elif kind in ("GRSHEL", "GRSH3N") and len(words) > 2 and words[1] in ("SHEL", "SH3N") and lines:
            name = lines[0][1].strip() or f"set {words[2]}"
            for text.number, line in lines[1:]:
                sets.setdefault(name, []).extend(text.integer(v) for v in fixed(line, *[10] * 10) if v not in ("", "0"))
        elif kind == "BEGIN" and len(lines) >= 3:
            length = lines[2][1].split()
            if len(length) == 3:
                unit = METRES.get(length[1].lower())
        elif kind == "TRANSFORM":
            text.fail("/TRANSFORM moves nodes and is not followed: write them where they are")
        elif kind in ("CNODE", "SUBMODEL", "ENDSUB"):
            text.fail(f"/{kind} is not followed: write the nodes as /NODE, in one model")
        elif kind in SOLIDS and not (kind == "QUAD" and not lines):
            text.fail(f"/{kind} is not supported; a shell is made of /SHELL and /SH3N")
        elif kind in BESIDE and len(words) > 1 and lines:
            beside[f"/{kind}"] = beside.get(f"/{kind}", 0) + len(lines)

    words: list[str] = []
    lines: list[tuple[int, str]] = []
    at = 0
    for line in text:
        if line.lower().startswith("#include"):
            text.fail("#include is not followed: merge the files")
        if line.startswith(("#", "$")):
            continue
        if line.startswith("/"):
            here = text.number
            if words:
                block(words, at, lines)
            text.number = here
            words, lines, at = [w.strip().upper() for w in line.strip().lstrip("/").split("/")], [], here
            if line.startswith("//SUBMODEL"):
                text.fail("//SUBMODEL is not followed: write one model")
            if words[0] == "END":
                ended = True
                break
            continue
        if not words:
            text.fail(f"{shown(line)} stands before the first keyword (/BEGIN, /NODE, ...)")
        if line.strip() or words[0] in ("PART", "PROP", "GRSHEL", "GRSH3N"):
            lines.append((text.number, line))
    if not ended:
        text.fail("the file has no /END: it is cut off")
    if not cells.corners:
        raise refused(f"mesh {text.name} has no /SHELL and no /SH3N{'; ' + left_out(beside)[0] if beside else ''}")
    notes = left_out(beside)
    if singly:
        notes.append(f"angles and thicknesses of {singly} single elements not kept")
    result = raw(nodes, cells, notes=notes, unit=unit)
    for pid, title in titles.items():
        key = f"pid {pid}"
        if key in result.regions:
            if props[pid] in thick:
                result.thickness[key] = thick[props[pid]]
            if title and list(titles.values()).count(title) == 1 and title not in result.regions:
                result.regions[title] = result.regions[key]
                if key in result.thickness:
                    result.thickness[title] = result.thickness[key]
    for name, numbers in sets.items():
        rows = [cells.seen[n] for n in numbers if n in cells.seen]
        if rows and name not in result.regions:
            result.regions[name] = np.unique(rows)
    return result

"""LS-DYNA keyword files (.k, .key, .dyn): *NODE, *ELEMENT_SHELL, *PART, *SECTION_SHELL, *SET_SHELL; standard, i10 and long.

Each part is a region, by its heading where that is unique, and as "pid N".
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .raw import Cells, Nodes, Raw, Text, fixed, left_out, raw, refused, shown

BESIDE = ("ELEMENT_BEAM", "ELEMENT_DISCRETE", "ELEMENT_MASS", "ELEMENT_INERTIA", "ELEMENT_SEATBELT", "ELEMENT_PLOTEL", "ELEMENT_BEARING")
EXTRA = {"THICKNESS": 0, "BETA": 0, "MCID": 0, "OFFSET": 1}  # options of *ELEMENT_SHELL: the first three share one more line
MOVING = ("NODE_TRANSFORM", "NODE_REFLECT", "NODE_SCALAR", "NODE_MERGE", "PARAMETER_EXPRESSION", "PARAMETER")


def read(path: Path) -> Raw:
    return _Reader(Text(path)).read()


class _Reader:
    def __init__(self, text: Text):
        self.text = text
        self.width = 8
        self.nodes, self.cells = Nodes(text), Cells(text)
        self.titles: dict[int, str] = {}
        self.section: dict[int, str] = {}
        self.thickness: dict[str, float] = {}
        self.sets: dict[str, list[int]] = {}
        self.beside: dict[str, int] = {}
        self.notes: list[str] = []

    def read(self) -> Raw:
        text = self.text
        keyword = ""
        block: list[tuple[int, str]] = []
        ended = False
        for line in text:
            if line.startswith("$") or (not line.strip() and not keyword.startswith(("PART", "SECTION", "SET"))):
                continue
            if line.startswith("*"):
                self._block(keyword, block)
                keyword, block = line[1:].strip().upper(), []
                self.at = text.number
                if keyword.split(",")[0].split()[0:1] == ["END"]:
                    ended = True
                    break
                continue
            if not keyword:
                text.fail(f"{shown(line)} stands before the first keyword (*KEYWORD, *NODE, ...)")
            block.append((text.number, line))
        if not ended:
            self._block(keyword, block)
            text.fail("the file has no *END: it is cut off")
        if not self.cells.corners:
            raise refused(f"mesh {text.name} has no *ELEMENT_SHELL{'; ' + left_out(self.beside)[0] if self.beside else ''}")
        result = raw(self.nodes, self.cells, notes=left_out(self.beside) + self.notes)
        names = list(self.titles.values())
        for pid, title in self.titles.items():
            key = f"pid {pid}"
            if key in result.regions:
                if self.section.get(pid) in self.thickness:
                    result.thickness[key] = self.thickness[self.section[pid]]
                if title and names.count(title) == 1 and title not in result.regions:
                    result.regions[title] = result.regions[key]
                    if key in result.thickness:
                        result.thickness[title] = result.thickness[key]
        for name, numbers in self.sets.items():
            rows = [self.cells.seen[n] for n in numbers if n in self.cells.seen]
            if rows and name not in result.regions:
                result.regions[name] = np.unique(rows)
        return result

    def _block(self, keyword: str, block: list[tuple[int, str]]) -> None:
        text = self.text
        if not keyword:
            return
        last, text.number = text.number, self.at
        words = keyword.split()
        name = words[0]
        width = self.width
        if name.endswith(("+", "%", "-")):
            width = {"+": 20, "%": 10, "-": 8}[name[-1]]
            name = name[:-1]
        if len(words) > 1 and words[1] in ("+", "%", "-"):
            width = {"+": 20, "%": 10, "-": 8}[words[1]]
        if name == "KEYWORD":
            said = keyword.replace(" ", "")
            self.width = 20 if "LONG=Y" in said or "LONG=K" in said else 10 if "I10=Y" in said else 8
        elif name.startswith("INCLUDE"):
            text.fail(f"*{name} is not followed: merge the files")
        elif name.startswith(MOVING):
            text.fail(f"*{name} is not followed: write the nodes where they are, and numbers themselves")
        elif name == "NODE":
            self._nodes(block, width)
        elif name.startswith("ELEMENT_SHELL"):
            self._shells(name, block, width)
        elif name.startswith(BESIDE):
            self.beside[f"*{name}"] = self.beside.get(f"*{name}", 0) + len(block)
        elif name.startswith("ELEMENT"):
            text.fail(f"*{name} is not supported; a shell is made of *ELEMENT_SHELL")
        elif name == "PART" or name.startswith("PART_") and not name.startswith(("PART_MOVE", "PART_MODES", "PART_SENSOR", "PART_STACKED")):
            self._parts(name, block, width)
        elif name in ("SECTION_SHELL", "SECTION_SHELL_TITLE"):
            self._sections(name, block, width)
        elif name in ("SET_SHELL", "SET_SHELL_LIST", "SET_SHELL_TITLE", "SET_SHELL_LIST_TITLE"):
            self._set(name, block, width)
        elif name.startswith("NODE") and name not in ("NODE_THICKNESS",) and not name.startswith("NODE_RIGID"):
            text.fail(f"*{name} is not supported: write the nodes as *NODE")
        text.number = last

    def _fields(self, line: str, *widths: int) -> list[str]:
        if "," in line:
            fields = [f.strip() for f in line.split(",")]
            fields += [""] * (len(widths) - len(fields))
        else:
            fields = fixed(line.expandtabs(8), *widths)
        if any("&" in f for f in fields):
            self.text.fail(f"{shown(line)}: parameters (&) are not followed: write the numbers themselves")
        return fields

    def _nodes(self, block: list[tuple[int, str]], width: int) -> None:
        text = self.text
        wide = 20 if width == 20 else 16
        for text.number, line in block:
            n, x, y, z = self._fields(line, width, wide, wide, wide)[:4]
            if not n or not (x or y or z or len(line.strip()) > len(n)):
                text.fail(f"{shown(line)} is no node: number, x, y, z")
            at = tuple(text.real(f, "a coordinate") if f else 0.0 for f in (x, y, z))
            self.nodes.add(text.integer(n, "the number of a node"), at)  # type: ignore[arg-type]

    def _shells(self, name: str, block: list[tuple[int, str]], width: int) -> None:
        text = self.text
        options = [o for o in name.removeprefix("ELEMENT_SHELL").split("_") if o]
        strange = [o for o in options if o not in EXTRA]
        if strange:
            text.fail(f"*{name} is not supported; options {', '.join(EXTRA)} are")
        if not block:
            text.fail(f"*{name} has no elements")
        extra = any(EXTRA[o] == 0 for o in options) + ("OFFSET" in options)
        if options:
            self.notes.append(f"*{name}: {', '.join(options).lower()} of single elements not kept")
        if len(block) % (1 + extra):
            text.fail(f"*{name} has {len(block)} lines; each element takes {1 + extra}")
        for text.number, line in block[:: 1 + extra]:
            f = self._fields(line, *[width] * 10)
            number, pid, *nodes = (text.integer(v or "0", "the number of a node or an element") for v in f[:6])
            if any(v not in ("", "0") for v in f[6:10]):
                text.fail(f"element {number} has more than four nodes; a shell is made of triangles and quadrangles")
            if 0 in nodes[:3] or pid <= 0:
                text.fail(f"{shown(line)} is no shell: number, part, three or four nodes")
            self.cells.add(number, tuple(nodes), f"pid {pid}")

    def _parts(self, name: str, block: list[tuple[int, str]], width: int) -> None:
        pairs = len(block) // 2 if name == "PART" else min(1, len(block) // 2)
        for k in range(pairs):
            title = block[2 * k][1].strip()
            self.text.number, line = block[2 * k + 1]
            wide = 20 if width == 20 else 10
            pid, section = self._fields(line, wide, wide)[:2]
            self.titles[self.text.integer(pid, "the number of a part")] = "".join(c for c in title[:70] if c.isprintable())
            self.section[self.text.integer(pid)] = section.lstrip("0")

    def _sections(self, name: str, block: list[tuple[int, str]], width: int) -> None:
        text, k, wide = self.text, 0, 20 if width == 20 else 10
        while k < len(block):
            k += name.endswith("TITLE")
            if k + 1 >= len(block):
                text.fail(f"*{name} is cut off: a section takes two lines")
            text.number, first = block[k]
            f = self._fields(first, *[wide] * 8)
            text.number, second = block[k + 1]
            t = [text.real(v, "a thickness") if v else 0.0 for v in self._fields(second, *[wide] * 4)[:4]]
            if t[0] > 0 and all(v in (0.0, t[0]) for v in t):
                self.thickness[f[0].lstrip("0")] = t[0]
            k += 2
            if f[6] not in ("", "0"):  # angles of the layers, 8 a line
                layers = int(abs(text.real(f[3] or "2")))
                k += (min(layers, 1000) + 7) // 8

    def _set(self, name: str, block: list[tuple[int, str]], width: int) -> None:
        text, wide = self.text, 20 if width == 20 else 10
        block = [(n, line) for n, line in block if line.strip()]
        title = block.pop(0)[1].strip() if name.endswith("TITLE") and block else ""
        if not block:
            return
        text.number, line = block[0]
        number = self._fields(line, wide)[0]
        found: list[int] = []
        for text.number, line in block[1:]:
            found += [text.integer(v) for v in self._fields(line, *[wide] * 8)[:8] if v not in ("", "0")]
        self.sets[title or f"set {number}"] = found

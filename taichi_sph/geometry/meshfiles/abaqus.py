"""Abaqus input files (.inp): nodes, shell and membrane elements, sets, parts, instances, coordinate systems.

A part is placed by each of its instances (translation, then rotation); without any instance it stands where it is
written. Eight-node elements give their corners. Keywords that make or move nodes and are not followed are refused.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .raw import Cells, Nodes, Raw, Text, left_out, refused, shown

CORNERS = dict.fromkeys("S3 S3R S3RS S3T STRI3 M3D3 SFM3D3 CPS3 CPE3 DS3".split(), (3, 3))
CORNERS |= dict.fromkeys("S4 S4R S4RS S4RSW S4R5 S4RT S4T M3D4 M3D4R SFM3D4 SFM3D4R CPS4 CPS4R CPS4I CPE4 CPE4R CPE4I DS4".split(), (4, 4))
CORNERS |= dict.fromkeys("STRI65 M3D6 CPS6 CPS6M DS6 SFM3D6".split(), (3, 6))
CORNERS |= dict.fromkeys("S8R S8R5 S8RT M3D8 M3D8R CPS8 CPS8R DS8 SFM3D8 SFM3D8R".split(), (4, 8))
CORNERS |= dict.fromkeys("S9R5 M3D9 M3D9R".split(), (4, 9))
RIGID = {"R3D3": (3, 3), "R3D4": (4, 4)}  # taken where the file has nothing that deforms
BESIDE = tuple("B2 B3 T2D T3D PIPE ELBOW FRAME CONN MASS ROTARYI SPRING DASHPOT JOINT RB2D RB3D GAP DCOUP HEATCAP R2D RAX PSI ITS".split())
REFUSED = {
    "INCLUDE": "is not followed: merge the files",
    "NGEN": "makes nodes and is not followed: write them as *NODE",
    "NFILL": "makes nodes and is not followed: write them as *NODE",
    "NCOPY": "makes nodes and is not followed: write them as *NODE",
    "NMAP": "moves nodes and is not followed: write them where they are",
    "IMPERFECTION": "moves nodes and is not followed: write them where they are",
    "ELGEN": "makes elements and is not followed: write them as *ELEMENT",
    "ELCOPY": "makes elements and is not followed: write them as *ELEMENT",
    "SYMMETRIC MODEL GENERATION": "makes a mesh and is not followed: write its nodes and elements",
    "IMPORT": "is not followed: write the nodes and elements",
    "PARAMETER": "is not followed: write the numbers themselves",
    "SUBSTRUCTURE GENERATE": "is not followed: write the nodes and elements",
    "ASSEMBLE": "is not followed",
}
JOINING = ("TIE", "MPC", "EQUATION", "COUPLING", "KINEMATIC COUPLING", "RIGID BODY", "FASTENER", "SHELL TO SOLID COUPLING")


Block = tuple[str, dict[str, str], list[tuple[int, str]]]  # keyword, options, data lines with their numbers


@dataclass
class Part:
    """The mesh of one *PART, or of a file without parts."""

    name: str
    text: Text
    nodes: Nodes = field(init=False)
    cells: Cells = field(init=False)
    sets: dict[str, tuple[str, list[range]]] = field(default_factory=dict)  # by name in capitals: name, element numbers
    thickness: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.nodes, self.cells = Nodes(self.text), Cells(self.text)

    def rows(self, numbers: list[range]) -> list[int]:
        """Rows of the elements of a set; what else it has (beams, say) is not there."""
        seen, found = self.cells.seen, []
        for some in numbers:
            few = some if len(some) < len(seen) else (n for n in seen if n in some)
            found += [seen[n] for n in few if n in seen]
        return found


@dataclass
class Instance:
    """One placing of a part."""

    name: str
    part: str
    line: int
    data: list[list[float]] = field(default_factory=list)

    def placed(self, text: Text, points: np.ndarray) -> np.ndarray:
        if self.data:
            points = points + np.array((self.data[0] + [0.0, 0.0, 0.0])[:3])
        if len(self.data) > 1:
            if len(self.data[1]) != 7:
                text.fail(
                    f"the rotation of instance '{self.name}' has {len(self.data[1])} numbers; it needs two points and an angle", self.line
                )
            a, b, angle = np.array(self.data[1][:3]), np.array(self.data[1][3:6]), math.radians(self.data[1][6])
            length = np.linalg.norm(b - a)
            if not length > 0:
                text.fail(f"the two points of the axis of instance '{self.name}' are one", self.line)
            k = (b - a) / length
            v = points - a
            across = np.cross(k, v)
            points = a + v * math.cos(angle) + across * math.sin(angle) + np.outer(v @ k, k) * (1 - math.cos(angle))
        return points


def read(path: Path) -> Raw:
    return _Reader(Text(path)).read()


class _Reader:
    def __init__(self, text: Text):
        self.text = text
        kinds = [
            line.upper().replace(" ", "").partition("TYPE=")[2].split(",")[0].strip() for line in text.lines if line[:2].upper() == "*E"
        ]
        self.corners = dict(CORNERS)
        if not any(k in CORNERS for k in kinds):
            self.corners |= RIGID
        if any("written by meshio" in line for line in text.lines[:5]):
            self.corners["CAX4P"] = (4, 4)  # so meshio writes a quadrangle, and R3D3 a triangle
            self.corners |= RIGID
        self.parts: dict[str, Part] = {}
        self.instances: dict[str, Instance] = {}
        self.flat = Part("", text)  # a file without parts, or what the assembly itself has
        self.scope = self.flat
        self.where = ""  # "", "part", "assembly", "instance"
        self.instance: Instance | None = None
        self.assembly_sets: list[tuple[str, str, list[range]]] = []  # name, instance in capitals, element numbers
        self.system: tuple[np.ndarray, np.ndarray] | None = None
        self.beside: dict[str, int] = {}
        self.joining: dict[str, int] = {}
        self.dropped = 0

    def read(self) -> Raw:
        for keyword, options, data in self._blocks():
            self._block(keyword, options, data)
        if self.where:
            self.text.fail(f"the file ends inside *{self.where.upper()}: it is cut off")
        return self._raw()

    def _blocks(self) -> Iterator[Block]:
        """(keyword, options, data lines with their numbers) of each block."""
        text = self.text
        block: Block | None = None
        lines = iter(text)
        for line in lines:
            if line.startswith("**") or not line.strip():
                continue
            if line.lstrip().startswith("*"):
                at = text.number
                while line.rstrip().endswith(","):
                    line = line.rstrip() + next(lines, "")
                here = text.number
                if block:
                    yield block
                text.number = here
                keyword, *rest = line.strip()[1:].split(",")
                options = {}
                for word in rest:
                    if word.strip():
                        key, _, value = word.partition("=")
                        options[key.strip().upper()] = value.strip().strip('"')
                block = (" ".join(keyword.upper().split()), options, [(at, "")])
            elif block is None:
                text.fail(f"{shown(line)} stands before the first keyword (*NODE, *PART, ...)")
            else:
                block[2].append((text.number, line))
        if block:
            yield block

    def _block(self, keyword: str, options: dict[str, str], data: list[tuple[int, str]]) -> None:
        text = self.text
        text.number, _ = data.pop(0)
        at = text.number
        if keyword in REFUSED:
            text.fail(f"*{keyword} {REFUSED[keyword]}")
        if keyword in JOINING:
            self.joining[keyword] = self.joining.get(keyword, 0) + 1
        match keyword:
            case "PART":
                self._enter("part", "", "PART")
                name = self._option(options, "NAME", keyword)
                if name.upper() in self.parts:
                    text.fail(f"there are two parts '{name}'")
                self.scope = self.parts[name.upper()] = Part(name, text)
            case "END PART":
                self._leave("part", "PART")
            case "ASSEMBLY":
                self._enter("assembly", "", "ASSEMBLY")
            case "END ASSEMBLY":
                self._leave("assembly", "ASSEMBLY")
            case "INSTANCE":
                if "INSTANCE" in options or "LIBRARY" in options:
                    text.fail("*INSTANCE from another analysis (LIBRARY, INSTANCE) is not followed: write the part")
                self._enter("instance", "assembly", "INSTANCE")
                name, part = self._option(options, "NAME", keyword), self._option(options, "PART", keyword)
                if name.upper() in self.instances:
                    text.fail(f"there are two instances '{name}'")
                self.instance = self.instances[name.upper()] = Instance(name, part, at)
                for text.number, line in data:
                    self.instance.data.append([text.real(f) for f in line.split(",") if f.strip()])
                if len(self.instance.data) > 2 or (self.instance.data and len(self.instance.data[0]) > 3):
                    text.fail(f"instance '{name}' has a translation of 3 numbers and a rotation of 7, and no more")
            case "END INSTANCE":
                self._leave("instance", "INSTANCE")
            case "SYSTEM":
                self._system(data)
            case "NODE":
                self._nodes(options, data)
            case "ELEMENT":
                self._elements(options, data)
            case "ELSET":
                self._elset(options, data)
            case "SHELL SECTION" | "MEMBRANE SECTION" | "SHELL GENERAL SECTION":
                if data and "COMPOSITE" not in options and options.get("ELSET"):
                    text.number, line = data[0]
                    first = line.split(",")[0]
                    if first.strip():
                        self.scope.thickness[options["ELSET"].upper()] = text.real(first, "the thickness of a section")

    def _option(self, options: dict[str, str], key: str, keyword: str) -> str:
        if not options.get(key):
            self.text.fail(f"*{keyword} needs {key}=")
        return options[key]

    def _enter(self, where: str, outside: str, keyword: str) -> None:
        if self.where != outside:
            self.text.fail(f"*{keyword} stands {'inside *' + self.where.upper() if self.where else 'outside *ASSEMBLY'}")
        self.where, self.system = where, None

    def _leave(self, where: str, keyword: str) -> None:
        if self.where != where:
            self.text.fail(f"*END {keyword} ends nothing: no *{keyword} is open")
        self.where = "assembly" if where == "instance" else ""
        self.system, self.instance = None, None
        if where == "part":
            self.scope = self.flat

    def _system(self, data: list[tuple[int, str]]) -> None:
        """*SYSTEM: origin a, b on the x axis (with c) or in the xy plane, c in the xy plane; no data: the global one."""
        values: list[float] = []
        for self.text.number, line in data:
            values += [self.text.real(f) if f.strip() else 0.0 for f in line.rstrip().rstrip(",").split(",")]
        if not values:
            self.system = None
            return
        if len(values) not in (3, 6, 9):
            self.text.fail(f"*SYSTEM has {len(values)} numbers; it takes 3, 6 or 9")
        a, axes = np.array(values[:3]), np.eye(3)
        if len(values) > 3:
            x = np.array(values[3:6]) - a
            z = np.cross(x, np.array(values[6:9]) - a) if len(values) == 9 else np.array([0.0, 0.0, 1.0])
            if len(values) == 6:
                x = x * [1.0, 1.0, 0.0]
            if not (np.linalg.norm(x) > 0 and np.linalg.norm(z) > 1e-12 * np.linalg.norm(x)):
                self.text.fail("the points of *SYSTEM lie on one line: they give no axes")
            x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
            axes = np.stack([x, np.cross(z, x), z])
        self.system = a, axes

    def _nodes(self, options: dict[str, str], data: list[tuple[int, str]]) -> None:
        text = self.text
        if "INPUT" in options:
            text.fail("*NODE, INPUT= is not followed: merge the files")
        kind = options.get("SYSTEM", "R").upper()
        if kind not in ("R", "C"):
            text.fail(f"*NODE, SYSTEM={kind} is not supported: write x, y, z, or cylinder coordinates (SYSTEM=C)")
        if self.where == "instance":
            text.fail("*NODE inside *INSTANCE is not supported: give the nodes in the part")
        add, real, integer = self.scope.nodes.add, text.real, text.integer
        for text.number, line in data:
            fields = line.split(",")
            if len(fields) < 2:
                text.fail(f"{shown(line)} is no node: number, x, y, z")
            x, y, z = ([real(f, "a coordinate") if f.strip() else 0.0 for f in fields[1:4]] + [0.0, 0.0])[:3]
            if kind == "C":
                x, y = x * math.cos(math.radians(y)), x * math.sin(math.radians(y))
            if self.system is not None:
                x, y, z = (float(v) for v in self.system[0] + np.array([x, y, z]) @ self.system[1])
            add(integer(fields[0], "the number of a node"), (x, y, z))

    def _elements(self, options: dict[str, str], data: list[tuple[int, str]]) -> None:
        text = self.text
        kind = self._option(options, "TYPE", "ELEMENT").upper()
        if "INPUT" in options or "FILE" in options:
            text.fail("*ELEMENT, INPUT= is not followed: merge the files")
        if not data:
            text.fail(f"*ELEMENT, TYPE={kind} has no elements")
        if self.where == "instance":
            text.fail("*ELEMENT inside *INSTANCE is not supported: give the elements in the part")
        if kind not in self.corners:
            if kind.startswith(BESIDE) or kind in RIGID:
                self.beside[kind] = self.beside.get(kind, 0) + len(data)
                return
            solid = "solids" if kind.startswith(("C3D", "SC", "CSS", "DC3D", "CCL", "AC3D")) else "unknown here"
            text.fail(f"elements of type {kind} are {solid}; a shell is made of triangles and quadrangles (S3, S4R, M3D4, ...)")
        if self.where == "assembly":
            text.fail(f"elements of type {kind} outside a part are not supported: give them in a part")
        corners, count = self.corners[kind]
        self.dropped += count > 4 or (count > 3 and corners == 3)
        region = options.get("ELSET") or None
        rows: list[range] = []
        held: list[str] = []
        for text.number, line in data:
            fields = line.split(",")
            held += [f for f in fields if f.strip()]
            if len(held) < count + 1 and not fields[-1].strip() and len(fields) > 1:
                continue  # goes on in the next line
            if len(held) != count + 1:
                text.fail(f"{shown(line)}: an element of type {kind} has a number and {count} nodes, here are {len(held)} numbers")
            number, *nodes = (text.integer(f, "the number of a node or an element") for f in held)
            if min(nodes) <= 0:
                text.fail(f"element {number} refers to node {min(nodes)}; nodes have numbers from 1")
            self.scope.cells.add(number, tuple(nodes[:corners]))
            rows.append(range(number, number + 1))
            held = []
        if held:
            text.fail(f"the last element of *ELEMENT, TYPE={kind} is cut off")
        if region:
            self.scope.sets.setdefault(region.upper(), (region, []))[1].extend(rows)

    def _elset(self, options: dict[str, str], data: list[tuple[int, str]]) -> None:
        text = self.text
        name, instance = self._option(options, "ELSET", "ELSET"), options.get("INSTANCE", "").upper()
        found: list[range] = []
        others = self.scope.sets
        for text.number, line in data:
            fields = [f.strip() for f in line.split(",") if f.strip()]
            if "GENERATE" in options:
                if len(fields) not in (2, 3):
                    text.fail(f"{shown(line)}: GENERATE takes first, last and step")
                first, last, step = ([text.integer(f) for f in fields] + [1])[:3]
                if step < 1 or last < first:
                    text.fail(f"{shown(line)}: GENERATE from {first} to {last} in steps of {step}")
                found.append(range(first, last + 1, step))
                continue
            for f in fields:
                if f.lstrip("+-").isdigit():
                    one = text.integer(f)
                    found.append(range(one, one + 1))
                elif f.strip('"').upper() in others:
                    found += others[f.strip('"').upper()][1]
                elif self.where == "assembly":
                    matching = [s for s in self.assembly_sets if s[0].upper() == f.strip('"').upper()]
                    inst, _, label = f.strip('"').rpartition(".")
                    if matching:
                        self.assembly_sets += [(name, i, list(numbers)) for _, i, numbers in matching]
                    elif inst and label.isdigit():
                        one = text.integer(label)
                        self.assembly_sets.append((name, inst.upper(), [range(one, one + 1)]))
                    else:
                        text.fail(f"*ELSET {name} names the set {shown(f)}, which is not there yet")
                else:
                    text.fail(f"*ELSET {name} names the set {shown(f)}, which is not there yet")
        if self.where == "assembly":
            if found and not instance:
                text.fail(f"*ELSET {name} in *ASSEMBLY needs INSTANCE=")
            if found:
                self.assembly_sets.append((name, instance, found))
        else:
            self.scope.sets.setdefault(name.upper(), (name, []))[1].extend(found)

    def _raw(self) -> Raw:
        text = self.text
        notes = left_out(self.beside)
        if self.joining:
            notes.append(", ".join(f"*{k}" for k in self.joining) + " joins nothing here: only common nodes do")
        if self.dropped:
            notes.append("elements with nodes at the middle of their sides: their corners only")
        if not self.parts:
            if self.instances:
                text.fail("the file has instances and no *PART")
            placed = [(Instance("", "", 0), self.flat)]
        elif self.instances:
            placed = []
            for instance in self.instances.values():
                part = self.parts.get(instance.part.upper())
                if part is None:
                    text.fail(f"instance '{instance.name}' places the part '{instance.part}', which is not there", instance.line)
                placed.append((instance, part))
            idle = [p.name for p in self.parts.values() if p.cells.corners and not any(p is q for _, q in placed)]
            if idle:
                notes.append(f"parts without an instance left out: {', '.join(idle)}")
        else:
            placed = [(Instance(p.name, p.name, 0), p) for p in self.parts.values()]
            notes.append("no *INSTANCE: parts stand where they are written")
        if self.parts and self.flat.cells.corners:
            text.fail("elements stand both in parts and outside of them")
        placed = [(i, p) for i, p in placed if p.cells.corners]
        if not placed:
            raise refused(f"mesh {text.name} has no shell elements (S3, S4R, M3D4, ...){'; ' + notes[0] if notes else ''}")
        several = len(placed) > 1
        points, cells, node_ids, cell_ids, node_owner, cell_owner = [], [], [], [], [], []
        regions: dict[str, list[np.ndarray]] = {}
        thickness: dict[str, float] = {}
        shift = row = 0
        count: dict[str, int] = {}
        for _, part in placed:
            for key in part.sets:
                count[key] = count.get(key, 0) + 1
        for k, (instance, part) in enumerate(placed):
            at = np.array(part.nodes.points, np.float64).reshape(-1, 3)
            cell = part.cells.arrays(part.nodes)
            points.append(instance.placed(text, at))
            cells.append(np.where(cell >= 0, cell + shift, -1))
            node_ids.append(np.fromiter(part.nodes.row, np.int64, len(at)))
            cell_ids.append(part.cells.numbers())
            node_owner.append(np.full(len(at), k))
            cell_owner.append(np.full(len(cell), k))
            if instance.name:
                regions.setdefault(instance.name, []).append(row + np.arange(len(cell)))
            for key, (name, numbers) in part.sets.items():
                rows = part.rows(numbers)
                if rows:
                    full = f"{instance.name}.{name}" if count[key] > 1 else name
                    regions.setdefault(full, []).append(row + np.array(rows, np.int64))
                    if key in part.thickness:
                        thickness[full] = part.thickness[key]
            for name, owner, numbers in self.assembly_sets:
                if owner == instance.name.upper():
                    rows = part.rows(numbers)
                    if rows:
                        regions.setdefault(name, []).append(row + np.array(rows, np.int64))
            shift += len(at)
            row += len(cell)
        return Raw(
            points=np.concatenate(points),
            cells=np.concatenate(cells),
            node_ids=np.concatenate(node_ids),
            cell_ids=np.concatenate(cell_ids),
            node_owner=np.concatenate(node_owner) if several else None,
            cell_owner=np.concatenate(cell_owner) if several else None,
            owners=tuple(i.name for i, _ in placed),
            regions={name: np.unique(np.concatenate(rows)) for name, rows in regions.items()},
            thickness=thickness,
            notes=notes,
            cell_word="element",
        )

"""Surface meshes from files, made into a SurfaceMesh or refused in one sentence. NumPy only.

Triangles and quadrangles of first order. Sentences name nodes and cells by the file's own numbers. Refused: what would
run and be wrong (flat, folded or double cells, nodes that nearly coincide, edges shared by three cells, a surface
with one side). Mended and said: seams, cells turned the wrong way round, closed pieces turned inward. Dropped: nodes
that no cell uses.

Nodes nearer than SEAM of their cells are one node, unless `merge` is off: then they stay two, and a slit of zero width
stays open. Nodes nearer than NEAR that no cell joins are an error in both cases.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from ..errors import nearest
from ..scene.units import show
from .mesh import SurfaceMesh
from .meshfiles import abaqus, foreign, gmsh, lsdyna, nastran, plain, radioss
from .meshfiles.raw import Raw, refused
from .normals import fitted_normals

READERS = {
    ".inp": abaqus.read,
    ".bdf": nastran.read,
    ".nas": nastran.read,
    ".k": lsdyna.read,
    ".key": lsdyna.read,
    ".dyn": lsdyna.read,
    ".rad": radioss.read,
    ".obj": plain.obj,
    ".ply": plain.ply,
    ".stl": plain.stl,
    ".off": plain.off,
    ".msh": gmsh.read,
}
READABLE = (*READERS, *foreign.FORMATS)
LARGEST = 4 * 2**30  # bytes of a file
TIME_LIMIT = 60.0  # s, for the formats that are read in a process of their own
FLAT = 1e-3  # a cell whose smallest height is below this part of its longest side is a sliver
SEAM, NEAR = 1e-3, 1e-2  # of the side of a cell: nodes nearer than the first are one, nearer than the second are an error
FOLD = -0.95  # cosine between the normals of neighbours: below it they lie on each other
APART = 10.0  # spacing of the mesh over that of the numerics, or under it
UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048, "micrometres": 1e-6, "kilometres": 1e3}


def read_mesh(
    path: Path | str,
    scale: float = 1.0,
    plane: bool = False,
    *,
    part: str | tuple[str, ...] | None = None,
    merge: bool = True,
    spacing: float | None = None,
    time_limit: float = TIME_LIMIT,
) -> SurfaceMesh:
    """The mesh of a file, its coordinates times `scale` [m per unit of the file].

    plane: the body moves in its plane, so all points must have the same z. part: the regions that are read, by itself all.
    spacing [m]: of the numerics, which the mesh's is held against. time_limit [s]: for the reader of a foreign format.
    """
    path = Path(path)
    return surface(path.name, read_raw(path, time_limit), scale, plane, part, merge, spacing)


def read_raw(path: Path, time_limit: float = TIME_LIMIT) -> Raw:
    """What the file says, in its own unit and numbers."""
    if not path.is_file():
        near = [p.name for p in path.parent.glob("*") if p.suffix.lower() in READABLE] if path.parent.is_dir() else []
        there = f"; the folder has {', '.join(sorted(near)[:5])}" if near else ""
        raise refused(f"there is no mesh file '{path}'{there}")
    suffix = path.suffix.lower()
    if suffix not in READABLE:
        raise refused(f"mesh {path.name}: '{path.suffix}' is no mesh format; readable are {', '.join(READABLE)}")
    size = path.stat().st_size
    if size == 0:
        raise refused(f"mesh {path.name} is an empty file")
    if size > LARGEST:
        raise refused(f"mesh {path.name} has {size / 2**30:.1f} GB; at most {LARGEST // 2**30} GB are read")
    if suffix in foreign.FORMATS:
        return foreign.read(path, time_limit)
    try:
        return READERS[suffix](path)
    except (ValueError, IndexError, KeyError, TypeError, OverflowError, MemoryError) as error:  # none is known to get here
        raise refused(f"mesh {path.name} cannot be read as {suffix} ({type(error).__name__})") from error


def surface(
    name: str,
    raw: Raw,
    scale: float = 1.0,
    plane: bool = False,
    part: str | tuple[str, ...] | None = None,
    merge: bool = True,
    spacing: float | None = None,
) -> SurfaceMesh:
    """A checked SurfaceMesh of what a file says; `name` is the file's, for sentences."""
    if len(raw.cells) == 0:
        raise refused(f"mesh {name} has no triangles or quadrangles")
    if raw.unit is not None and abs(scale / raw.unit - 1) > 1e-6:
        raise refused(f"mesh {name} says that its unit of length is {raw.unit:g} m, and scale is {scale:g}: write scale = {raw.unit:g}")
    work = _Work(name, raw, scale)
    if part is not None:
        work.select((part,) if isinstance(part, str) else part)
    work.drop_unused()
    work.check_points(scale, spacing)
    work.check_corners()
    if merge or raw.shared:
        work.merge(merge)
    work.check_near()
    work.check_cells()
    work.orient(plane)
    return work.finished(plane, scale)


class _Work:
    """points (N, 3) [m] and cells (M, 4) on their way; node, cell: rows of `raw` that they come from."""

    def __init__(self, name: str, raw: Raw, scale: float):
        self.name, self.raw = name, raw
        with np.errstate(all="ignore"):
            self.points = raw.points * scale
        self.cells = raw.cells.astype(np.int64)
        self.node, self.cell = np.arange(len(raw.points)), np.arange(len(raw.cells))
        self.notes = list(raw.notes)

    def refuse(self, why: str) -> NoReturn:
        counted = " (numbers count from 0)" if self.raw.first == 0 else ""
        raise refused(f"mesh {self.name}{counted}: {why}")

    def node_name(self, row: int) -> str:
        return self.raw.node(int(self.node[row]))

    def cell_name(self, row: int) -> str:
        return f"{self.raw.cell_word} {self.raw.cell(int(self.cell[row]))}"

    def corners(self) -> np.ndarray:
        """(M, 4, 3) corners, a triangle's first one again as its fourth."""
        return self.points[np.where(self.cells < 0, self.cells[:, :1], self.cells)]

    def area_vectors(self) -> np.ndarray:
        p = self.corners()
        triangle = self.cells[:, 3] < 0
        area = 0.5 * np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
        area[triangle] = 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[triangle]
        return area

    def spacing(self) -> float:
        """D [m]: side of the square that a node owns on average, area shared as in a boundless lattice."""
        triangle = self.cells[:, 3] < 0
        area = np.linalg.norm(self.area_vectors(), axis=1)
        return float(np.sqrt(area.sum() / (0.5 * triangle.sum() + (~triangle).sum())))

    def select(self, parts: tuple[str, ...]) -> None:
        """Only the cells of some regions."""
        regions, chosen = self.raw.regions, []
        for part in parts:
            wanted = [part, f"pid {part}"]
            found = next((n for n in regions if n in wanted), None) or next((n for n in regions if n.casefold() == part.casefold()), None)
            if found is None:
                names = list(regions)
                has = f"it has {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}" if names else "it names no regions"
                raise refused(f"mesh {self.name} has no part '{part}'{nearest(part, names) if names else ''}; {has}")
            chosen.append(regions[found])
        rows = np.unique(np.concatenate(chosen))
        self.cells, self.cell = self.cells[rows], self.cell[rows]

    def drop_unused(self) -> None:
        used = np.zeros(len(self.points), bool)
        used[self.cells[self.cells >= 0]] = True
        self._renumber(np.where(used, np.cumsum(used) - 1, -1), used)

    def _renumber(self, number: np.ndarray, kept: np.ndarray) -> None:
        self.cells = np.where(self.cells >= 0, number[self.cells], -1)
        self.points, self.node = self.points[kept], self.node[kept]

    def check_points(self, scale: float, spacing: float | None) -> None:
        bad = ~np.isfinite(self.points).all(axis=1)
        if bad.any():
            self.refuse(f"node {self.node_name(int(np.argmax(bad)))} has a coordinate that is not a number")
        with np.errstate(all="ignore"):
            size = float(np.ptp(self.points, axis=0).max())
        if spacing is not None and size < 1e100 and (own := self.spacing()) > 0 and not 1 / APART <= own / spacing <= APART:
            unit = next((u for u, f in UNITS.items() if 0.3 < own / spacing * f < 3), None)
            hint = (
                f"is the file in {unit}? (scale = {scale * UNITS[unit]:g})" if unit else "numerics.spacing should be about that of the mesh"
            )
            raise refused(f"mesh {self.name}: spacing {show(own, 'm')} of the mesh against {show(spacing, 'm')} of the numerics: {hint}")
        if not 1e-6 <= size <= 1e4:
            raise refused(
                f"mesh {self.name} is {size:.3g} m large with scale = {scale:g}; a body is between 1e-6 m and 1e4 m: "
                "is it in millimetres (scale = 0.001)?"
            )

    def check_corners(self) -> None:
        corners = np.sort(np.where(self.cells < 0, -1 - np.arange(4), self.cells), axis=1)
        twice = (np.diff(corners, axis=1) == 0).any(axis=1)
        if twice.any():
            self.refuse(f"{self.cell_name(int(np.argmax(twice)))} uses the same node twice")

    def merge(self, seams: bool) -> None:
        """Nodes in one place become one; with `seams` those a little apart as well, and it is said."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        before = len(self.points)
        _, first, inverse = np.unique(self.points + 0.0, axis=0, return_index=True, return_inverse=True)
        leader = first[inverse.ravel()]
        a, b = np.arange(before), leader
        if seams:
            i, j, _ = self._close(SEAM)
            a, b = np.concatenate([a, i]), np.concatenate([b, j])
        label = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(before, before)), directed=False)[1]
        lowest = np.full(before, before)
        np.minimum.at(lowest, label, np.arange(before))
        onto = lowest[label]
        gone = onto != np.arange(before)
        if not gone.any():
            return
        corners = np.where(self.cells < 0, -1 - np.arange(4), onto[self.cells])
        corners = np.sort(corners, axis=1)
        collapsed = (np.diff(corners, axis=1) == 0).any(axis=1)
        if collapsed.any():
            row = int(np.argmax(collapsed))
            own = [n for n in self.cells[row] if n >= 0]
            one, two = next((x, y) for k, x in enumerate(own) for y in own[k + 1 :] if onto[x] == onto[y])
            self.refuse(
                f"{self.cell_name(row)} is flat: its nodes {self.node_name(one)} and {self.node_name(two)} stand in one place, "
                f"{_place(self.points[one])}"
            )
        noisy = gone & (onto != leader) if self.raw.shared else gone
        if noisy.any():
            row = int(np.argmax(noisy))
            self.notes.append(
                f"{_some(noisy, 'node')} merged with others within {SEAM:g} of their cells (the first: {self.node_name(row)} with "
                f"{self.node_name(int(onto[row]))}, at {_place(self.points[row])}); merge = False keeps slits open"
            )
        kept = ~gone
        self._renumber((np.cumsum(kept) - 1)[onto], kept)

    def _reach(self) -> np.ndarray:
        """(N,) side of the smallest cell at each node [m]."""
        side = np.sqrt(np.linalg.norm(self.area_vectors(), axis=1) * np.where(self.cells[:, 3] < 0, 2.0, 1.0))
        reach = np.full(len(self.points), np.inf)
        for k in range(4):
            has = self.cells[:, k] >= 0
            np.minimum.at(reach, self.cells[has, k], side[has])
        return reach

    def _close(self, part: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pairs i < j of nodes nearer than `part` of their smallest cells and of no common cell, and their distances."""
        from scipy.spatial import cKDTree

        n = len(self.points)
        many = min(8, n)
        distance, other = cKDTree(self.points).query(self.points, k=many)
        distance, other = distance.reshape(n, -1), other.reshape(n, -1)
        reach = self._reach()
        i = np.broadcast_to(np.arange(n)[:, None], other.shape)
        near = (distance <= part * np.minimum(reach[i], reach[other])) & (i != other)
        i, j, d = i[near], other[near], distance[near]
        i, j = np.minimum(i, j), np.maximum(i, j)
        key, first = np.unique(i * n + j, return_index=True)
        i, j, d = key // n, key % n, d[first]
        if not len(i):
            return i, j, d
        sides = np.concatenate([self.cells[:, [a, b]] for a in range(4) for b in range(a + 1, 4)])
        sides = np.sort(sides[(sides >= 0).all(axis=1)], axis=1)
        apart = ~np.isin(key, sides[:, 0] * n + sides[:, 1])
        return i[apart], j[apart], d[apart]

    def check_near(self) -> None:
        i, j, d = self._close(NEAR)
        reach = self._reach()
        part = d / np.minimum(reach[i], reach[j]) if len(i) else d
        slit = part <= SEAM
        if slit.any():
            self.notes.append(f"{_some(slit, 'pair')} of nodes in one place kept: slits of zero width stay open")
        i, j, d, part = i[~slit], j[~slit], d[~slit], part[~slit]
        if len(i):
            self.refuse(
                f"nodes {self.node_name(i[0])} and {self.node_name(j[0])} at {_place(self.points[i[0]])} are "
                f"{show(float(d[0]), 'm')} apart, {part[0]:.1g} of their cells, and no cell joins them ({len(i)} such pairs); "
                f"merge them, or part them by more than {NEAR:g}"
            )

    def check_cells(self) -> None:
        cells = self.cells
        corners = np.sort(np.where(cells < 0, -1 - np.arange(4), cells), axis=1)
        _, inverse, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
        if count.max() > 1:
            same = np.flatnonzero(inverse.ravel() == np.argmax(count))
            self.refuse(f"{self.cell_name(same[0])} is there {count.max()} times, again as {self.raw.cell(int(self.cell[same[1]]))}")
        triangle = cells[:, 3] < 0
        p = self.corners()
        sides = np.linalg.norm(np.where(cells[:, :, None] < 0, 0, p - np.roll(p, -1, axis=1)), axis=2)
        longest = sides.max(axis=1)
        # twice the area of the triangle at every corner; a quadrangle needs all four of one sign
        at = np.cross(np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p)
        at[triangle] = np.cross(p[triangle, 1] - p[triangle, 0], p[triangle, 2] - p[triangle, 0])[:, None, :]
        with np.errstate(all="ignore"):
            height = np.linalg.norm(at, axis=2).min(axis=1) / longest**2
        flat = ~(height >= FLAT)
        if flat.any():
            row = int(np.argmax(flat))
            self.refuse(
                f"{self.cell_name(row)} at {_place(p[row].mean(axis=0))} is flat: its height is {height[row]:.1e} "
                f"of its longest side, at least {FLAT:g} is needed"
            )
        folded = (np.einsum("mci,mdi->mcd", at, at) < 0).any(axis=(1, 2))
        if folded.any():
            row = int(np.argmax(folded))
            self.refuse(f"{self.cell_name(row)}, a quadrangle at {_place(p[row].mean(axis=0))}, crosses itself or is not convex")

    def orient(self, plane: bool) -> None:
        """Cells turned so that neighbours agree: each piece as most of its cells say, outward where it is closed; in
        the plane, counter-clockwise seen from +z."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        cells, m = self.cells, len(self.cells)
        count = np.where(cells[:, 3] < 0, 3, 4)
        side = np.arange(4)[None, :]
        after = np.take_along_axis(cells, np.where(side == count[:, None] - 1, 0, np.minimum(side + 1, 3)), axis=1)
        real = side < count[:, None]
        owner = np.broadcast_to(np.arange(m)[:, None], cells.shape)[real]
        a, b = cells[real], after[real]
        key = np.minimum(a, b) * len(self.points) + np.maximum(a, b)
        order = np.argsort(key, kind="stable")
        starts = np.flatnonzero(np.r_[True, np.diff(key[order]) != 0])
        uses = np.diff(np.r_[starts, len(order)])
        if uses.max() > 2:
            worst = int(np.argmax(uses))
            half = order[starts[worst]]
            first, second = owner[order[starts[worst] : starts[worst] + 2]]
            self.refuse(
                f"the edge between nodes {self.node_name(a[half])} and {self.node_name(b[half])} bounds {uses.max()} cells "
                f"({self.cell_name(first)}, {self.raw.cell(int(self.cell[second]))}, ...); a surface has at most 2 on an edge"
            )
        one, two = order[starts[uses == 2]], order[starts[uses == 2] + 1]
        agree = a[one] == b[two]  # neighbours that agree run along their edge in opposite directions
        one, two = owner[one], owner[two]
        pieces, piece = connected_components(coo_array((np.ones(len(one)), (one, two)), shape=(m, m)), directed=False)
        flip = np.zeros(m, bool) if agree.all() else self._flips(one, two, agree)
        turned = np.bincount(piece, flip, minlength=pieces) > 0.5 * np.bincount(piece, minlength=pieces)
        flip ^= turned[piece]  # most of a piece's cells keep their direction
        if flip.any():
            self.notes.append(f"{_some(flip, 'cell')} turned round, as most of their piece say")
        self.cells = _turned(cells, flip)
        closed = np.bincount(piece[owner[order[starts[uses == 1]]]], minlength=pieces) == 0
        vectors = self.area_vectors()
        if plane:
            up = np.bincount(piece, vectors[:, 2], minlength=pieces) > 0
            self.cells = _turned(self.cells, ~up[piece])
        else:
            sums = np.stack([np.bincount(piece, c, minlength=pieces) for c in self.corners().mean(axis=1).T], axis=1)
            middle = sums / np.bincount(piece, minlength=pieces)[:, None]
            p = self.corners() - middle[piece][:, None, :]
            six = sum(np.einsum("mi,mi->m", p[:, 0], np.cross(p[:, k], p[:, k + 1])) for k in (1, 2))
            inward = closed & (np.bincount(piece, six, minlength=pieces) < 0)
            if inward.any():
                self.notes.append(f"{_some(inward, 'closed piece')} turned outward")
            self.cells = _turned(self.cells, inward[piece])
        area = self.area_vectors()
        normal = area / np.linalg.norm(area, axis=1)[:, None]
        lean = np.einsum("ki,ki->k", normal[one], normal[two])
        if len(lean) and lean.min() < FOLD:
            k = int(np.argmin(lean))
            at = _place(self.corners()[one[k]].mean(axis=0))
            self.refuse(f"{self.cell_name(one[k])} at {at} is folded onto its neighbour {self.raw.cell(int(self.cell[two[k]]))}")

    def _flips(self, one: np.ndarray, two: np.ndarray, agree: np.ndarray) -> np.ndarray:
        """(M,) cells to turn round so that all agree with the first cell of their piece."""
        around: list[list[tuple[int, bool]]] = [[] for _ in self.cells]
        for i, j, same in zip(one.tolist(), two.tolist(), agree.tolist()):
            around[i].append((j, not same))
            around[j].append((i, not same))
        flip, seen = np.zeros(len(self.cells), bool), np.zeros(len(self.cells), bool)
        for seed in range(len(self.cells)):
            if seen[seed]:
                continue
            seen[seed] = True
            queue = deque([seed])
            while queue:
                i = queue.popleft()
                for j, other in around[i]:
                    if not seen[j]:
                        seen[j], flip[j] = True, flip[i] ^ other
                        queue.append(j)
                    elif flip[j] != flip[i] ^ other:
                        self.refuse(
                            f"the surface has one side only (a Moebius strip) near {self.cell_name(j)}; it cannot be given a normal"
                        )
        return flip

    def finished(self, plane: bool, scale: float) -> SurfaceMesh:
        regions = {}
        for name, rows in self.raw.regions.items():
            mask = np.isin(self.cell, rows)
            if mask.any():
                regions[name] = mask
        thickness = {name: value * scale for name, value in self.raw.thickness.items() if name in regions}
        mesh = SurfaceMesh(
            self.points, self.cells.astype(np.int32), self.spacing(), regions=regions, thickness=thickness, notes=tuple(self.notes)
        )
        if plane:
            z = self.points[:, 2]
            if np.ptp(z) > 1e-9 * np.ptp(self.points, axis=0).max():
                row = int(np.argmax(np.abs(z - np.median(z))))
                self.refuse(
                    f"node {self.node_name(row)} has z = {z[row]:.6g} m, others {np.median(z):.6g} m; "
                    "a body with motion 'in_plane' needs a plane mesh, z = constant"
                )
            return mesh
        with np.errstate(all="ignore"):
            normals = fitted_normals(mesh)
        back = np.zeros(len(self.points), bool)
        for k in range(4):
            has = self.cells[:, k] >= 0
            behind = ~(np.einsum("mi,mi->m", normals[self.cells[has, k]], mesh.frames[has, 2]) > 0)
            back[self.cells[has, k][behind]] = True
        if back.any():
            row = int(np.argmax(back))
            self.refuse(f"node {self.node_name(row)} at {_place(self.points[row])} has no normal: the cells around it face each other")
        return replace(mesh, normals=normals)


def _turned(cells: np.ndarray, which: np.ndarray) -> np.ndarray:
    """The cells with the order of their corners reversed where asked (first corner kept)."""
    result = cells.copy()
    triangle = cells[:, 3] < 0
    three, four = which & triangle, which & ~triangle
    result[three] = cells[three][:, [0, 2, 1, 3]]
    result[four] = cells[four][:, [0, 3, 2, 1]]
    return result


def _some(which: np.ndarray, what: str) -> str:
    return f"{int(which.sum())} {what}{'' if which.sum() == 1 else 's'}"


def _place(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") m"

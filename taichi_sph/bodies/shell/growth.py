"""What the parts of a shell hand on when more of its elements become particles, during a run.

The parts are built anew about the same reference. What exists before and after keeps its history, row by row. A particle that is new moves
as the element did there, by its shape functions. Its cell takes the history of the nearest stress point of that element, turned into its
own frame. Only what follows from the new neighbourhoods changes, and as after a rupture: stresses and plastic states are kept, and the
strains of the new neighbourhoods are the base of what is to come (`Galerkin.restrain`). Sums of energy of what is gone are not handed on:
the world books them (world/growth.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import runtime
from .group import ShellGroup
from .parts import GAUSS, Split, shapes
from .pressure import START

SUMS = ("lost", "dissipated", "held_lost", "held_flow", "residual_lost", "slipped", "work")  # J, so far: of what is gone they are booked
OF_MASS = ("kinetic", "ahead", "ahead_spin")  # J: they go with the mass of a node
OF_AREA = ("held_energy",)  # J: with what an element counts
TENSORS = {"stress": (3, 3, 2), "strain": (3, 3, 2), "layer_stress": (3,), "shear_stress": (2,)}  # sizes of parts in the frame of the point
DOUBLED = ("strain",)  # their third component is twice the shear
MOTION = ("u", "v", "d", "omega")
LEFT_OUT = ("mode", "frequency", "cut", "own", "place", "force", "torque")  # follow from the new neighbourhoods, or from the next step


@dataclass
class Before:
    """A group before it is built anew: the history of its pools, in their order, and what its rows are."""

    split: Split
    history: list[dict[str, np.ndarray]]
    kept: list[dict[str, Any]]
    mass: np.ndarray
    area: np.ndarray  # (M,) of cells, weighed [m2]
    frames: np.ndarray  # (S, 2, 3) a_1, a_2 of the points of stress
    per_cell: int
    n_nodes: int
    n_cells: int
    touch: np.ndarray  # (N, 3) force of contact and of water on the nodes [N]
    coef: np.ndarray | None = None  # of the particles: their rows
    cut: np.ndarray | None = None
    source: np.ndarray | None = None
    start: np.ndarray | None = None
    edges: np.ndarray | None = None


def before(group: ShellGroup, touch: np.ndarray) -> Before:
    """Copies: the fields are lost when the groups are built anew. touch (N, 3): force of contact and of water on the nodes [N]."""
    pools = group.pools()
    found = Before(
        split=_split(group),
        history=[{name: runtime.get(e.field, e.n) for name, e in pool.fields.items() if e.keeps} for pool in pools],
        kept=[{name: getattr(pool, name) for name in pool.kept} for pool in pools],
        mass=_of_nodes(group, "mass"),
        area=runtime.get(group.points.area, group.points.n).astype(np.float64).reshape(group.cells.n, -1).sum(axis=1),
        frames=_frames(group),
        per_cell=group.points.n // group.cells.n,
        n_nodes=group.nodes.n,
        n_cells=group.cells.n,
        touch=touch,
    )
    rows = getattr(group.internal, "rows", None)
    if rows is not None:
        found.coef, found.cut, found.source = (runtime.get(f, rows.pairs) for f in (rows.coef, rows.cut, rows.source))
        found.start, found.edges = runtime.get(rows.start, rows.n + 1), group.mesh.edges.nodes.copy()
    return found


def _split(group: ShellGroup) -> Split:
    (body,) = group.shells
    assert body.split is not None
    return body.split


def _of_nodes(group: ShellGroup, name: str) -> np.ndarray:
    return runtime.get(getattr(group.nodes, name), group.nodes.n).astype(np.float64)


def _frames(group: ShellGroup) -> np.ndarray:
    n = group.points.n
    found = np.stack([runtime.get(f, n).astype(np.float64) for f in (group.points.a1, group.points.a2)], axis=1)
    return np.pad(found, ((0, 0), (0, 0), (0, 3 - found.shape[2])))


def hand_on(groups: tuple[Any, Any], were: tuple[Before, Before | None]) -> None:
    """History, from what was to the elements and the particles that are, and what is cut of their neighbourhoods. were: None of particles
    where there were none."""
    elements, particles = groups
    _copy(elements, were[0], *_kept_elements(were[0].split, _split(elements)))
    nodes, cells = _kept_particles(were[1], _split(particles))
    if were[1] is not None:
        _copy(particles, were[1], nodes, cells)
    _interpolate(particles, were[0], nodes, cells)
    # masses of elements stand at their nodes: what they are moved by when spread over particles is given back
    lacking = sum(was.mass @ was.history[0]["v"].astype(np.float64) for was in were if was is not None)
    lacking = lacking - sum(_of_nodes(group, "mass") @ _of_nodes(group, "v") for group in groups)
    new = np.flatnonzero(nodes < 0)
    _put(particles.nodes, "v", new, _of_nodes(particles, "v")[new] + lacking / _of_nodes(particles, "mass")[new].sum())
    form, cells = particles.internal, particles.cells
    broken = np.flatnonzero(runtime.get(cells.broken, cells.n))
    if len(broken):
        runtime.put(cells.new, broken.astype(np.int32))
        form.rows.cut_through(cells, cells.new, len(broken))
        form.rows.renew_all()
        form.renew()


def settle(groups: tuple[Any, Any], were: tuple[Before, Before | None], time: float, dt: float) -> None:
    """Once velocities are tied: what follows from the new neighbourhoods; time [s] of the last forces, dt [s] of the step since."""
    from scipy.spatial import cKDTree

    elements, particles = groups
    nodes, _ = _kept_particles(were[1], _split(particles))
    _as_of(particles, dt, lambda: _rebase(particles, were[1], nodes))
    of_elements, _ = _kept_elements(were[0].split, _split(elements))
    touch = np.zeros((len(nodes), 3)) if were[1] is None else np.where(nodes[:, None] < 0, 0.0, were[1].touch[nodes])
    gone = np.setdiff1d(np.arange(were[0].n_nodes), of_elements)  # where they were there are particles now
    _, there = cKDTree(particles.mesh.points).query(were[0].split.elements.points[gone])
    np.add.at(touch, there, were[0].touch[gone])
    for group, was, kept, touched in (
        (elements, were[0], of_elements, were[0].touch[of_elements]),
        (particles, were[1], nodes, touch),
    ):
        _as_of(group, dt, lambda group=group: _look(group, time))
        _kinetic(group, was, kept, touched, dt)


def _look(group: Any, time: float) -> None:
    """Forces, and the places from which pressures do their work."""
    group.internal.strain(0.0)
    if group.pressures is not None:
        group.pressures.press(time, START)
    group.internal.force()


def _kinetic(group: Any, was: Before | None, kept: np.ndarray, touch: np.ndarray, dt: float) -> None:
    """Of nodes that are new, or weigh something else, the kinetic energy that fits their forces, so that the next step closes the ledger:
    1/2 m v_n-1/2 . v_n+1/2 with v_n-1/2 = v_n+1/2 - dt f_n / m, and the same of directors."""
    nodes, mass = group.nodes, _of_nodes(group, "mass")
    changed = kept < 0
    if was is not None:
        changed |= np.abs(was.mass[kept] - mass) > 1e-9 * mass
    v, force = _of_nodes(group, "v"), _of_nodes(group, "force")
    force += touch[:, : nodes.dim]
    energy = 0.5 * mass * (v**2).sum(axis=1) - 0.5 * dt * (v * force).sum(axis=1)
    if nodes.bends:
        omega, n = _of_nodes(group, "omega"), _of_nodes(group, "N") + _of_nodes(group, "d")
        torque = np.cross(n, _of_nodes(group, "couple"))
        energy += 0.5 * _of_nodes(group, "inertia") * (omega**2).sum(axis=1) - 0.5 * dt * (omega * torque).sum(axis=1)
    for name in ("ahead", "ahead_spin"):
        if name in group.loads.fields:
            energy -= runtime.get(getattr(group.loads, name), nodes.n)
    rows = np.flatnonzero(changed)
    _put(nodes, "kinetic", rows, energy[rows])


def _kept_elements(was: Split, now: Split) -> tuple[np.ndarray, np.ndarray]:
    """(N,) and (M,) numbers before of the nodes and of the elements that are."""
    return was.number[now.nodes], np.searchsorted(was.cells, now.cells)


def _kept_particles(before: Before | None, now: Split) -> tuple[np.ndarray, np.ndarray]:
    """(N,) and (M,) numbers before of the nodes and of the cells of particles that are; -1: they are new."""
    if before is None:
        return np.full(len(now.fine.mesh.points), -1), np.full(len(now.fine.mesh.cells), -1)
    n, was = now.n, before.split

    def name(fine: Any) -> np.ndarray:
        return (fine.parent * n + fine.place[:, 1]) * n + fine.place[:, 0]

    old, new = name(was.fine), name(now.fine)
    order = np.argsort(old)
    at = np.minimum(np.searchsorted(old[order], new), len(old) - 1)
    cells = np.where(old[order][at] == new, order[at], -1)
    nodes = np.full(len(now.fine.mesh.points), -1)
    there = cells >= 0
    nodes[now.fine.mesh.cells[there].ravel()] = was.fine.mesh.cells[cells[there]].ravel()
    return nodes, cells


def _copy(group: ShellGroup, was: Before, nodes: np.ndarray, cells: np.ndarray) -> None:
    """The history of the rows that were there."""
    mass = _of_nodes(group, "mass")
    layers = max(group.material.layers, 1) if group.material.yields else 1
    of_layer = ("layer", "layer_stress")
    for pool, history, kept in zip(group.pools(), was.history, was.kept, strict=True):
        for name, value in kept.items():
            if name not in LEFT_OUT:
                setattr(pool, name, value)
        for name, old in history.items():
            entry = pool.fields[name]
            if name in LEFT_OUT:
                continue
            now = runtime.get(entry.field, entry.n)
            if name in of_layer:
                old, now = old.reshape(-1, layers, *old.shape[1:]), now.reshape(-1, layers, *now.shape[1:])
            of_nodes = pool in (group.nodes, group.loads) or (pool is group.internal and hasattr(pool, "rows"))
            rows = nodes if of_nodes else _of_cells(len(old), len(now), was, group, cells)
            if rows is None:
                continue
            there = rows >= 0
            now[there] = old[rows[there]]
            if name in OF_MASS:
                now[there] *= (mass / np.where(there, was.mass[rows], 1.0))[there]
            if name in OF_AREA:
                now[there] *= (runtime.get(group.points.area, group.points.n).reshape(len(now), -1).sum(axis=1) / was.area[rows])[there]
            runtime.put(entry.field, now.reshape(-1, *now.shape[2:]) if name in of_layer else now)


def _of_cells(before: int, now: int, was: Before, group: ShellGroup, cells: np.ndarray) -> np.ndarray | None:
    """Which rows of a field the rows of now were, whose field is one of cells or of points of stress; None: of neither."""
    per = was.per_cell
    if (before, now) == (was.n_cells, group.cells.n):
        return cells
    if (before, now) == (per * was.n_cells, group.points.n):
        return np.where(cells[:, None] < 0, -1, per * cells[:, None] + np.arange(per)).ravel()
    return None


def _interpolate(particles: ShellGroup, was: Before, nodes: np.ndarray, cells: np.ndarray) -> None:
    """Motion of new particles and history of their cells, from the elements that were there."""
    split = _split(particles)
    fine, n = split.fine, split.n
    new = np.flatnonzero(cells < 0)
    if len(new) == 0:
        return
    # a corner of a new cell for each new node: its element, and its place there
    corner = fine.mesh.cells[new]
    place = fine.place[new][:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    parent = np.repeat(fine.parent[new], 4)
    node, first = np.unique(corner.ravel(), return_index=True)
    node, first = node[nodes[node] < 0], first[nodes[node] < 0]
    r, s = (2.0 * place.reshape(-1, 2)[first] / n - 1.0).T
    N = shapes(r, s)
    of = was.split.number[split.whole.cells[parent[first]]]
    pool = particles.nodes

    def there(values: np.ndarray) -> np.ndarray:
        return np.einsum("kc,kc...->k...", N, values[of].astype(np.float64))

    old = was.history[0]
    for name in MOTION[:2]:
        _put(pool, name, node, there(old[name]))
    if pool.bends:
        normals = was.split.elements.node_normals
        director = there(normals + old["d"])
        length = np.linalg.norm(director, axis=1, keepdims=True)
        rate = there(np.cross(old["omega"], normals + old["d"])) / length
        director /= length
        _put(pool, "d", node, director - particles.mesh.node_normals[node])
        _put(pool, "omega", node, np.cross(director, rate))
    _histories(particles, was, new)


def _put(pool: Any, name: str, rows: np.ndarray, values: np.ndarray) -> None:
    entry = pool.fields[name]
    now = runtime.get(entry.field, entry.n)
    now[rows] = values
    runtime.put(entry.field, now)


def _histories(particles: ShellGroup, was: Before, new: np.ndarray) -> None:
    """Of new cells that of the nearest point of their element."""
    split, points = _split(particles), particles.points
    fine = split.fine
    element = np.searchsorted(was.split.cells, fine.parent[new])
    middle = (2.0 * (fine.place[new] + 0.5) / split.n - 1.0)[:, None]
    nearest = np.linalg.norm(middle - GAUSS, axis=2).argmin(axis=1) if was.per_cell == 4 else 0
    point = was.per_cell * element + nearest
    turn = np.einsum("sai,sbi->sab", _frames(particles)[new], was.frames[point])
    old = {name: values for history in was.history for name, values in history.items() if len(values) % len(was.frames) == 0}
    for name, entry in points.fields.items():
        if not entry.keeps or name in (*SUMS, "broken", "rupture_time") or name not in old:
            continue
        now, values = runtime.get(entry.field, entry.n), old[name]
        layers = entry.n // points.n
        values = values.reshape(len(was.frames), layers, *values.shape[1:])[point].astype(np.float64)
        if name in TENSORS:
            values = _turned(values, turn[:, None], TENSORS[name], name in DOUBLED)
        now.reshape(points.n, layers, *now.shape[1:])[new] = values
        runtime.put(entry.field, now)


def _turned(values: np.ndarray, turn: np.ndarray, parts: tuple[int, ...], doubled: bool) -> np.ndarray:
    """(..., c) components in the frame of an element -> in that of a cell; parts of three are tensors 11, 22, 12, of two vectors."""
    found, first, shear = np.empty_like(values), 0, 0.5 if doubled else 1.0
    for size in parts:
        part = values[..., first : first + size]
        if part.shape[-1] == 2:
            found[..., first : first + 2] = np.einsum("...ab,...b->...a", turn, part)
        elif part.shape[-1] == 3:
            s12 = shear * part[..., 2]
            whole = np.stack([np.stack([part[..., 0], s12], -1), np.stack([s12, part[..., 1]], -1)], -2)
            whole = turn @ whole @ np.swapaxes(turn, -1, -2)
            found[..., first : first + 3] = np.stack([whole[..., 0, 0], whole[..., 1, 1], whole[..., 0, 1] / shear], -1)
        first += size
    return found


def _rebase(particles: Any, was: Before | None, nodes: np.ndarray) -> None:
    """The strains that the new neighbourhoods see are the base of those to come. nodes: numbers before, -1: new."""
    form = particles.internal
    touched, stiffer = np.arange(form.rows.n), np.ones(len(nodes))
    if was is not None:
        touched = _touched(particles, was, nodes)
        stiffer = np.where(nodes < 0, 1.0, _of_nodes(particles, "mass") / was.mass[nodes])
    for name, power in (("residual", 1.0), ("slip", 0.5)):  # they go with the stiffness, which goes with the weight
        if name in form.fields:
            entry = form.fields[name]
            runtime.put(entry.field, (runtime.get(entry.field, entry.n).T * stiffer**power).T)
    runtime.put(form.rows.touched, touched.astype(np.int32))
    form.strain(0.0)
    form.restrain(form.rows, len(touched))
    runtime.fill(particles.cells.n_new, 0)


def _touched(particles: Any, was: Before, nodes: np.ndarray) -> np.ndarray:
    """Rows that see other nodes than before, or see them otherwise."""
    import scipy.sparse as sp

    rows, edges = particles.internal.rows, particles.mesh.edges.nodes
    n, were = particles.nodes.n, was.edges
    assert were is not None and was.coef is not None and was.source is not None and was.start is not None
    back = np.full(was.n_nodes, -1)
    back[nodes[nodes >= 0]] = np.flatnonzero(nodes >= 0)
    name = {tuple(sorted(pair)): k for k, pair in enumerate(back[were].tolist())}
    of_edges = np.array([name.get(tuple(sorted(pair)), -1) for pair in edges.tolist()])
    old_row = np.r_[of_edges, np.where(nodes < 0, -1, len(were) + nodes)]
    coef, source = (runtime.get(f, rows.pairs) for f in (rows.coef, rows.source))
    now = sp.csr_array((coef.astype(float), source, runtime.get(rows.start, rows.n + 1)), shape=(rows.n, n))
    data, column = was.coef.astype(float), back[was.source]
    old = sp.csr_array((np.where(column < 0, 0.0, data), np.maximum(column, 0), was.start), shape=(len(was.start) - 1, n))
    there = np.flatnonzero(old_row >= 0)
    changed = np.ones(rows.n, bool)
    difference = abs(now[there] - old[old_row[there]])
    changed[there] = difference.max(axis=1).toarray().ravel() > 1e-12 * abs(now).max()
    return np.flatnonzero(changed)


def _as_of(group: Any, dt: float, act: Any) -> None:
    """Act with the nodes where the last forces saw them, a step of dt ago."""
    nodes, n = group.nodes, group.nodes.n
    u, v = runtime.get(nodes.u, n), runtime.get(nodes.v, n)
    runtime.put(nodes.u, u - dt * v)
    if nodes.bends:
        d, N, theta = runtime.get(nodes.d, n), runtime.get(nodes.N, n), -dt * runtime.get(nodes.omega, n)
        angle = np.linalg.norm(theta, axis=1, keepdims=True)
        sinc = np.where(angle > 1e-2, np.sin(angle) / np.maximum(angle, 1e-2), 1.0 - angle**2 / 6.0)
        versine = np.where(angle > 1e-2, (1.0 - np.cos(angle)) / np.maximum(angle, 1e-2) ** 2, 0.5 - angle**2 / 24.0)
        turned = np.cross(theta, N + d)
        runtime.put(nodes.d, d + sinc * turned + versine * np.cross(theta, turned))
    act()
    runtime.put(nodes.u, u)
    if nodes.bends:
        runtime.put(nodes.d, d)

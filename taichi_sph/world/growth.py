"""Patches that grow: more elements of a shell become particles, during the run (bodies/shell/growth.py).

The world is built anew about the scene with the wider patch, and takes over what was. Energies that are no longer anywhere else are booked
here, and so is what the change itself makes or takes, kinetic and elastic energy of the new particles less that of the elements they were.
A checkpoint holds the patches as they are, so a restart is exact. Points that water presses on are those of the parts as they are now: they
have no history but their places.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import runtime
from ..bodies.body import Entries, holding
from ..bodies.shell import growth
from ..bodies.shell.said import PARTICLES
from ..errors import RunStopped, SceneError
from ..pool import Pool
from ..scene import Scene
from .ledger import summed

if TYPE_CHECKING:
    from .world import World

OPEN = ("kinetic", "elastic")  # what bodies hold: all other entries only ever grow


class Grown(Pool):
    """What is booked of growth [J], by the names of the ledger; events: how often a patch grew."""

    kept = ("events", "booked")

    def __init__(self, names: list[str]):
        super().__init__("grown")
        self.events, self.names, self.booked = 0, names, np.zeros(len(names))

    def book(self, was: Entries, now: Entries) -> None:
        """The difference of the ledger before and after."""
        first, second = _numbers(was), _numbers(now)
        for k, name in enumerate(self.names):
            if name == "growth":
                self.booked[k] += sum(first[key] - second[key] for key in OPEN)
            else:
                self.booked[k] += first.get(name, 0.0) - second.get(name, 0.0)

    def add_to(self, found: Entries) -> None:
        """What is booked, to the entries of the world."""
        for name, value in zip(self.names, self.booked.tolist()):
            if name == "external":
                found.external += value
            else:
                of = found.internal if name in found.internal else found.numerical
                of[name] = of.get(name, 0.0) + value


def _numbers(found: Entries) -> dict[str, float]:
    return {"kinetic": found.kinetic, "external": found.external, **found.internal, **found.numerical}


def grows(scene: Scene) -> bool:
    """Whether any patch of a scene does."""
    return any(shell.patch is not None and shell.patch.grows for shell in scene.shells)


def names_of(world: World) -> list[str]:
    """What there is to book."""
    return [name for name in _numbers(summed(world.groups, world.couplings)) if name not in OPEN] + ["growth"]


def widened(scene: Scene, cells: Mapping[str, tuple[int, ...]]) -> Scene:
    """The scene with the patches of shells holding these elements beside those of their regions."""
    shells = []
    for shell in scene.shells:
        if shell.name in cells and shell.patch is not None:
            shell = shell.model_copy(update={"patch": shell.patch.model_copy(update={"cells": tuple(cells[shell.name])})})
        shells.append(shell)
    return scene.model_copy(update={"shells": tuple(shells)})


def patches(scene: Scene) -> dict[str, np.ndarray]:
    """For a checkpoint: what has grown of each patch that may."""
    return {
        f"grown.cells_{shell.name}": np.array(shell.patch.cells, np.int32)
        for shell in scene.shells
        if shell.patch is not None and shell.patch.grows
    }


def as_in(scene: Scene, state: Mapping[str, np.ndarray]) -> Scene | None:
    """The scene with the patches of a checkpoint; None where they are those of the scene."""
    found = {key: np.asarray(state[key]) for key in patches(scene) if key in state}
    if all(np.array_equal(found[key], mine) for key, mine in patches(scene).items() if key in found):
        return None
    return widened(scene, {key.removeprefix("grown.cells_"): tuple(cells.tolist()) for key, cells in found.items()})


def grow(world: World, wanted: Mapping[str, tuple[int, ...]]) -> None:
    """Let the patches of shells hold the elements `wanted` from now on. RunStopped where they cannot."""
    time, dt = world.time - world.clock.dt_before, world.clock.dt_before
    books, before, was = world.entries(), world.scene, world.state()
    old = {name: _parts(world, name) for name in wanted}
    were = {name: (growth.before(a, _touch(world, a, dt)), b and growth.before(b, _touch(world, b, dt))) for name, (a, b) in old.items()}
    changing = {id(pool) for pair in old.values() for group in pair if group is not None for pool in group.pools()}
    kept = [pool.state() for pool in world.pools if id(pool) not in changing]
    contact = _of_contact(world)
    try:
        world.build(widened(world.scene, wanted))
    except SceneError as error:
        world.build(before)  # what was built so far has taken the place of what there was
        world.restore(was)
        whose = " and ".join(f"'{name}'" for name in wanted)
        raise RunStopped(
            f"at t = {world.time:.6g} s damage or a fast striker comes near elements of shell {whose}, whose patch cannot grow "
            f"there: {error}"
        ) from None
    changed = {name: _parts(world, name) for name in wanted}
    changing = {id(pool) for pair in changed.values() for group in pair for pool in group.pools()}
    state = {name: value for one in kept for name, value in one.items()}
    changing |= {id(pool) for coupling in _wet(world) for pool in coupling.pools()}
    ties = [coupling.tie for coupling in world.couplings if getattr(coupling, "name", None) in wanted]
    changing |= {id(tie) for tie in ties}  # other nodes are tied now, be they as many
    for pool in world.pools:
        if id(pool) not in changing:
            _restore(pool, state)
    for name, pair in changed.items():
        growth.hand_on(pair, were[name])
    _to_contact(world, contact)
    for pool in world.pools:
        if id(pool) not in changing:
            pool.renew()
    for coupling in world.couplings:
        if getattr(coupling, "name", None) in wanted:
            coupling.start()
    for coupling in _wet(world):
        coupling.begin_anew()
    for name, pair in changed.items():
        growth.settle(pair, were[name], time, dt)
    assert world.grown is not None
    world.grown.events += 1
    world.grown.book(books, world.entries())
    world.clock.refit |= world.longest < world.dt


def _touch(world: World, group: Any, dt: float) -> np.ndarray:
    """(N, 3) force of contact and of water [N] on the nodes of a group in the last step, which was dt [s] long."""
    found = np.zeros((group.nodes.n, 3))
    for coupling in _wet(world):
        found += coupling.pushed(group, world.step - 1)
    contact = world.contact
    if contact is None or not contact.touching:
        return found
    n = contact.pairs.n_who
    port = contact.port
    who, whose, impulse = (runtime.get(field, n) for field in (port.who, port.whose, port.impulse))
    acts = runtime.get(port.pushed, port.n_bodies)[whose] == 1  # of others it is what was left of a step before
    for surface in port.surfaces:
        if surface.group is group:
            mine = (who >= surface.first.mover) & (who < surface.first.mover + surface.n) & acts
            found[who[mine] - surface.first.mover] = impulse[mine] / dt
    return found


def _wet(world: World) -> list[Any]:
    """Couplings of fluids that press."""
    return [coupling for coupling in world.couplings if hasattr(coupling, "wetted")]


def _parts(world: World, name: str) -> tuple[Any, Any]:
    """The groups of elements and of particles; None of particles where the patch has not begun."""
    begun = any(span.name == name + PARTICLES for group in world.groups for span in group.bodies)
    return holding(world.groups, name)[0], holding(world.groups, name + PARTICLES)[0] if begun else None


def _restore(pool: Pool, state: Mapping[str, np.ndarray]) -> None:
    """What has the same shape as before; pools of contact are searched anew."""
    if pool.name.partition(".")[0] in ("contact", "pairs", "port"):
        return
    for name, entry in pool.fields.items():
        full = f"{pool.name}.{name}"
        if entry.keeps and full in state and len(state[full]) == entry.n:
            runtime.put(entry.field, state[full])
    for name in pool.kept:
        full = f"{pool.name}.{name}"
        if full in state:
            before = getattr(pool, name)
            setattr(pool, name, state[full].copy() if isinstance(before, np.ndarray) else type(before)(state[full]))


def _of_contact(world: World) -> dict[str, Any]:
    """Sums of the solver of contact."""
    contact = world.contact
    if contact is None:
        return {}
    found: dict[str, Any] = {name: getattr(contact, name) for name in (*contact.kept, "seconds")}
    for name in ("work", "ahead", "rubbed", "rubs_ahead"):
        entry = contact.fields[name]
        found[name] = np.array([runtime.get(entry.field, entry.n).sum()])
    found["deepest"] = runtime.get(contact.deepest, 1)
    return found


def _to_contact(world: World, found: dict[str, Any]) -> None:
    contact = world.contact
    for name, value in found.items():
        if name in contact.fields:
            runtime.put(contact.fields[name].field, value)
        else:
            setattr(contact, name, value)

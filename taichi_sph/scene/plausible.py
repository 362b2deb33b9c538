"""Checks across the keys of a scene: units that were probably meant otherwise, names, sizes.

Each raises ValueError with a sentence that starts with the key; `schema` calls them once the single
values are known to be numbers in range.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ..errors import nearest
from .units import show

if TYPE_CHECKING:
    from .schema import Material, Plate, Scene, Shell

MAX_NODES = 50_000_000
MAX_STEPS = 20_000_000
TIMELESS = ("static", "modes", "limit")  # what a scene may ask for instead of a motion


def material(m: Material) -> None:
    """Density, modulus and wave speed of the solids there are (foams and balsa to osmium; gels excluded)."""
    if not 25.0 <= m.density <= 25_000.0:
        for unit, factor in (("g/cm^3", 1e3), ("tonne/mm^3", 1e12), ("kg/mm^3", 1e9)):
            if 100.0 <= m.density * factor <= 25_000.0:
                hint = f"; it looks like {unit}: write '{m.density:g} {unit}'"
                break
        else:
            hint = ""
        raise ValueError(f"density {m.density:g} kg/m^3 is not that of a solid (25 to 25000 kg/m^3){hint}")
    if not 1e3 <= m.young <= 2e12:
        hint = ""
        if m.young < 1e3:
            unit = "GPa" if m.young >= 1.0 else "TPa"
            hint = f"; it looks like {unit}: write '{m.young:g} {unit}'"
        raise ValueError(f"young {m.young:g} Pa is outside 1 kPa to 2 TPa{hint}")
    speed = math.sqrt(m.young / m.density)
    if not 10.0 <= speed <= 30_000.0:
        hint = f"; young looks like MPa: write '{m.young:g} MPa'" if speed < 10.0 else ""
        raise ValueError(
            f"young {show(m.young, 'Pa')} with density {m.density:g} kg/m^3 gives a wave speed of {speed:.3g} m/s, "
            f"outside 10 to 30000 m/s{hint}"
        )
    s = m.strength
    if s is not None:
        stress = s.points[0][1] if s.kind == "table" else s.yield_stress if s.kind == "perfect" else s.A
        if not 1e-6 * m.young <= stress <= 0.1 * m.young:
            raise ValueError(
                f"strength: a first yield stress of {show(stress, 'Pa')} is not that of a solid of young {show(m.young, 'Pa')} "
                "(a millionth to a tenth of it); is it in MPa?"
            )


def plate(shell: Shell) -> None:
    """Thickness and cuts against the size of a plate."""
    surface: Plate = shell.surface  # type: ignore[assignment]
    size = max(surface.length, surface.width)
    if shell.thickness > size:
        raise ValueError(
            f"thickness {show(shell.thickness, 'm')} of shell '{shell.name}' is larger than the plate itself "
            f"({show(surface.length, 'm')} x {show(surface.width, 'm')})"
        )
    low = surface.origin
    high = (low[0] + surface.length, low[1] + surface.width, low[2])
    margin = 0.05 * size  # a cut may start a little outside: it is the edge that it must open
    for number, cut in enumerate(shell.cuts):
        for end, point in (("start", cut.start), ("end", cut.end)):
            for axis in range(3):
                if not low[axis] - margin <= point[axis] <= high[axis] + margin:
                    raise ValueError(
                        f"cuts[{number}].{end}: {'xyz'[axis]} = {show(point[axis], 'm')} is outside the plate "
                        f"'{shell.name}' ({show(low[axis], 'm')} to {show(high[axis], 'm')})"
                    )


def rounded(shell: Shell) -> None:
    """Thickness against the radius that every other generated surface has."""
    radius = shell.surface.radius  # type: ignore[union-attr]
    if shell.thickness > radius:
        raise ValueError(
            f"thickness {show(shell.thickness, 'm')} of shell '{shell.name}' is larger than the radius of its "
            f"{shell.surface.kind} ({show(radius, 'm')})"
        )


def scene(s: Scene) -> None:
    """Names, loads, and the size of the computation."""
    if not (s.shells or s.rigids or s.fluids):
        raise ValueError("shells, rigids and fluids are empty: a scene needs at least one body")
    if len(s.shells) > 1:
        raise ValueError(f"shells has {len(s.shells)} entries; one body per scene can be computed so far")
    _rigids(s)
    _fluids(s)
    _contact(s)
    names = [shell.name for shell in s.shells]
    for key in ("forces", "moments", "pressures", "motions", "initial"):
        for number, load in enumerate(getattr(s, key)):
            if load.shell not in names:
                raise ValueError(f"{key}[{number}].shell: there is no shell '{load.shell}'{nearest(load.shell, names)}")
            if s.shells[names.index(load.shell)].motion == "in_plane":
                _stays_in_plane(f"{key}[{number}]", key, load)
    if s.gravity is not None and s.gravity[2] and any(shell.motion == "in_plane" for shell in s.shells):
        raise ValueError("gravity: z must be 0, for the shell moves in its plane (motion = 'in_plane')")
    if s.pressures and s.numerics.formulation.kind != "galerkin":
        raise ValueError(
            f"pressures: numerics.formulation '{s.numerics.formulation.kind}' has no surface pressure; use 'galerkin', or forces"
        )
    if getattr(s.numerics.formulation, "selective_shear", False) and any(x.material.damage or x.material.strength for x in s.shells):
        raise ValueError("numerics.formulation.selective_shear knows no damage and no strength of the nodes' shear; leave one of them out")
    kinds = [key for key in TIMELESS if getattr(s, key) is not None]
    if len(kinds) > 1:
        raise ValueError(f"{kinds[0]} and {kinds[1]} are both set: a scene asks for one of them")
    if s.static is not None:
        if any(shell.material.damage is not None for shell in s.shells):
            raise ValueError("static: a material with damage needs time to be damaged; leave out static or damage")
        if any(shell.material.strength is not None for shell in s.shells):
            raise ValueError("static: a material with strength yields in time; leave out static or strength")
        _still(s, "static", "a prescribed motion cannot move")
    if s.limit is not None:
        for key in ("forces", "moments", "pressures", "gravity"):
            if getattr(s, key):
                raise ValueError(f"limit: {key} would drive the motion whose growth is looked for; leave them out")
        _still(s, "limit", "a prescribed motion would drive the motion whose growth is looked for")
    for number, probe in enumerate(s.output.probes):
        if probe.shell not in names:
            raise ValueError(f"output.probes[{number}].shell: there is no shell '{probe.shell}'{nearest(probe.shell, names)}")
        if probe.name in [p.name for p in s.output.probes[:number]]:
            raise ValueError(f"output.probes[{number}].name: '{probe.name}' is taken")
    asked: list[tuple[str, dict[str, object]]] = []
    for quantity in s.quantities:
        if (quantity.name, quantity.options) in asked:
            raise ValueError(f"quantities: '{quantity.name}' is asked for twice with the same options")
        asked.append((quantity.name, dict(quantity.options)))
    _size(s)


def _rigids(s: Scene) -> None:
    """Rigid bodies beside the rest of the scene."""
    taken = [shell.name for shell in s.shells]
    for number, body in enumerate(s.rigids):
        if body.name in taken:
            raise ValueError(f"rigids[{number}].name: '{body.name}' is taken; names of bodies name their files")
        taken.append(body.name)
    if not s.rigids:
        return
    if all(body.held for body in s.rigids) and not s.shells:
        raise ValueError("rigids: all bodies are held and there is no other one: nothing can move")
    for shell in s.shells:
        if shell.motion == "in_plane":
            raise ValueError(f"rigids: shell '{shell.name}' moves in its plane and cannot be hit; give it motion = 'free'")
    _in_time(s, "rigid bodies move", "rigids")


def _contact(s: Scene) -> None:
    """Settings of contact in scenes where nothing meets."""
    own = any(shell.self_contact for shell in s.shells)
    for number, shell in enumerate(s.shells):
        if shell.self_contact and shell.motion == "in_plane":
            raise ValueError(f"shells[{number}].self_contact: shell '{shell.name}' moves in its plane; give it motion = 'free'")
    if own:
        _in_time(s, "contact moves", "self_contact")
    if s.numerics.contact is not None and not (own or s.rigids or (s.fluids and s.shells)):
        raise ValueError("numerics.contact: no two bodies of this scene can meet; leave it out")


def _fluids(s: Scene) -> None:
    """Fluids beside the rest of the scene."""
    if not s.fluids:
        if s.walls:
            raise ValueError("walls hold fluids, and the scene has none: leave them out or add a fluid")
        return
    if len(s.fluids) > 1:
        raise ValueError(f"fluids has {len(s.fluids)} entries; one fluid per scene can be computed so far")
    shells = [shell.name for shell in s.shells]
    for number, fluid in enumerate(s.fluids):
        if fluid.name in [*shells, *(body.name for body in s.rigids)]:
            raise ValueError(f"fluids[{number}].name: '{fluid.name}' is taken; names of bodies name their files")
        inside = getattr(fluid.fill, "shell", None)
        if inside is not None and inside not in shells:
            raise ValueError(f"fluids[{number}].fill.shell: there is no shell '{inside}'{nearest(inside, shells)}")
    for shell in s.shells:
        if shell.motion == "in_plane":
            raise ValueError(f"fluids: shell '{shell.name}' moves in its plane and cannot hold a fluid; give it motion = 'free'")
    if s.fluids[0].every not in (None, 1) and not s.shells:
        raise ValueError(f"fluids[0].every = {s.fluids[0].every}: steps of a shell, and the scene has none; leave it out")
    for number, wall in enumerate(s.walls):
        for other, before in enumerate(s.walls[:number]):
            cosine = sum(a * b for a, b in zip(wall.normal, before.normal)) / (math.hypot(*wall.normal) * math.hypot(*before.normal))
            if 1e-6 < abs(cosine) < 1 - 1e-6:
                raise ValueError(
                    f"walls[{number}]: neither parallel nor at right angles to walls[{other}], and their images could not"
                    " meet; turn one of them"
                )
            apart = sum((b - a) * n for a, b, n in zip(wall.point, before.point, wall.normal)) / math.hypot(*wall.normal)
            least = 1.03 * s.fluids[0].support * (s.fluids[0].spacing or s.numerics.spacing)
            if cosine > 0 and abs(apart) < 2.0 * least:
                raise ValueError(
                    f"walls[{number}] and walls[{other}] face the same way {show(abs(apart), 'm')} apart, and a particle would see"
                    " itself in both: leave one of them out"
                )
            if cosine < 0 < apart < least:
                raise ValueError(
                    f"walls[{number}] and walls[{other}] face each other {show(apart, 'm')} apart, and images of images, which"
                    f" begin below {show(least, 'm')}, are not computed: move them apart, or take a finer spacing"
                )
    _in_time(s, "a fluid moves", "fluids")


def _in_time(s: Scene, what: str, cause: str) -> None:
    """A scene with something that only moves in time."""
    for key in TIMELESS:
        if getattr(s, key) is not None:
            raise ValueError(f"{key}: {what} in time; leave out {key} or {cause}")


def _still(s: Scene, key: str, why: str) -> None:
    """A scene that is no motion: nothing starts with a velocity, and motions only hold."""
    if s.initial:
        raise ValueError(f"{key}: initial velocities mean nothing to it; leave them out")
    for number, motion in enumerate(s.motions):
        if any(motion.velocity) or any(motion.spin):
            raise ValueError(f"{key}: {why} (motions[{number}]); use 0 or leave the component free")


def _stays_in_plane(where: str, key: str, load: Any) -> None:
    """Loads and motions that a shell of motion 'in_plane' cannot feel."""
    if key in ("moments", "pressures"):
        raise ValueError(f"{where}: shell '{load.shell}' moves in its plane and does not bend; give it motion = 'free'")
    across = "total" if key == "forces" else "velocity"
    if getattr(load, across)[2]:
        raise ValueError(f"{where}.{across}: z must be 0, for shell '{load.shell}' moves in its plane (motion = 'in_plane')")
    if any(w is not None for w in getattr(load, "spin", ())):
        raise ValueError(f"{where}.spin: shell '{load.shell}' has motion = 'in_plane', its directors do not turn")


def _size(s: Scene) -> None:
    spacing, nodes = s.numerics.spacing, 0.0
    if not s.shells:
        return
    fastest = max(math.sqrt(shell.material.young / shell.material.density) for shell in s.shells)
    for shell in s.shells:
        surface = shell.surface
        if surface.kind == "mesh":
            continue
        if spacing > surface.smallest * (1 + 1e-9):
            why = f"is {show(surface.smallest, 'm')} wide" if surface.kind == "plate" else f"takes at most {show(surface.smallest, 'm')}"
            raise ValueError(f"numerics.spacing {show(spacing, 'm')} is larger than the body: {surface.kind} '{shell.name}' {why}")
        nodes += surface.area / spacing**2
    if nodes > MAX_NODES:
        raise ValueError(f"numerics.spacing {show(spacing, 'm')} gives {nodes:.2g} nodes; at most {MAX_NODES / 1e6:g} million are allowed")
    if s.increments is not None:
        return  # their duration is a pseudo-time
    steps = s.duration * fastest / (0.5 * spacing)
    if steps > MAX_STEPS:
        raise ValueError(
            f"duration {show(s.duration, 's')} takes about {steps:.2g} time steps at spacing {show(spacing, 'm')}; "
            f"at most {MAX_STEPS // 1_000_000} million are allowed (is it in microseconds? write '{s.duration:g} us')"
        )
    if steps < 1.0:
        raise ValueError(
            f"duration {show(s.duration, 's')} is shorter than one time step "
            f"(about {show(0.5 * spacing / fastest, 's')} at spacing {show(spacing, 'm')})"
        )

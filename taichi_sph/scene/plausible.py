"""Checks across the keys of a scene: units that were probably meant otherwise, names, sizes.

Each raises ValueError with a sentence that starts with the key; `schema` calls them once the single
values are known to be numbers in range. What a kind of body checks of itself stands in its said.py.
"""

from __future__ import annotations

import math
import unicodedata
from typing import TYPE_CHECKING

from .surfaces import Shaped
from .units import show

if TYPE_CHECKING:
    from .laws import Material
    from .schema import Scene

MAX_NODES = 50_000_000
MAX_STEPS = 20_000_000
LEAST, LARGEST = 1e-9, 1e6  # m: of a spacing, a thickness, the radius of a pinball
MOST_BODIES = 1500
HEAVIEST = 1e12  # m/s^2
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
        for unit, factor in (("GPa", 1e9), ("TPa", 1e12)):
            if not hint and m.young < 1e3 and 1e9 <= m.young * factor <= 2e12:
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


def names(s: Scene) -> None:
    """There is a body, and no two have one name."""
    if not s.bodies:
        raise ValueError("shells, rigids, fluids and solids are empty: a scene needs at least one body")
    if len(s.bodies) > MOST_BODIES:
        raise ValueError(f"the scene has {len(s.bodies)} bodies; at most {MOST_BODIES} are possible: several pieces may be one body")
    taken: dict[str, str] = {}
    for body in (*s.shells, *s.rigids, *s.fluids, *s.solids, *s.others):
        small = body.name.lower()  # some disks do not tell A from a
        if small in taken:
            alike = "" if taken[small] == body.name else f", like '{taken[small]}'"
            raise ValueError(f"{s.key_of(body)}.name: '{body.name}' is taken{alike}; names of bodies name their files")
        taken[small] = body.name


def scene(s: Scene) -> None:
    """What no body checks for itself: what is asked for, probes, quantities, and the size of the computation."""
    if any(unicodedata.category(c) in ("Cc", "Zl", "Zp") for c in s.title):
        raise ValueError(f"title = {s.title!r} holds a line break or a control sign; write it on one line")
    if s.numerics.spacing < LEAST:
        raise ValueError(f"numerics.spacing {s.numerics.spacing:.4g} m is below {show(LEAST, 'm')}, a few atoms")
    if s.gravity is not None and max(map(abs, s.gravity)) > HEAVIEST:
        raise ValueError(f"gravity {s.gravity} is beyond {HEAVIEST:.0e} m/s^2, that of a neutron star")
    for body in s.bodies:
        if (own := getattr(body, "spacing", None)) is not None and own < LEAST:
            raise ValueError(f"{s.key_of(body)}.spacing {own:.4g} m is below {show(LEAST, 'm')}, a few atoms")
    for shell in s.shells:
        if shell.thickness < LEAST:
            raise ValueError(f"{s.key_of(shell)}.thickness {shell.thickness:.4g} m is below {show(LEAST, 'm')}, a few atoms")
        for k, section in enumerate(shell.sections):
            if section.thickness is not None and section.thickness < LEAST:
                key = f"{s.key_of(shell)}.sections[{k}].thickness"
                raise ValueError(f"{key} {section.thickness:.4g} m is below {show(LEAST, 'm')}, a few atoms")
    for rigid in s.rigids:
        for k, ball in enumerate(rigid.pinballs):
            if not LEAST <= ball.radius <= LARGEST:
                key, why = f"{s.key_of(rigid)}.pinballs[{k}].radius", "a few atoms" if ball.radius < LEAST else "what serves as a plane"
                raise ValueError(f"{key} {ball.radius:.4g} m is outside {show(LEAST, 'm')} to {LARGEST:.0e} m: {why}")
    _schedule(s)
    if s.walls and not s.fluids:
        raise ValueError("walls hold fluids, and the scene has none: leave them out or add a fluid")
    own = any(shell.self_contact for shell in s.shells)
    if own:
        s.in_time("contact moves", "self_contact")
    if s.numerics.contact is not None and not _touches(s):
        raise ValueError("numerics.contact: no two bodies of this scene can meet; leave it out")
    asked = [key for key in TIMELESS if getattr(s, key) is not None]
    if len(asked) > 1:
        raise ValueError(f"{asked[0]} and {asked[1]} are both set: a scene asks for one of them")
    if asked:
        _timeless(s, asked[0])
    if s.static is not None:
        _still(s, "static", "a prescribed motion cannot move")
        _equilibrium(s)
    if s.limit is not None:
        for key in ("forces", "moments", "pressures", "gravity"):
            if getattr(s, key):
                raise ValueError(f"limit: {key} would drive the motion whose growth is looked for; leave them out")
        _still(s, "limit", "a prescribed motion would drive the motion whose growth is looked for")
    for key in ("probes", "gauges"):
        taken: set[str] = set()
        for number, probe in enumerate(getattr(s.output, key)):
            if probe.name in taken:
                raise ValueError(f"output.{key}[{number}].name: '{probe.name}' is taken")
            taken.add(probe.name)
    quantities: list[tuple[str, dict[str, object]]] = []
    for quantity in s.quantities:
        if (quantity.name, quantity.options) in quantities:
            raise ValueError(f"quantities: '{quantity.name}' is asked for twice with the same options")
        quantities.append((quantity.name, dict(quantity.options)))
    _size(s)


def _schedule(s: Scene) -> None:
    """The steps of bodies are multiples of each other: all are due together after the longest of them."""
    slow = sorted(((every, body) for body in s.bodies if (every := getattr(body, "every", None))), key=lambda entry: entry[0])
    for (least, one), (most, other) in zip(slow, slow[1:]):
        if most % least:
            near = max(1, round(most / least)) * least
            raise ValueError(
                f"{s.key_of(other)}.every = {most} is no multiple of that of '{one.name}', {least}: the steps of bodies are multiples of "
                f"each other; take {near}"
            )


def _touches(s: Scene) -> bool:
    """Whether there is contact in a scene: two bodies that may meet and are not both fillings, or a rigid body, which may meet what
    comes."""
    return bool(s.rigids) or any(not (s.body(a).soft and s.body(b).soft) for a, b in s.pairs())


def _timeless(s: Scene, key: str) -> None:
    """A scene without time: of shells that do not touch, for modes and limits of a single one."""
    if key != "static" and len(s.shells) > 1:
        raise ValueError(f"{key}: the scene has {len(s.shells)} shells, and {key} of several are not possible yet; leave one in")
    if moving := (*s.solids, *s.others):
        raise ValueError(f"{key}: '{moving[0].name}' moves in time; leave out {key} or it")
    for a, b in s.pairs():
        if a != b:
            raise ValueError(
                f"{key}: shells '{a}' and '{b}' could meet, and contact moves in time; "
                f"part them by Meeting(between=('{a}', '{b}'), meet=False)"
            )


def _still(s: Scene, key: str, why: str) -> None:
    """A scene that is no motion: nothing starts with a velocity, and motions only hold."""
    if s.initial:
        raise ValueError(f"{key}: initial velocities mean nothing to it; leave them out")
    for number, motion in enumerate(s.motions):
        if any(motion.velocity) or any(motion.spin):
            raise ValueError(f"{key}: {why} (motions[{number}]); use 0 or leave the component free")


def _equilibrium(s: Scene) -> None:
    """What the method of a search for equilibrium needs."""
    static, asked = s.static, "static.method = "
    assert static is not None
    if static.method in (None, "relaxation"):
        return
    for shell in s.shells:
        if s.numerics_of(shell).formulation.kind == "collocation":
            raise ValueError(
                f"{asked}'{static.method}' needs a stiffness, and shell '{shell.name}' is of the form "
                f"'{s.numerics_of(shell).formulation.kind}'; use 'relaxation'"
            )
    if s.numerics.precision == "f32":
        raise ValueError(f"{asked}'{static.method}' needs numerics.precision = 'f64'; use that, or 'relaxation'")
    if static.method != "arc":
        return
    if static.increments < 3:
        raise ValueError(f"static.increments = {static.increments}: {asked}'arc' makes so many points of a path, at least 3")
    loads = [(key, k, load) for key in ("forces", "moments", "pressures") for k, load in enumerate(getattr(s, key))]
    if not loads and s.gravity is None:
        raise ValueError(f"{asked}'arc' follows the path of a load, and the scene has none")
    for key, k, load in loads:
        if load.history.kind not in ("step", "ramp"):
            raise ValueError(f"{asked}'arc' lets all loads grow in proportion; leave out {key}[{k}].history (kind '{load.history.kind}')")


def follows(s: Scene) -> bool:
    """Whether static.method = 'arc' could look for the equilibria of this scene."""
    assert s.static is not None
    arc = s.static.model_copy(update={"method": "arc", "increments": max(3, s.static.increments)})
    try:
        _equilibrium(s.model_copy(update={"static": arc}))
    except ValueError:
        return False
    return s.static.method != "arc"


def _size(s: Scene) -> None:
    """Nodes and steps by the shells' areas and wave speeds."""
    if not s.shells:
        return
    nodes, beat, coarsest = 0.0, 0.0, s.numerics.spacing
    for shell in s.shells:
        spacing, surface = s.numerics_of(shell).spacing, shell.surface
        waves = math.sqrt(shell.material.young / shell.material.density) / spacing
        if waves > beat:
            beat, coarsest, key = waves, spacing, f"{s.key_of(shell)}.spacing" if shell.spacing else "numerics.spacing"
        nodes += surface.area / spacing / spacing if isinstance(surface, Shaped) else 0.0
    if nodes > MAX_NODES:
        raise ValueError(f"{key} {show(coarsest, 'm')} gives {nodes:.2g} nodes; at most {MAX_NODES / 1e6:g} million are allowed")
    if s.increments is not None:
        return  # their duration is a pseudo-time
    steps = s.duration * beat / 0.5
    if steps > MAX_STEPS:
        raise ValueError(
            f"duration {show(s.duration, 's')} takes about {steps:.2g} time steps at spacing {show(coarsest, 'm')}; "
            f"at most {MAX_STEPS // 1_000_000} million are allowed"
            + (f" (is it in microseconds? write '{s.duration:g} us')" if 1.0 <= 1e-6 * steps <= MAX_STEPS else "")
        )
    if steps < 1.0:
        raise ValueError(
            f"duration {show(s.duration, 's')} is shorter than one time step "
            f"(about {show(0.5 / beat, 's')} at spacing {show(coarsest, 'm')})"
        )

"""The steel tank of T 3.4 and its bullet, for the scenes that hit it (no scene itself).

Cylinder of 600 x 300 mm, 1 mm thick, closed by discs; bullet of 18 mm and 31 g, rigid: four pinballs on a line, so far apart that their
hull has the mass in steel. Johnson-Cook with Lemaitre-Chaboche damage and delay, T table 3.1, transverse shear in the yield function
(kappa = 1). The end discs are clamped, and so are two patches of the rear wall at the frame.
"""

import math

from taichi_sph.scene import (
    Ball,
    Box,
    Cylinder,
    Drag,
    FiniteElements,
    InitialVelocity,
    Material,
    Ogive,
    Patch,
    Pinball,
    PrescribedVelocity,
    Rigid,
    Shell,
    Solid,
    material,
)  # fmt: skip

RADIUS, HEIGHT, THICKNESS = 0.15, 0.6, 1e-3  # m
PATCH = 80e-3  # m, radius of the particles about a hole, where the rest is of elements
ALONG = 80e-3  # m, half the width of the particles over the height of the front face
ENDS = 1.6  # elements between those and the ends
BEGIN = 15e-3  # m, the same of a patch that grows
BLUNT = 0.35  # radius of the flat at the tip of a bullet of metal, over its own: a finer tip is where the shortest step is
BULLET, LENGTH, MASS, PINBALLS = 9e-3, 3.6e-3, 0.031, 4  # m, m between the first and the last pinball, kg


def steel(necks: bool) -> Material:
    """necks: whether cells wider than the sheet is thick spread its neck (LemaitreChaboche.necks)."""
    plain = material("steel, tank")
    return material(plain.name, damage=plain.damage.model_copy(update={"necks": necks or None}))


def tank(necks: bool, name: str = "tank", y: float = 0.0) -> Shell:
    """The tank on its bottom, its axis at (0, y) [m]."""
    surface = Cylinder(radius=RADIUS, length=HEIGHT, ends="discs", origin=(0, y, 0))
    return Shell(name=name, surface=surface, thickness=THICKNESS, material=steel(necks), motion="free")


def tank_of_elements(necks: bool, spacing: float, grows: bool = False, filled: bool = False, auto: bool = False) -> Shell:
    """The tank of finite elements three times as wide as particles are apart (`spacing` [m]), which stand where the bullet goes through, or
    begin to stand there and follow the damage. filled: a crack is expected along the front face. So particles stand over its height, but
    for the ends, which no particles can follow; or they follow the crack, and begin farther around the holes. auto: they begin where damage
    or the bullet comes near."""
    made = tank(necks).model_copy(update={"formulation": FiniteElements(points=1), "spacing": 3 * spacing})
    if auto:
        return made.model_copy(update={"patch": Patch(spacing=spacing, grows=True)})
    radius = BEGIN + spacing if grows and not filled else PATCH
    there: list[Ball | Box] = [Ball(centre=(x, 0, HEIGHT / 2), radius=radius) for x in (RADIUS, -RADIUS)]
    if filled and not grows:
        ends = ENDS * 3 * spacing
        there[0] = Box(lo=(0, -ALONG, ends), hi=(None, ALONG, HEIGHT - ends))
    patch = Patch(where=there, spacing=spacing, grows=grows)
    return made.model_copy(update={"patch": patch})


def bullet(velocity: float, name: str = "bullet", y: float = 0.0, up: float = 0.0) -> Rigid:
    """The bullet just before the front, `up` [m] above half the height."""
    if velocity < 0.0:
        raise ValueError(f"velocity = {velocity:g} m/s: the bullet would fly away from the tank; give its speed")
    front = RADIUS + 0.5 * THICKNESS + BULLET + 0.1e-3
    balls = [Pinball(centre=(front + LENGTH * k / (PINBALLS - 1), y, HEIGHT / 2 + up), radius=BULLET) for k in range(PINBALLS)]
    return Rigid(name=name, mass=MASS, pinballs=balls, velocity=(-velocity, 0, 0))


def metal_bullet(metal: str, velocity: float, across: int) -> tuple[Solid, InitialVelocity]:
    """The bullet as a solid of as much mass: half a ball and a shank behind it, `across` cells over its radius. The thesis does not say of
    what the bullet was, but that it was much deformed (its fig. 3.11): "mild" is AISI 1018 (T table 2.11), "hard" APX (T table 5.4).
    ValueError where it does not fly at the tank."""
    if not velocity > 0.0:
        raise ValueError(f"velocity = {velocity:g} m/s: a bullet of metal ({metal}) needs more than 0")
    said = material({"mild": "AISI 1018", "hard": "APX"}[metal])
    steel = said.model_copy(update={"damage": None, "delay": None, "critical_damage": None})
    nose = Ogive(radius=BULLET, length=0.0, crh=0.5, blunt=BLUNT)
    shank = (MASS / steel.density - nose.volume) / (math.pi * BULLET**2)
    tip = RADIUS + 0.5 * THICKNESS + 0.1e-3
    shape = Ogive(radius=BULLET, length=shank, crh=0.5, blunt=BLUNT, axis="x", turned=True, origin=(tip + nose.nose + shank, 0, HEIGHT / 2))
    solid = Solid(name="bullet", shape=shape, material=steel, spacing=BULLET / across, viscous=True)
    return solid, InitialVelocity(body="bullet", velocity=(-velocity, 0, 0))


def drags(drag: float, wet: bool = True) -> list[Drag]:
    """How the bullet flies through the water, which is as coarse as the bullet: by a law with that coefficient; 0: by its pressure."""
    return [Drag(between=("bullet", "water"), coefficient=drag)] if drag and wet else []


def supports(spacing: float, body: str = "tank", y: float = 0.0, reach: float = 0.03) -> list[PrescribedVelocity]:
    """What holds the tank, whose nodes are `spacing` [m] apart; reach [m]: height of the patches at the frame."""
    held = [
        Box(hi=(None, None, 0.25 * spacing)),
        Box(lo=(None, None, HEIGHT - 0.25 * spacing)),
        Box(lo=(None, y - 0.05, 0.25 * spacing), hi=(-0.13, y + 0.05, reach)),
        Box(lo=(None, y - 0.05, HEIGHT - reach), hi=(-0.13, y + 0.05, HEIGHT - 0.25 * spacing)),
    ]
    return [PrescribedVelocity(body=body, where=where, velocity=(0, 0, 0), spin=(0, 0, 0)) for where in held]

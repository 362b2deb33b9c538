"""The size of a scene from counts that allocate nothing: refused here before a mesh or a particle exists."""

from __future__ import annotations

from ..bodies.fluid.count import count as particles
from ..bodies.fluid.said import FluidBox
from ..bodies.rigid.said import Rigid
from ..bodies.rigid.solid import MOST, PITCH, RADIUS
from ..errors import SceneError
from ..geometry.mesh import SurfaceMesh
from ..geometry.solids import count as nodes_of_solid
from ..geometry.surfaces import count as nodes_of
from ..scene.plausible import MAX_NODES, MAX_STEPS
from ..scene.schema import Scene
from ..scene.solids import Made as Generated
from ..scene.surfaces import Given
from ..scene.units import show
from .progress import bytes_text

FAR = 1e9  # spacings from the origin: a seventh digit of the spacing is left there
LEAST_BYTES = {"shell": 1400, "fluid": 800, "solid": 800}  # of memory that a node or a particle needs at least (plan.py has the true ones)


def check_counts(scene: Scene, available: int | None, meshes: dict[str, SurfaceMesh] | None = None) -> dict[str, int]:
    """Nodes and particles of each shell and fluid, by name. Refuses (SceneError) too many of them, or of steps, or what has no room in
    `available` bytes of memory.

    Without `meshes` nothing is read and shells from files are not counted; with them, fluids inside of those are.
    """
    sizes = [(0, 0, "", 0.0)]  # bytes, count, key and spacing of each body
    counts: dict[str, int] = {}
    for index, shell in enumerate(scene.shells):
        if not isinstance(shell.surface, Given):
            numerics = scene.numerics_of(shell)
            key = "numerics.spacing" if shell.spacing is None else f"shells[{index}].spacing"
            nodes = nodes_of(shell.surface, numerics)
            _few(nodes, f"{key} {show(numerics.spacing, 'm')} gives shell '{shell.name}' {nodes:.2g} nodes")
            _near(f"{scene.key_of(shell)}.surface.origin", shell.surface.origin, numerics.spacing)
            sizes.append((nodes * LEAST_BYTES["shell"], nodes, key, numerics.spacing))
            counts[shell.name] = nodes
    by_name = {shell.name: shell for shell in scene.shells}
    for index, fluid in enumerate(scene.fluids):
        filled = by_name.get(getattr(fluid.fill, "shell", ""))
        found = particles(
            fluid,
            scene.numerics.spacing,
            filled.surface if filled else None,
            filled.thickness if filled else 0.0,
            (meshes or {}).get(filled.name) if filled else None,
        )
        key = f"fluids[{index}].spacing" if fluid.spacing else "numerics.spacing"
        spacing = fluid.spacing or scene.numerics.spacing
        _few(found, f"{key} {show(spacing, 'm')} gives fluid '{fluid.name}' {found:.2g} particles")
        if isinstance(fluid.fill, FluidBox):
            _near(f"fluids[{index}].fill.lo", fluid.fill.lo, spacing)
        sizes.append((found * LEAST_BYTES["fluid"], found, key, spacing))
        counts[fluid.name] = found
        finest = spacing / 2**fluid.halvings
        steps = scene.duration * fluid.water.sound / (0.6 * finest)
        if steps > MAX_STEPS * (fluid.every or 1):
            of = show(spacing, "m") if finest == spacing else f"{show(spacing, 'm')}, halved to {show(finest, 'm')}"
            raise SceneError(
                f"duration {show(scene.duration, 's')} takes about {steps:.2g} time steps of fluid '{fluid.name}' ({key} "
                f"{of}, sound {fluid.water.sound:.4g} m/s); at most {MAX_STEPS // 1_000_000} million are allowed"
            )
    for body in scene.rigids:
        if body.surface is not None and not isinstance(body.surface, Given):
            _rigid_surface(body, scene)
    for index, solid in enumerate(scene.solids):
        if isinstance(solid.shape, Generated):
            key = f"solids[{index}].spacing" if solid.spacing else "numerics.spacing"
            spacing = scene.numerics_of(solid).spacing
            found = round(nodes_of_solid(solid.shape, spacing))
            _few(found, f"{key} {show(spacing, 'm')} gives solid '{solid.name}' {found:.2g} nodes")
            _near(f"{scene.key_of(solid)}.shape.origin", solid.shape.origin, spacing)
            sizes.append((found * LEAST_BYTES["solid"], found, key, spacing))
            counts[solid.name] = found
    memory = sum(size[0] for size in sizes)
    if available is not None and memory > available:
        _, _, key, spacing = max(sizes)
        raise SceneError(
            f"{key} {show(spacing, 'm')} gives {sum(size[1] for size in sizes):.3g} nodes and particles, which need at least "
            f"{bytes_text(memory)} of memory; this machine has {bytes_text(available)}"
        )
    return counts


def _rigid_surface(body: Rigid, scene: Scene) -> None:
    """Not smaller than a spacing, and of no more pinballs than a body may have."""
    surface, numerics = body.surface, scene.numerics_of(body)
    assert surface is not None and not isinstance(surface, Given)
    key = "numerics.spacing" if body.spacing is None else f"{scene.key_of(body)}.spacing"
    if numerics.spacing > surface.smallest * (1 + 1e-9):
        raise SceneError(
            f"{key} {show(numerics.spacing, 'm')} is larger than the body: the {surface.kind} of rigid '{body.name}' takes at most "
            f"{show(surface.smallest, 'm')}"
        )
    if surface.area / numerics.spacing / numerics.spacing > MOST * (PITCH * RADIUS) ** 2:
        raise SceneError(f"{key} {show(numerics.spacing, 'm')} gives rigid '{body.name}' more than {MOST} pinballs: raise its spacing")
    _near(f"{scene.key_of(body)}.surface.origin", surface.origin, numerics.spacing)


def _near(key: str, point: tuple[float, float, float], spacing: float) -> None:
    """So near to the origin that nodes a spacing apart are numbers apart, by far."""
    for axis, x in zip("xyz", point):
        if abs(x) > FAR * spacing:
            raise SceneError(
                f"{key}: {axis} = {show(x, 'm')} is more than {FAR:.0e} spacings ({show(spacing, 'm')}) from the origin, where numbers of "
                "16 digits part its nodes badly; move the scene"
            )


def _few(found: int, what: str) -> None:
    if found > MAX_NODES:
        raise SceneError(f"{what}; at most {MAX_NODES / 1e6:g} million are allowed")

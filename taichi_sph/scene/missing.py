"""Keys and kinds that users of other codes try: what is not possible yet, and what stands elsewhere under another name.

By the name of the class that they were tried on. A key that comes to exist is found before these tables are asked, and a test takes it off.
"""

from __future__ import annotations

from collections.abc import Iterable

_BY_REGION = "is said of sections: sections = (Section(where=..., {}=...),), where a Box, a Ball or a Group of the mesh"
_HEAT = "temperature is not followed, but for the plastic heat of solids: JohnsonCook(heat=Heat(...))"
_JOINED = "bodies are joined by contact, springs and welds alone"
_FASTENED = f"{_JOINED}; a Spring(between=..., points=..., stiffness=..., radius=...) holds two bodies at a place, and does not fail"
_GLUED = "what is joined does not part: a Weld(between=...) or springs hold, and a shell breaks by material.damage within itself"
_REMESH = (
    "cells stay what they are; broken ones are left out, and a patch with grows = true makes particles where a shell of elements ruptures"
)
_FLOWS = "water neither flows in nor out at a boundary; it leaves a tank by its holes and cracks, and the volume is there at the start"
_STILL = "water has no turbulence model and no viscosity of its own, only the artificial one, alpha"
_PAIR = "is said of a pair of bodies: Meeting(between=(one, other), {})"

NOT_YET: dict[str, dict[str, str]] = {
    "Scene": {
        "temperature": _HEAT,
        "initial_temperature": _HEAT,
        "thermal": _HEAT,
        "heat": _HEAT,
        "beams": "there are shells, solids, rigid bodies and fluids; no beams; a stiffener is a shell, welded on",
        "trusses": "there are no bars; a Spring(only='pull') is a cable, one with both signs a bar",
        "joints": f"{_JOINED}; no joints: a Weld of two shells is a hinge along their common nodes, a Spring ties two points",
        "hinges": f"{_JOINED}; no hinges by name: a Weld of two shells carries no moments, so it is a hinge, and an edge turns where "
        "motions leave spin free: PrescribedVelocity(velocity=(0, 0, 0), spin=(None, None, None))",
        "rivets": _FASTENED,
        "bolts": f"{_FASTENED}; preload is its tension",
        "pretension": "a Spring has a preload; there is no other",
        "fasteners": _FASTENED,
        "connectors": _FASTENED,
        "cohesive": _GLUED,
        "cohesive_zones": _GLUED,
        "glue": _GLUED,
        "adhesive": _GLUED,
        "tiebreak": _GLUED,
        "constraints": "nodes are held by motions alone; no constraints between nodes",
        "mpc": "nodes are held by motions alone; no constraints between nodes",
        "rigid_links": "nodes are held by motions alone; no constraints between nodes; a heavy part is a rigid body on springs",
        "inflow": _FLOWS,
        "outflow": _FLOWS,
        "inlet": _FLOWS,
        "outlet": _FLOWS,
        "periodic": "no boundary is periodic; a Wall is a plane of symmetry for water, motions are one for shells",
        "turbulence": _STILL,
        "surface_tension": "water has no surface tension",
        "remesh": _REMESH,
        "remeshing": _REMESH,
        "adaptive": _REMESH,
        "erosion": "cells break by their law of damage alone: material.damage with critical_damage",
        "airbag": "a gas keeps its mass: Gas(body=..., pressure=...) fills a closed shell; nothing blows it up",
        "wind": "air is not computed; give its load as SurfacePressure(value=..., history=...)",
        "body_forces": "gravity alone acts on all bodies; forces act on nodes",
        "ale": "fluids are particles; there is no grid",
        "euler": "fluids are particles; there is no grid",
        "restart": "a run is gone on with by the command taichi-sph resume DIR",
        "hourglass": "the forms have no hourglass control; galerkin.stabilisation holds its particles",
        "subcycling": "a body takes steps of its own by every, there is no key for all",
        "mass_scaling": "masses are what they are; the step follows from the spacing",
        "damping": "there is no damping of whole bodies; springs may damp, and static finds equilibrium",
    },
    "Shell": {
        "plies": "a shell has one material through its thickness; no laminates",
        "layup": "a shell has one material through its thickness; no laminates",
        "offset": "the surface is the mid-surface",
        "drilling": "directors do not turn about themselves",
        "prestress": "a shell starts without stress",
        "initial_stress": "a shell starts without stress",
        "erosion": "cells break by their law of damage: material.damage with critical_damage",
        "temperature": _HEAT,
        "damping": "there is no damping of whole bodies; springs may damp, and static finds equilibrium",
        "hourglass": "the forms have no hourglass control; galerkin.stabilisation holds its particles",
        "integration_points": "the section is integrated in closed form, or in material.strength.layers",
        "hinges": "an edge turns where motions leave spin free; two shells turn about their Weld, which carries no moments",
        "remesh": _REMESH,
        "imperfections": "nodes are where the surface has them; give a Net or a MeshFile with the imperfection, or a small force aside",
        "cohesive": _GLUED,
    },
    "Solid": {
        "temperature": _HEAT,
        "erosion": "cells break by their law of damage: material.damage with critical_damage",
        "remesh": _REMESH,
        "hourglass": "trilinear.stabilisation holds the cells",
        "prestress": "a solid starts without stress",
        "initial_stress": "a solid starts without stress",
        "cohesive": _GLUED,
        "pressure": "pressures act on shells alone; forces act on solids: NodalForce(body=..., total=...)",
    },
    "Rigid": {
        "deformable": "a rigid body keeps its shape; make it a Solid",
        "temperature": _HEAT,
        "joints": f"{_JOINED}; springs hold a rigid body at any point of it",
        "hinges": f"{_JOINED}; driven = Driven(velocity=(0, 0, 0), spin=...) turns a rigid body about its centre",
        "added_mass": "water around a rigid body is computed; Drag(between=...) is its resistance where the water is too coarse",
    },
    "Gas": {
        "temperature": "the gas has a pressure and an exponent: pressure (V_0 / V)^exponent",
        "inflow": "the gas keeps its mass",
        "leak": "the gas keeps its mass, and its shell neither breaks nor has holes",
    },
    "Weld": {
        "strength": "a weld does not fail",
        "failure": "a weld does not fail",
        "moment": "a weld carries forces and no moments",
        "stiffness": "a weld is stiff; a Spring has a stiffness",
    },
    "Spring": {
        "failure": "a spring does not fail",
        "strength": "a spring does not fail",
        "rotation": "a spring pulls along its line; there is none that turns",
        "curve": "a spring is linear: stiffness, preload, and only = 'pull' or 'push'",
    },
    "Fluid": {
        "viscosity": "water has no viscosity of its own, only the artificial one, alpha",
        "surface_tension": "water has no surface tension",
        "temperature": "temperature of water is not followed",
        "inflow": "water does not flow in; what is there is there at the start",
        "outflow": _FLOWS,
        "inlet": _FLOWS,
        "outlet": _FLOWS,
        "periodic": "no boundary is periodic; a Wall is a plane of symmetry",
        "turbulence": _STILL,
        "slip": "water slides along walls and shells; there is no other boundary",
        "cavitation": "water does not boil; Water(tension=...) is the most tension that it bears",
        "air": "air is not computed; a Gas fills what the water leaves of a closed shell",
    },
    "PinballContact": {
        "type": "there is one kind of contact, pinballs with multipliers; no penalty, no surface to surface",
        "penalty": "there is one kind of contact, pinballs with multipliers; no penalty",
        "stiffness": "there is one kind of contact, pinballs with multipliers; no penalty",
        "damping": "contact takes energy by restitution alone",
    },
    "Meeting": {
        "type": "there is one kind of contact, pinballs with multipliers; no penalty, no surface to surface",
        "penalty": "there is one kind of contact, pinballs with multipliers; no penalty",
        "stiffness": "there is one kind of contact, pinballs with multipliers; no penalty",
        "gap": "bodies meet where their pinballs touch",
        "thickness": "bodies meet where their pinballs touch",
        "tied": "contact pushes and does not hold",
        "adhesion": "contact pushes and does not hold",
    },
    "Wall": {
        "size": "a wall is a plane without end; a finite one is a held rigid body with a surface",
        "motion": "a wall stands still; a rigid body with a surface is driven",
        "velocity": "a wall stands still; a rigid body with a surface is driven",
        "friction": "water slides along a wall",
    },
    "Material": {
        "thermal_expansion": _HEAT,
        "conductivity": _HEAT,
        "viscoelasticity": "materials are elastic, of metal, concrete or brittle; none relaxes",
        "hyperelastic": "materials are elastic (St. Venant-Kirchhoff), of metal, concrete or brittle",
        "orthotropy": "materials are isotropic",
        "fibre": "materials are isotropic",
        "e1": "materials are isotropic",
        "rate": "rates of strain count in strength = JohnsonCook(C=...) and in delay alone",
        "failure_strain": "rupture follows from damage: LemaitreChaboche(rupture=...) or Mazars",
        "fracture_energy": "rupture follows from damage and its delay; energy is not a parameter",
    },
    "NodalForce": {
        "follower": "a force keeps its direction; a pressure may follow: SurfacePressure",
        "frame": "components are along x, y, z",
    },
    "PrescribedVelocity": {
        "displacement": "motions are velocities; give the velocity and a history whose integral is the way",
        "acceleration": "motions are velocities; give the velocity and its history",
        "frame": "components are along x, y, z",
    },
    "Output": {"sections": "forces across sections are not kept"},
}

ELSEWHERE: dict[str, dict[str, str]] = {
    "Scene": {
        "spotwelds": "are welds of shells: Weld(between=(one, other), radius=...) joins nodes that stand within the radius",
        "explosives": "are solids of a material that burns: Solid(material=..., detonation=(Detonation(...),))",
        "blast": "is the history of a pressure: SurfacePressure(value=..., history=Friedlander(...))",
        "cables": "are springs: Spring(only='pull')",
        "dampers": "are springs: Spring(stiffness=0, damping=...)",
        "symmetry": "is a motion: PrescribedVelocity holds the component across the plane, and spin about the axes in it",
        "probes": "is output.probes",
        "frames": "is output.frames",
        "spacing": "is numerics.spacing",
        "buckling": "is static: Static(method='arc') follows the path over the limit; modes are those of the unloaded scene",
        "frequencies": "is modes: Modes(count=...)",
        "friction": _PAIR.format("friction=..."),
        "ties": "are welds: Weld(between=(one, other))",
        "contacts": "is numerics.contact, and meetings for pairs of bodies",
        "contact": "is numerics.contact, and meetings for pairs of bodies",
        "loads": "are the keys forces, moments, pressures and gravity",
        "boundary_conditions": "are motions: PrescribedVelocity(where=..., velocity=(0, 0, 0)) holds nodes",
        "bcs": "are motions: PrescribedVelocity(where=..., velocity=(0, 0, 0)) holds nodes",
        "supports": "are motions: PrescribedVelocity(where=..., velocity=(0, 0, 0)) holds nodes",
        "initial_velocity": "is initial: InitialVelocity(...)",
        "dt": "follows from the spacing; numerics.time_step_safety lowers it",
        "time_step": "follows from the spacing; numerics.time_step_safety lowers it",
        "end_time": "is duration",
        "water": "is fluids",
        "strikers": "are rigids",
    },
    "Shell": {
        "thickness_by_region": _BY_REGION.format("thickness"),
        "thicknesses": _BY_REGION.format("thickness"),
        "material_by_region": _BY_REGION.format("material"),
        "materials": _BY_REGION.format("material"),
        "regions": _BY_REGION.format("thickness"),
        "ribs": "are shells of their own, welded on: Weld(between=(plate, rib))",
        "stiffeners": "are shells of their own, welded on: Weld(between=(plate, stiffener))",
        "restitution": _PAIR.format("restitution=..."),
        "friction": _PAIR.format("friction=..."),
        "contact": "is numerics.contact of the scene; self_contact = true lets parts of one shell meet",
        "holes": "stand in the surface: surface.holes = (HoleIn(centre=..., radius=...),)",
        "mesh": "is surface: MeshFile(path=...), or Net(points=..., cells=...)",
        "velocity": "is initial of the scene: InitialVelocity(velocity=...)",
        "pressure": "is pressures of the scene: SurfacePressure(value=...)",
        "density": "is material.density",
        "young": "is material.young",
    },
    "Fluid": {
        "gas": "is gases of the scene: Gas(body=..., pressure=...) fills what the water leaves of a closed shell",
        "initial_pressure": "is pressure",
    },
    "Rigid": {
        "friction": _PAIR.format("friction=..."),
        "mesh": "is surface: MeshFile(path=...), or Net(points=..., cells=...)",
        "shape": "is surface: a BoxTank, a Sphere, a MeshFile and others",
        "radius": "is pinballs: each has a centre and a radius",
        "fixed": "is held",
        "motion": "is driven",
        "history": "is driven.history",
    },
    "Output": {"reactions": "are kept by themselves: histories/support_1.csv is that of the first of the scene's motions"},
    "PinballContact": {"friction": _PAIR.format("friction=...")},
    "Numerics": {
        "dt": "follows from the spacing; time_step_safety lowers it",
        "time_step": "follows from the spacing; time_step_safety lowers it",
        "mesh_size": "is spacing",
        "element_size": "is spacing",
    },
    "NodalForce": {"value": "is total, shared by the nodes", "force": "is total, shared by the nodes", "curve": "is history"},
    "SurfacePressure": {"pressure": "is value", "curve": "is history", "region": "is where"},
}

KINDS: dict[str, dict[str, str]] = {  # by a kind that stands beside them
    "plate": {
        "stiffened_panel": "three cells at one edge are not possible; make it a Plate and Plates on edge, joined by welds",
        "tee": "three cells at one edge are not possible; make it two Plates joined by a Weld",
        "ellipsoid": "make it a mesh, or a CappedTank with elliptical heads",
        "step": "geometry of CAD is not read; mesh it and give the mesh",
        "iges": "geometry of CAD is not read; mesh it and give the mesh",
    },
    "ball": {
        "cylinder": "regions are boxes, balls, groups of a mesh and what is outside of them",
        "set": "regions are boxes, balls and groups of cells: Group(name=...); sets of nodes are none yet",
        "nodes": "regions are boxes, balls and groups of cells: Group(name=...); nodes by number are none yet",
    },
    "galerkin": {"fem": "shells are computed by particles alone", "total_lagrangian": "both forms are total Lagrangian; choose galerkin"},
}


def _plain(key: str) -> str:
    """A key without what writers differ in: spot_welds, SpotWeld and spotweld are one."""
    return key.lower().replace("_", "").replace("-", "").rstrip("s")


def _of(table: dict[str, dict[str, str]], cls: type, key: str) -> str:
    said = table.get(cls.__name__, {})
    return said.get(key.lower()) or next((why for known, why in said.items() if _plain(known) == _plain(key)), "")


def key_said(owner: type | None, key: str) -> str:
    """What a sentence says of a key that a class does not have; empty where nothing is known of it."""
    for cls in owner.__mro__ if owner else ():
        if why := _of(NOT_YET, cls, key):
            return f"not possible yet: {why}"
        if where := _of(ELSEWHERE, cls, key):
            return where
    return ""


def kind_said(kind: str, known: Iterable[str]) -> str:
    """What a sentence says of a kind that is not among those that are known; empty where nothing is known of it."""
    return next((f"not possible yet: {why}" for name in known if (why := KINDS.get(name, {}).get(kind.lower()))), "")

"""Keys and kinds that users of other codes try: what is not possible yet, and what stands elsewhere under another name.

By the name of the class that they were tried on. A key that comes to exist is found before these tables are asked, and a test takes it off.
"""

from __future__ import annotations

from collections.abc import Iterable

_BY_REGION = "is said of sections: sections = (Section(where=..., {}=...),), where a Box, a Ball or a Group of the mesh"
_PAIR = "is said of a pair of bodies: Meeting(between=(one, other), {})"

NOT_YET: dict[str, dict[str, str]] = {
    "Scene": {
        "temperature": "temperature is not followed",
        "thermal": "temperature is not followed",
        "heat": "temperature is not followed",
        "beams": "there are shells, solids, rigid bodies and fluids; no beams",
        "joints": "bodies are joined by contact, springs and welds alone; no joints",
        "constraints": "nodes are held by motions alone; no constraints between nodes",
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
    },
    "Rigid": {},
    "Fluid": {
        "viscosity": "water has no viscosity of its own, only the artificial one, alpha",
        "surface_tension": "water has no surface tension",
        "temperature": "temperature is not followed",
        "inflow": "water does not flow in; what is there is there at the start",
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
        "thermal_expansion": "temperature is not followed",
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


def key_said(owner: type | None, key: str) -> str:
    """What a sentence says of a key that a class does not have; empty where nothing is known of it."""
    for cls in owner.__mro__ if owner else ():
        if why := NOT_YET.get(cls.__name__, {}).get(key.lower()):
            return f"not possible yet: {why}"
        if where := ELSEWHERE.get(cls.__name__, {}).get(key.lower()):
            return where
    return ""


def kind_said(kind: str, known: Iterable[str]) -> str:
    """What a sentence says of a kind that is not among those that are known; empty where nothing is known of it."""
    return next((f"not possible yet: {why}" for name in known if (why := KINDS.get(name, {}).get(kind.lower()))), "")

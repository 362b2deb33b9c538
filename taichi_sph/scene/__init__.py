"""What the user says. `from taichi_sph.scene import Scene, Shell, Plate, ...` starts no Taichi.

Names are loaded when they are asked for, so that what a kind of body says (bodies/*/said.py) may use the parts of this package.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_WHERE = {
    "base": ("Body", "Quality"),
    "check": ("checked", "sentence"),
    "histories": ("Friedlander", "HalfSine", "Ramp", "Step", "TimePulse", "TimeTable", "Triangle"),
    "instead": ("Modes", "Static", "StepLimit"),
    "kept": ("Output", "Probe", "Quantity", "StrainGauge"),
    "kinds": ("Kind",),
    "library": ("ductile", "material", "materials"),
    "loads": (
        "InitialVelocity", "NodalForce", "NodalMoment", "PrescribedVelocity", "Pulse", "Radial", "Rotation", "SurfacePressure"
    ),
    "laws": ("Concrete", "Delay", "Heat", "JohnsonCook", "Jwl", "LemaitreChaboche", "Material", "Mazars", "Perfect", "Power", "Table"),
    "numerics": ("Numerics",),
    "regions": ("Ball", "Box", "Group", "Outside"),
    "schema": ("Scene",),
    "script": ("derive", "dump", "load", "load_scene", "parameters_of"),
    "solids": ("Brick", "Cells", "Grading", "Ogive", "Pilot", "Rod"),
    "study": ("Convergence", "Study"),
    "surfaces": (
        "BoxTank", "Bullet", "CappedTank", "Cylinder", "Disc", "Frustum", "HoleIn", "MeshFile", "Net", "Plate", "Roof", "Sphere",
        "SpherePatch",
    ),
    "until": ("LeakKnown",),
    "units": ("Angle", "Density", "Dimensionless", "Force", "Length", "Mass", "Pressure", "Speed", "Spin", "Stiffness", "Time", "to_si"),
    "..bodies.fluid.said": ("Acoustic", "Finer", "Fluid", "FluidBox", "FluidRound", "Hole", "ShellFill", "Tait", "Wall", "Water"),
    "..bodies.rigid.said": ("DiscFace", "Driven", "Pinball", "Rigid", "TubeFace"),
    "..bodies.shell.said": ("Collocation", "Cut", "FiniteElements", "Galerkin", "Patch", "Section", "Shell", "Viscosity"),
    "..bodies.solid.said": ("Detonation", "Particles", "Solid", "SolidPatch", "Trilinear"),
    "..couplings.contact.said": ("Meeting", "PinballContact"),
    "..couplings.drag.said": ("Drag",),
    "..couplings.gas.said": ("Gas",),
    "..couplings.springs.said": ("Spring",),
    "..couplings.welds.said": ("Weld",),
}  # fmt: skip
_HOME = {name: module for module, names in _WHERE.items() for name in names}
__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'taichi_sph.scene' has no name {name!r}")
    module = _HOME[name]
    return getattr(import_module(module if module.startswith(".") else f".{module}", __name__), name)


def __dir__() -> list[str]:
    return __all__

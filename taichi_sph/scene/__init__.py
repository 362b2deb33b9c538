"""What the user says. `from taichi_sph.scene import Scene, Shell, Plate, ...` starts no Taichi."""

from .check import checked, sentence
from .rigid import Pinball, PinballContact, Rigid
from .fluid import Acoustic, Fluid, FluidBox, Hole, ShellFill, Tait, Wall, Water
from .schema import (
    Ball,
    Box,
    Collocation,
    Cut,
    Delay,
    Galerkin,
    InitialVelocity,
    JohnsonCook,
    LemaitreChaboche,
    Material,
    Mazars,
    MeshFile,
    Modes,
    NodalForce,
    NodalMoment,
    Numerics,
    Output,
    Outside,
    Perfect,
    Plate,
    Power,
    PrescribedVelocity,
    Probe,
    Pulse,
    Quality,
    Quantity,
    Ramp,
    Scene,
    Shell,
    Static,
    Step,
    StepLimit,
    SurfacePressure,
    Table,
    Viscosity,
)
from .library import ductile, material, materials
from .script import derive, dump, load, load_scene, parameters_of
from .study import Convergence, Study
from .surfaces import CappedTank, Cylinder, Disc, Roof, SpherePatch
from .units import Angle, Density, Dimensionless, Force, Length, Pressure, Speed, Spin, Time, to_si

__all__ = [
    "Acoustic", "Fluid", "FluidBox", "Hole", "ShellFill", "Tait", "Wall", "Water",
    "Angle", "CappedTank", "Cylinder", "Disc", "Roof", "SpherePatch",
    "Ball", "Box", "Collocation", "Convergence", "Cut", "Delay", "Density", "Dimensionless", "Force", "Galerkin",
    "InitialVelocity", "Length", "Material", "Mazars", "MeshFile", "Modes", "NodalForce", "NodalMoment", "Numerics", "Output", "Outside", "Perfect", "Plate", "Power",
    "Pinball", "PinballContact", "Rigid", "PrescribedVelocity", "Pressure", "Probe", "Pulse", "Quality", "Quantity", "Ramp", "Scene", "Shell", "Speed", "Spin",
    "Static", "StepLimit", "SurfacePressure",
    "Step", "Study", "Table", "Time", "Viscosity", "checked", "derive", "ductile", "dump", "load", "load_scene", "material", "materials", "parameters_of", "sentence", "to_si",
]  # fmt: skip

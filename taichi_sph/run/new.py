"""A scene to start from: `taichi-sph new NAME`."""

from __future__ import annotations

import re
from pathlib import Path

from ..errors import SceneError

TEXT = '''"""NAME: one sentence on what is hit by what, and what one wants to know.

    taichi-sph validate PATH
    taichi-sph run PATH --quality draft --set velocity=250
"""

from taichi_sph.scene import (
    Box,
    Numerics,
    Output,
    Pinball,
    Plate,
    PrescribedVelocity,
    Quality,
    Quantity,
    Rigid,
    Scene,
    Shell,
    Speed,
    material,
)

SPACING = {"draft": "2.5 mm", "standard": "1.5 mm", "paper": "1 mm"}  # of the nodes; a string carries its unit, a number is SI


# Parameters with a type are options of the command line: --set velocity=250
def scene(quality: Quality = "draft", velocity: Speed = 200.0) -> Scene:
    sheet = Shell(
        name="sheet",  # names files: frames/sheet.vtkhdf; loads and measures name their body by it
        surface=Plate(length=0.1, width=0.1),  # or Disc, Cylinder, CappedTank, BoxTank, Sphere, MeshFile(path=...), ...: docs/shapes.md
        thickness="1.5 mm",
        material=material("AISI 1018"),  # taichi_sph.scene.materials() lists them; Material(...) says your own
        motion="free",  # it bends; "in_plane": it stays flat
    )
    ball = Rigid(
        name="ball",
        mass="30 g",
        pinballs=[Pinball(centre=(0.05, 0.05, 0.0111), radius="10 mm")],
        velocity=(0, 0, -velocity),
    )
    border = [Box(hi=("1 mm", None, None)), Box(lo=("99 mm", None, None))]  # None leaves a side open
    return Scene(
        name="NAME",
        title=f"Ball on a sheet, {velocity:g} m/s",
        source="where the numbers come from",
        shells=[sheet],  # any number of bodies: shells, solids, fluids, rigids
        rigids=[ball],
        motions=[PrescribedVelocity(body="sheet", where=where, velocity=(0, 0, 0), spin=(0, 0, 0)) for where in border],  # held
        duration="150 us",
        numerics=Numerics(spacing=SPACING[quality]),
        output=Output(frames=30, samples=300),
        quantities=[  # what the run is to show; with value=, tolerance= it is held against what you expect
            Quantity(name="time_to_rupture", unit="s"),
            Quantity(name="striker_speed", unit="m/s"),
        ],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
'''
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")


def write_scene(name: str, folder: Path) -> Path:
    """`folder`/`name`.py, a commented scene that runs as it is; SceneError where a file is there already."""
    if not NAME.fullmatch(name):
        raise SceneError(f"'{name}' is no name for a scene: letters, digits and '_', a letter first (it becomes a file name)")
    path = folder / f"{name}.py"
    if path.exists():
        raise SceneError(f"'{path}' is there already; give another name")
    path.write_text(TEXT.replace("PATH", str(path)).replace("NAME", name), encoding="utf-8")
    return path

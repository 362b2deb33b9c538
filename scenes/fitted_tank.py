"""A tank with all that tanks have, from one mesh with physical groups: a belt of thicker plate, a baffle, a stiffener, a vent.

The script writes the mesh as Gmsh would (format 2.2) and reads it back. The group "tank" is one shell, in which "belt" is thicker and
"floor" is driven; the vent is what the mesh leaves out of the lid. "baffle" and "stiffener" are shells of their own, welded to it where
their nodes meet. The floor is shaken once along the tank; the water runs against the baffle, and through the gap below it.

    python scenes/fitted_tank.py --quality draft --out DIR
"""

import tempfile
from pathlib import Path

import numpy as np

from taichi_sph.scene import (
    Fluid,
    Group,
    HalfSine,
    MeshFile,
    Numerics,
    Output,
    PrescribedVelocity,
    Quality,
    Quantity,
    Scene,
    Section,
    Shell,
    ShellFill,
    Water,
    Weld,
    material,
)

SPACING = {"draft": 20e-3, "standard": 13.3333e-3, "paper": 10e-3}  # m
SIZE = (0.48, 0.32, 0.32)  # m
THICKNESS, BELT = 2e-3, 5e-3  # m
LEVEL = 0.2  # m
DURATION = {"draft": 15e-3, "standard": 30e-3, "paper": 60e-3}  # s


def mesh(d: float) -> Path:
    """The mesh as a file, cells about d [m] wide."""
    nx, ny, nz = (round(side / d) for side in SIZE)
    fin = max(2, round(0.05 / d))  # cells across the stiffener
    nodes: dict[tuple[int, int, int], int] = {}
    groups: dict[str, list[list[int]]] = {"tank": [], "belt": [], "floor": [], "baffle": [], "stiffener": []}

    def quad(*corners: tuple[int, int, int]) -> list[int]:
        return [nodes.setdefault(corner, len(nodes) + 1) for corner in corners]

    def sides() -> None:
        """Six walls, their normals outward, but for the vent over the second half."""
        vent = {(i, j) for i in (3 * nx // 4 - 1, 3 * nx // 4) for j in (ny // 2 - 1, ny // 2)}
        for i in range(nx):
            for j in range(ny):
                bottom = quad((i, j, 0), (i, j + 1, 0), (i + 1, j + 1, 0), (i + 1, j, 0))
                groups["tank"].append(bottom)
                groups["floor"].append(bottom)
                if (i, j) not in vent:
                    groups["tank"].append(quad((i, j, nz), (i + 1, j, nz), (i + 1, j + 1, nz), (i, j + 1, nz)))
        for k in range(nz):
            walls = [quad((i, 0, k), (i + 1, 0, k), (i + 1, 0, k + 1), (i, 0, k + 1)) for i in range(nx)]
            walls += [quad((i, ny, k), (i, ny, k + 1), (i + 1, ny, k + 1), (i + 1, ny, k)) for i in range(nx)]
            walls += [quad((0, j, k), (0, j, k + 1), (0, j + 1, k + 1), (0, j + 1, k)) for j in range(ny)]
            walls += [quad((nx, j, k), (nx, j + 1, k), (nx, j + 1, k + 1), (nx, j, k + 1)) for j in range(ny)]
            groups["tank"] += walls
            if abs(k + 0.5 - nz / 2) < 1:
                groups["belt"] += walls

    sides()
    for k in range(nz // 5, 4 * nz // 5):
        groups["baffle"] += [quad((nx // 2, j, k), (nx // 2, j + 1, k), (nx // 2, j + 1, k + 1), (nx // 2, j, k + 1)) for j in range(ny)]
    for j in range(fin):
        groups["stiffener"] += [
            quad((i, ny + j, nz // 2), (i + 1, ny + j, nz // 2), (i + 1, ny + j + 1, nz // 2), (i, ny + j + 1, nz // 2)) for i in range(nx)
        ]
    step = np.array(SIZE) / (nx, ny, nz)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(groups))]
    lines += [f'2 {number} "{name}"' for number, name in enumerate(groups, start=1)]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(nodes))]
    lines += [f"{number} {' '.join(repr(float(x)) for x in corner * step)}" for corner, number in nodes.items()]
    cells = [(number, cell) for number, name in enumerate(groups, start=1) for cell in groups[name]]
    lines += ["$EndNodes", "$Elements", str(len(cells))]
    lines += [f"{row} 3 2 {number} {number} {' '.join(map(str, cell))}" for row, (number, cell) in enumerate(cells, start=1)]
    path = Path(tempfile.gettempdir()) / f"taichi_sph_fitted_tank_{nx}_{ny}_{nz}.msh"
    text = "\n".join([*lines, "$EndElements", ""])
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)
    return path


def scene(quality: Quality = "draft") -> Scene:
    d = SPACING[quality]
    steel, path = material("steel, tank", damage=None, delay=None, critical_damage=None), mesh(d)
    plain = {"thickness": THICKNESS, "material": steel, "motion": "free"}
    return Scene(
        name="fitted_tank",
        title="A tank with belt, baffle, stiffener and vent, from one mesh, shaken once",
        source="physical groups of a mesh",
        shells=[
            Shell(
                name="tank", surface=MeshFile(path=path, part="tank"), sections=[Section(where=Group(name="belt"), thickness=BELT)], **plain
            ),
            Shell(name="baffle", surface=MeshFile(path=path, part="baffle"), **plain),
            Shell(name="stiffener", surface=MeshFile(path=path, part="stiffener"), **plain | {"thickness": BELT}),
        ],
        welds=[Weld(between=pair) for pair in (("tank", "baffle"), ("tank", "stiffener"), ("baffle", "stiffener"))],
        fluids=[Fluid(name="water", fill=ShellFill(shell="tank", level=LEVEL), water=Water(sound=60.0), spacing=0.9 * d)],
        motions=[
            PrescribedVelocity(
                body="tank", where=Group(name="floor"), velocity=(1.5, 0, 0), spin=(0, 0, 0), history=HalfSine(duration=10e-3)
            )
        ],
        gravity=(0, 0, -9.81),
        duration=DURATION[quality],
        numerics=Numerics(spacing=d),
        output=Output(frames=20, samples=200),
        quantities=[Quantity(name="leaked_litres", unit="l")],
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)

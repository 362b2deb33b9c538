"""Does the crack in John and Shah's beam depend on the resolution? Runs of beam_impact (T 2.4.2, fig. 2.19, table 2.5)

Notch at 2 in, 800 us, node spacings D of 5, 2.5, 1.5, 1 and 0.5 mm. Expected: the same path, and at mid-height a width of
the crack that settles, 8.5 mm within D on the finest mesh.

    python scenes/beam_convergence.py --quality paper --out DIR
"""

from pathlib import Path
from typing import Literal

from taichi_sph.scene import Quality, Quantity, Study, load_scene

WIDTH = {5.0: 10.0, 2.5: 10.0, 1.5: 7.5, 1.0: 8.0, 0.5: 8.5}  # D [mm] -> width of the crack [mm], T table 2.5
FINEST = {"draft": 1.5, "standard": 1.0, "paper": 0.5}  # mm


def scene(quality: Quality = "draft", formulation: Literal["galerkin", "collocation"] = "galerkin") -> Study:
    cases = {}
    for d, width in WIDTH.items():
        if d < FINEST[quality]:
            continue
        beam = load_scene(Path(__file__).with_name("beam_impact.py"), {"quality": quality, "notch": "2 in", "formulation": formulation})
        cases[f"{d:g}mm"] = beam.derive(
            title=f"{beam.title}, D = {d:g} mm",
            duration="800 us",
            quantities=[
                Quantity(name="crack_width", unit="m", value=width * 1e-3, tolerance=d * 1e-3, source="T table 2.5").model_dump(),
                Quantity(name="crack_angle", unit="deg", value=65, tolerance=3, source="T 2.4.1.3, computed").model_dump(),
            ],
            **{"numerics.spacing": f"{d} mm"},
        )
    return Study(
        name="beam_convergence",
        title="Notched concrete beam under impact at several resolutions",
        source="T 2.4.2, tables 2.4 and 2.5",
        quality=quality,
        cases=cases,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)

"""A plate perforated at 40, 50, 75, 150 and 300 m/s (T 2.4.5, tables 2.9 and 2.10): petals when slow, a plug when fast.

python scenes/perforation_speeds.py --quality paper --out DIR
"""

from pathlib import Path

from taichi_sph.scene import Quality, Study, load_scene

SPEEDS = (40, 50, 75, 150, 300)  # m/s


def scene(quality: Quality = "draft") -> Study:
    script = Path(__file__).with_name("plate_perforation.py")
    return Study(
        name="perforation_speeds",
        title="Hemisphere through a plate at five speeds",
        source="T 2.4.5, tables 2.9 and 2.10",
        quality=quality,
        cases={f"{v}mps": load_scene(script, {"quality": quality, "velocity": float(v)}) for v in SPEEDS},
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)

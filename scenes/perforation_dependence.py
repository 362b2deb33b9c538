"""What does a perforated plate depend on? plate_perforation at one speed, one setting changed at a time.

Spacing (its convergence), delay of damage, transverse shear in the yield function (kappa), layers through the thickness instead of the
global form, tolerance of contact, formulation. There is no friction in the model: T chose the lubricated experiments.

    python scenes/perforation_dependence.py --quality standard --set velocity=150 --out DIR
"""

from pathlib import Path

from taichi_sph.scene import Quality, Speed, Study, load_scene

DELAY = "shells.plate.material.delay.tau_c"
CHANGES = {
    "reference": {},
    "coarser": {"numerics.spacing": 2.0},  # times
    "finer": {"numerics.spacing": 2 / 3},
    "delay x10": {DELAY: 10.0},
    "delay x0.1": {DELAY: 0.1},
    "kappa 1": {"shells.plate.material.strength.kappa": 1.0},
    "5 layers": {"shells.plate.material.strength.layers": 5},
    "contact 1e-2": {"numerics.contact": {"tolerance": 1e-2}},
    "contact 1e-7": {"numerics.contact": {"tolerance": 1e-7}},
}


def scene(quality: Quality = "draft", velocity: Speed = 150.0) -> Study:
    reference = load_scene(Path(__file__).with_name("plate_perforation.py"), {"quality": quality, "velocity": velocity})
    now = {"numerics.spacing": reference.numerics.spacing, DELAY: reference.shells[0].material.delay.tau_c}
    cases = {}
    for name, changes in CHANGES.items():
        values = {key: now[key] * value if key in now else value for key, value in changes.items()}
        cases[name.replace(" ", "-")] = reference.derive(title=f"{reference.title}, {name}", **values)
    return Study(
        name="perforation_dependence",
        title=f"What a plate perforated at {velocity:g} m/s depends on",
        source="T 2.4.5; one setting changed at a time",
        quality=quality,
        cases=cases,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)

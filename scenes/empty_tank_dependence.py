"""What does the empty tank depend on? empty_tank, one setting changed at a time.

Spacing (its convergence), transverse shear in the yield function (kappa), delay of damage, tolerance of contact.

    python scenes/empty_tank_dependence.py --quality standard --out DIR
"""

from pathlib import Path

from taichi_sph.scene import Quality, Study, load_scene

DELAY = "shells.tank.material.delay.tau_c"
CHANGES = {
    "reference": {},
    "coarser": {"numerics.spacing": 1.5},  # times
    "finer": {"numerics.spacing": 2 / 3},
    "kappa 0": {"shells.tank.material.strength.kappa": 0.0},
    "delay x10": {DELAY: 10.0},
    "delay x0.1": {DELAY: 0.1},
    "contact 1e-2": {"numerics.contact": {"tolerance": 1e-2}},
    "contact 1e-7": {"numerics.contact": {"tolerance": 1e-7}},
}


def scene(quality: Quality = "draft") -> Study:
    reference = load_scene(Path(__file__).with_name("empty_tank.py"), {"quality": quality})
    now = {"numerics.spacing": reference.numerics.spacing, DELAY: reference.shells[0].material.delay.tau_c}
    cases = {}
    for name, changes in CHANGES.items():
        values = {key: now[key] * value if key in now else value for key, value in changes.items()}
        cases[name.replace(" ", "-")] = reference.derive(title=f"{reference.title}, {name}", **values)
    return Study(
        name="empty_tank_dependence",
        title="What the empty tank depends on",
        source="T 3.4; one setting changed at a time",
        quality=quality,
        cases=cases,
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)

"""Scenes that cannot be run: (key, bad value, what the sentence must say)."""

from __future__ import annotations

from typing import Any

from .examples import DELETE

MATERIAL = "shells.0.material."

MALFORMED: list[tuple[str, Any, str]] = [
    # misspelt and missing keys
    ("duraton", 1, "unknown key 'duraton'; did you mean 'duration'?"),
    ("numerics.spacng", 1, "unknown key 'spacng' in numerics; did you mean 'spacing'?"),
    (MATERIAL + "youngs", 1, "unknown key 'youngs' in shells[0].material; did you mean 'young'?"),
    ("output.frame", 3, "did you mean 'frames'?"),
    ("shells.0.surface", {"kind": "plate", "lenght": 1, "width": 1}, "did you mean 'length'?"),
    ("numerics.formulation", {"kind": "galerkin", "suport": 1.2}, "did you mean 'support'?"),
    ("duration", DELETE, "duration is missing"),
    (MATERIAL + "poisson", DELETE, "shells[0].material.poisson is missing"),
    (MATERIAL + "delay.tau_c", DELETE, "tau_c is missing"),
    ("shells", [], "shells, rigids, fluids and solids are empty"),
    # units
    ("duration", "20 mm", "duration = '20 mm' is not a time such as '15 us': 'mm' does not convert to s"),
    ("duration", "20", "has no unit"),
    ("duration", "twenty us", "is not a time"),
    ("duration", "2,0 us", "is not a time"),
    ("numerics.spacing", "2 mmm", "unknown unit 'mmm'; did you mean 'mm'?"),
    ("forces.0.total.1", "1 MPa", "is not a force"),
    ("motions.0.velocity.1", "3 m", "is not a speed"),
    (MATERIAL + "poisson", "0.2 mm", "is not a pure number"),
    # values out of range
    ("duration", 0, "must be greater than 0"),
    ("numerics.spacing", -1, "numerics.spacing = -1 m must be greater than 0"),
    (MATERIAL + "poisson", 0.5, "must be less than 0.5"),
    (MATERIAL + "critical_damage", 1.5, "must be at most 1"),
    (MATERIAL + "damage.threshold", 0, "must be greater than 0"),
    (MATERIAL + "delay.tau_c", "-1 us", "must be greater than 0"),
    ("numerics.irregularity", 0.9, "must be at most 0.4"),
    ("numerics.time_step_safety", 1.2, "must be at most 1"),
    ("output.frames", 0, "output.frames = 0 must be at least 1"),
    # kinds
    ("numerics.spacing", True, "is not a length"),
    ("numerics.spacing", [1], "is not a length"),
    ("numerics.seed", 1.5, "is not a whole number"),
    ("numerics.cells", "quads", "did you mean 'quad'?"),
    ("numerics.formulation", "galerkine", "did you mean 'galerkin'?"),
    ("numerics.formulation", {"support": 1.2}, "needs a 'kind': one of 'galerkin', 'collocation'"),
    ("numerics", 3, "numerics = 3 is not a"),
    (
        "shells.0.surface.kind",
        "torus",
        "is not allowed; valid: plate, disc, cylinder, capped_tank, frustum, bullet, box, sphere_patch, sphere, roof, mesh, net",
    ),
    ("shells.0.motion", "in plane", "did you mean 'in_plane'?"),
    ("shells.0.name", "../plate", "it becomes a file name"),
    ("forces.0.where", {"kind": "sphere"}, "valid: box, ball"),
    ("forces.0.where", {"kind": "box", "lo": [0, 0]}, "forces[0].where.lo lacks its entry [2]"),
    ("forces.0.total", [0, 1, 2, 3], "forces[0].total holds 4 entries; at most 3 are allowed"),
    ("quality", "coarse", "is not allowed"),
    # bodies that do not exist
    (MATERIAL + "density", 2.45e-9, "it looks like tonne/mm^3: write '2.45e-09 tonne/mm^3'"),
    (MATERIAL + "density", 2.45, "it looks like g/cm^3: write '2.45 g/cm^3'"),
    (MATERIAL + "density", 1e6, "is not that of a solid"),
    (MATERIAL + "young", 32, "it looks like GPa: write '32 GPa'"),
    (MATERIAL + "young", 32000, "young looks like MPa: write '32000 MPa'"),
    (MATERIAL + "young", "32 TPa", "is outside 1 kPa to 2 TPa"),
    ("shells.0.thickness", "4 m", "is larger than the plate itself"),
    # parts that do not fit together
    (MATERIAL + "damage", None, "need a damage law"),
    ("forces.0.shell", "plat", "forces[0].body: there is no body 'plat'; did you mean 'plate'?"),
    ("motions.0.velocity", [None, None, None], "leaves all three components free"),
    ("motions.0.velocity", [None, 0, 1], "moves in its plane"),
    ("motions.0.spin", [0, 0, None], "its directors do not turn"),
    ("motions.0.spin", ["1 m/s", None, None], "is not an angular speed"),
    ("moments", [{"shell": "plate", "where": "box", "total": [1, 0, 0]}], "moments[0]: shell 'plate' moves in its plane"),
    ("pressures", [{"shell": "plate", "value": "1 MPa"}], "does not bend; give it motion = 'free'"),
    ("pressures", [{"shell": "plat", "value": "1 MPa"}], "there is no body 'plat'"),
    ("gravity", [0, 0, -9.81], "gravity: z must be 0"),
    ("gravity", ["9.81 m/s", 0, 0], "is not an acceleration"),
    ("static", {"increments": 0}, "static.increments = 0 must be at least 1"),
    ("forces.0.total", [0, 0, 5], "moves in its plane"),
    ("forces.0.where", {"kind": "box", "lo": [0.02, None, None], "hi": [0.01, None, None]}, "lo is above hi along x"),
    ("shells.0.cuts.0.end", [0, 0.01, 0], "start and end are the same point"),
    ("shells.0.cuts.0.end", [2, 0.01, 0], "is outside the plate 'plate'"),
    ("quantities", [{"name": "asymmetry"}, {"name": "asymmetry"}], "asked for twice"),
    # computations that nobody can have meant
    ("duration", 20, "is it in microseconds? write '20 us'"),
    ("duration", 1e-12, "is shorter than one time step"),
    ("numerics.spacing", "1 m", "is larger than the body"),
    ("numerics.spacing", "1 um", "at most 50 million are allowed"),
    # loads that act on nothing (found on the mesh)
    ("forces.0.where", {"kind": "ball", "centre": [1, 1, 0], "radius": 0.01}, "forces[0].where catches no node"),
    ("motions.0.where", {"kind": "box", "lo": [None, None, 0.001]}, "motions[0].where catches no node"),
    ("shells.0.sound", [{"kind": "ball", "centre": [0, 0, 0], "radius": 1e-4}], "sound[0] catches no stress point of shell 'plate'"),
    ("motions.0.where", {"kind": "box", "lo": [0.0001, None, None], "hi": [0.0002, None, None]}, "nodes 2 mm apart"),
]

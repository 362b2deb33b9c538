"""Measures: numbers read from the files of a run, by the name that a scene's `Quantity` carries.

A measure is a function of the run folder and the scene, with the options of the quantity as keywords.
It returns None where the run does not show what is measured. To add one, write it and list it here.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping

from ...errors import SceneError, nearest
from ...scene import Quantity, Scene
from ...scene.check import shortened
from ..folder import RunFolder
from . import column, cracks, entry, expansion, fluid, folds, fragments, leak, parting, penetration, perforation, plates, solids, waves

Measure = Callable[..., float | None]

MEASURES: dict[str, tuple[Measure, str]] = {  # name -> function, unit
    "branch_count": (cracks.branch_count, ""),
    "edge_arrival": (cracks.edge_arrival, "s"),
    "tip_speed_plateau": (cracks.tip_speed_plateau, "m/s"),
    "tip_speed_max": (cracks.tip_speed_max, "m/s"),
    "asymmetry": (cracks.asymmetry, ""),
    "bifurcation_time": (cracks.bifurcation_time, "s"),
    "bifurcation_length": (cracks.bifurcation_length, "m"),
    "crack_start": (cracks.crack_start, "s"),
    "crack_length": (cracks.crack_length, "m"),
    "crack_angle": (cracks.crack_angle, "deg"),
    "crack_count": (cracks.crack_count, ""),
    "crack_width": (cracks.crack_width, "m"),
    "pulse_return": (waves.pulse_return, ""),
    "history_value": (waves.history_value, ""),
    "history_peak": (waves.history_peak, ""),
    "history_mean": (waves.history_mean, ""),
    "history_period": (waves.history_period, "s"),
    "peak_time": (plates.peak_time, "s"),
    "displacement": (plates.displacement, "m"),
    "deflection_ratio": (plates.deflection_ratio, ""),
    "place_error": (plates.place_error, ""),
    "frequency_ratio": (plates.frequency_ratio, ""),
    "step_ratio": (plates.step_ratio, ""),
    "relaxation_residual": (plates.relaxation_residual, ""),
    "limit_load": (plates.limit_load, ""),
    "fragments_count": (fragments.fragments_count, ""),
    "largest_fragment_mass": (fragments.largest_fragment_mass, "kg"),
    "dust_mass": (fragments.dust_mass, "kg"),
    "plug_diameter": (fragments.plug_diameter, "m"),
    "hole_diameter": (fragments.hole_diameter, "m"),
    "seen_diameter": (fragments.seen_diameter, "m"),
    "opening_diameter": (fragments.opening_diameter, "m"),
    "crack_opening": (fragments.crack_opening, "m"),
    "petals": (fragments.petals, ""),
    "turn_angle": (parting.turn_angle, "deg"),
    "rim_severed": (parting.rim_severed, ""),
    "rim_severed_at": (parting.rim_severed_at, "s"),
    "tip_crack_length": (parting.tip_crack_length, "m"),
    "striker_speed": (perforation.striker_speed, "m/s"),
    "striker_energy_lost": (perforation.striker_energy_lost, "J"),
    "drag_coefficient": (entry.drag_coefficient, ""),
    "cavity_radius": (entry.cavity_radius, "m"),
    "penetration_depth": (penetration.penetration_depth, "m"),
    "crater_diameter": (penetration.crater_diameter, "m"),
    "peak_force": (perforation.peak_force, "N"),
    "time_to_rupture": (perforation.time_to_rupture, "s"),
    "leak_rate": (leak.leak_rate, "l/s"),
    "leak_rate_error": (leak.leak_rate_error, "l/s"),
    "orifice_rate": (leak.orifice_rate, "l/s"),
    "leaked_litres": (leak.leaked_litres, "l"),
    "jet_speed": (leak.jet_speed, "m/s"),
    "peak_pressure": (leak.peak_pressure, "Pa"),
    "pressure_slope": (fluid.pressure_slope, ""),
    "bottom_pressure": (fluid.bottom_pressure, ""),
    "restlessness": (fluid.restlessness, ""),
    "mean_height": (fluid.mean_height, "m"),
    "surge_delay": (fluid.surge_delay, ""),
    "surge_deviation": (fluid.surge_deviation, ""),
    "surge_speed": (fluid.surge_speed, ""),
    "outflow": (fluid.outflow, ""),
    "core_speed": (fluid.core_speed, ""),
    "momentum_drift": (fluid.momentum_drift, ""),
    "body_length": (solids.body_length, "m"),
    "body_speed": (perforation.body_speed, "m/s"),
    "body_diameter": (solids.body_diameter, "m"),
    "expansion_speed": (expansion.expansion_speed, "m/s"),
    "expansion_speed_max": (expansion.expansion_speed_max, "m/s"),
    "cone_angle": (expansion.cone_angle, "deg"),
    "fold_length": (folds.fold_length, "m"),
    "layer_pressure": (fluid.layer_pressure, "Pa"),
    "face_pressure": (column.face_pressure, "Pa"),
    "face_pressure_peak": (column.face_pressure_peak, "Pa"),
    "face_frequency": (column.face_frequency, "Hz"),
    "axial_speed": (column.axial_speed, "m/s"),
    "front_speed": (column.front_speed, "m/s"),
    "column_ratio": (column.column_ratio, ""),
}


CHOICES = {"axis": ("x", "y", "z"), "how": ("straight", "longest", "total"), "rule": ("predicted", "thesis")}
COUNTED = {"hole_diameter": "hole", "seen_diameter": "hole", "frequency_ratio": "mode", "limit_load": "number"}
PROBE = ("time", "u_x", "u_y", "u_z", "v_x", "v_y", "v_z")  # columns of histories
GAUGE = ("time", "strain", "membrane", "bending")
RIGID = ("time", "x", "y", "z", "vx", "vy", "vz", "fx", "fy", "fz", "f_max")
LEAK = ("time", "escaped_mass", "escaped_count", "rate", "jet_speed", "jet_x", "jet_y", "jet_z", "opening_area")


def _accepted(name: str, options: Mapping[str, object]) -> tuple[Measure, str]:
    if name not in MEASURES:
        raise SceneError(f"there is no measure '{name}'{nearest(name, MEASURES)}")
    function, unit = MEASURES[name]
    keywords = {n: p for n, p in inspect.signature(function).parameters.items() if p.kind is inspect.Parameter.KEYWORD_ONLY}
    for option, value in options.items():
        if option not in keywords:
            raise SceneError(f"measure '{name}' has no option '{option}'{nearest(option, keywords)}")
        kind = "text" if "str" in str(keywords[option].annotation) else "number"
        if (kind == "text") != isinstance(value, str):
            raise SceneError(f"option '{option}' of measure '{name}' is a {kind}, not {value!r}")
        if option in CHOICES and value not in (valid := CHOICES[option]):
            words = ", ".join(f"'{word}'" for word in valid[:-1]) + f" or '{valid[-1]}'"
            close = nearest(str(value), valid)
            close = close if "did you mean" in close and len(valid[0]) > 1 else ""  # all are there already
            raise SceneError(f"option '{option}' of measure '{name}' is {words}, not {value!r}{close}")
    for option, parameter in keywords.items():
        if parameter.default is inspect.Parameter.empty and option not in options:
            raise SceneError(f"measure '{name}' needs the option '{option}'")
    return function, unit


def _whose(scene: Scene, name: str, option: str) -> tuple[list[str], list[str]]:
    """The bodies that an option of a measure may name, and those among which the measure itself would choose."""
    function = MEASURES[name][0]
    if option == "striker":
        rigids = [body.name for body in scene.rigids]
        return rigids, [body.name for body in scene.rigids if any(body.velocity)] or rigids
    fluids = [fluid.name for fluid in scene.fluids]
    if function is leak.peak_pressure:
        return fluids, fluids
    if option == "fluid":
        filled = [fluid.name for fluid in scene.fluids if getattr(fluid.fill, "shell", None) is not None]
        return (filled, filled) if function.__module__ == leak.__name__ else (fluids, fluids)
    if function is perforation.body_speed:
        thrown = {one.body for one in scene.initial}
        moving = [solid.name for solid in scene.solids if solid.name in thrown or (None in thrown and len(scene.bodies) == 1)]
        return moving, moving
    if function.__module__ in (solids.__name__, penetration.__name__):
        return (found := [solid.name for solid in scene.solids]), found
    shells = [shell.name for shell in scene.shells]
    return shells, [] if function is perforation.time_to_rupture else shells


def _check_choice(scene: Scene, quantity: Quantity) -> None:
    """SceneError for an option whose value is none of those that there are: what the measure would refuse at the end of the run."""
    what, options = f"quantity '{quantity.name}'", quantity.options
    if "face" in options:
        faced = [rigid.name for rigid in scene.rigids if rigid.faces]
        if options["face"] not in faced:
            raise SceneError(f"{what}: there is no rigid body '{options['face']}' with faces{nearest(str(options['face']), faced)}")
    counted = COUNTED.get(quantity.name)
    if counted in options and (float(options[counted]) < 1 or float(options[counted]) % 1):
        raise SceneError(f"{what}: option '{counted}' = {options[counted]:g} is no whole number from 1 on")
    if "cut" in options:
        cuts = [len(shell.cuts) for shell in scene.shells if shell.name == options.get("body", shell.name)]
        if options["cut"] not in range(most := max([1, *cuts])):
            raise SceneError(f"{what}: option 'cut' = {options['cut']:g} is outside 0 to {most - 1}: cuts are counted from 0")
    start, end = (options.get(option) for option in ("start", "end"))
    if isinstance(start, float | int) and isinstance(end, float | int) and start >= end:
        raise SceneError(f"{what}: option 'end' = {end:g} is not after 'start' = {start:g}")


def _check_history(scene: Scene, quantity: Quantity) -> None:
    """SceneError for a history, or a column of one, that the scene itself says there will not be: of a probe, gauge, rigid body or leak.
    What else there is, is known when the bodies are made (run/session.py)."""
    known: dict[str, tuple[str, ...]] = {f"probe_{probe.name}": PROBE for probe in scene.output.probes}
    known |= {f"gauge_{gauge.name}": GAUGE for gauge in scene.output.gauges}
    known |= {f"{perforation.PREFIX}{rigid.name}": RIGID for rigid in scene.rigids}
    known |= {leak.called(scene, f.name): LEAK for f in scene.fluids if getattr(f.fill, "shell", None) is not None}
    history, column = (str(quantity.options.get(option, "")) for option in ("history", "column"))
    what = f"quantity '{quantity.name}'"
    if history not in known:
        if history.startswith(("probe_", "gauge_", perforation.PREFIX)):
            raise SceneError(f"{what}: this run writes no history '{history}'{nearest(history, known)}")
    elif column and column not in known[history]:
        raise SceneError(f"{what}: the history '{history}' has no column '{column}'{nearest(column, known[history])}")


def check_quantities(scene: Scene) -> None:
    """Refuses quantities that no measure gives, with a unit or options that it does not have or whose values are none that there are, of a
    body that is not there or is not said."""
    for quantity in scene.quantities:
        try:
            function, unit = _accepted(quantity.name, quantity.options)
        except SceneError as error:
            raise SceneError(shortened(str(error))) from None
        _check_choice(scene, quantity)
        _check_history(scene, quantity)
        for option in {"body", "fluid", "striker"} & set(inspect.signature(function).parameters):
            names, chosen = _whose(scene, quantity.name, option)
            given = quantity.options.get(option)
            if not names and (option == "striker" or function is perforation.body_speed):
                what = "rigid body" if option == "striker" else "solid that starts with a velocity"
                raise SceneError(f"quantity '{quantity.name}' is of a {what}, and the scene has none; leave it out")
            of_whole = function is perforation.body_speed or function.__module__ in (solids.__name__, penetration.__name__)
            parted = [solid.name for solid in scene.solids if solid.patch is not None and solid.name in (given, *chosen)]
            if of_whole and parted:
                raise SceneError(
                    f"quantity '{quantity.name}': solid '{parted[0]}' has a patch, and its parts are not measured as one yet; leave it out"
                )
            if given is not None and given not in names:
                raise SceneError(f"quantity '{quantity.name}': its {option} '{given}' is not in the scene{nearest(str(given), names)}")
            if given is None and len(chosen) > 1:
                raise SceneError(f"quantity '{quantity.name}' is of one {option}: give the option '{option}', one of {', '.join(chosen)}")
        if unit and quantity.unit != unit:
            raise SceneError(f"quantity '{quantity.name}' is measured in '{unit}', not in '{quantity.unit}'")


def measure(name: str, run: RunFolder, options: Mapping[str, object] | None = None) -> float | None:
    """The number `name` of a run, in the unit that MEASURES states."""
    function, _ = _accepted(name, options or {})
    return function(run, run.scene, **(options or {}))

"""Whether a run has its answer before its duration."""

from __future__ import annotations

from pathlib import Path

from ..output.answer import ENOUGH
from ..output.histories import read_history
from ..output.measures.leak import called, rate_and_error
from ..scene import Scene
from ..scene.units import show


def answered(scene: Scene, histories: Path) -> str | None:
    """Why the run may end now, in words; None where it goes on. histories: the folder of its histories."""
    until = scene.until
    if until is None:
        return None
    history = read_history(histories / f"{called(scene, until.fluid)}.csv")
    if not len(history) or history.time[-1] < until.after:
        return None
    now, gone = show(float(history.time[-1]), "s"), int(history["escaped_count"][-1])
    if gone == 0 and history["opening_area"][-1] == 0.0:
        return f"nothing is open at {now}: the run ends"
    if gone < ENOUGH:
        return None
    mass = history["escaped_mass"]
    rate, error = rate_and_error(history.time, mass, float(mass[-1]) / gone)
    if error is None or rate <= 0.0 or error > until.share * rate:
        return None
    return f"the rate of the leak is known within {100 * error / rate:.0f} % at {now}: the run ends"

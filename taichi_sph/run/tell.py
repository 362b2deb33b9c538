"""What a run will be and how it was solved, in lines of text."""

from __future__ import annotations

from ..scene import Scene, Study
from ..scene.units import show
from .plan import Plan
from .progress import Progress, bytes_text, duration_text


def tell_plan(scene: Scene, p: Plan, progress: Progress, pictures: bool = True) -> None:
    """The lines of `validate`; pictures: whether they will be drawn."""
    progress.say(f"{scene.title} ({scene.name}, {scene.quality}{parameters_text(scene)})")
    for body in p.bodies:
        mass = f"mass {body.mass:.6g} kg"
        if body.analytic_mass:
            mass += f" (analytic {body.analytic_mass:.6g} kg, {100 * (body.mass / body.analytic_mass - 1):+.1e} %)"
        spacing = f"{show(body.spacing_min, 'm')}"
        if body.spacing_max > 1.0001 * body.spacing_min:
            spacing += f" to {show(body.spacing_max, 'm')}"
        progress.say(
            f"  {body.name}: {body.nodes} nodes, {body.stress_points} stress points, spacing {spacing}, "
            f"thickness {show(body.thickness, 'm')}, {mass}"
        )
        if body.note:
            progress.say(f"  {body.name}: {body.note}")
    for said in scene.interactions:
        if note := getattr(said, "note", None):
            progress.say(f"  {note}")
    if p.counted:
        progress.say(f"  {p.nodes} nodes and particles are many: they are counted, not made; a run looks at regions, cuts and overlaps")
    for warning in p.warnings:
        progress.say(f"  beware: {warning}")
    n = scene.numerics
    progress.say(f"  {scene.formulations}, {n.precision}, duration {show(scene.duration, 's')}")
    memory = f"{bytes_text(p.memory)} ({bytes_text(p.memory / max(p.nodes, 1))} per node)"
    disk, seconds = bytes_text(p.disk), duration_text(p.total(pictures))
    if p.most > 1.0:  # how far a patch grows is not known
        memory = f"{bytes_text(p.memory)} to {bytes_text(p.most_memory)}"
        disk, seconds = (
            f"{disk} to {bytes_text(p.disk * p.most)}",
            f"{seconds} to {duration_text(p.total(pictures) + p.seconds * (p.most - 1.0))}",
        )
    progress.say(
        f"  estimated: dt {show(p.dt, 's')}, {p.steps} steps, memory {memory}, disk {disk}, {seconds} ({shares_text(p, pictures)})"
    )


def shares_text(p: Plan, pictures: bool = True) -> str:
    """'stepping 12 s, compiling 20 s, writing and pictures 9 s'."""
    drawn = f"writing and pictures {duration_text(p.writing + p.drawing)}" if pictures else f"writing {duration_text(p.writing)}"
    return f"stepping {duration_text(p.seconds)}, compiling {duration_text(p.compiling)}, {drawn}"


def parameters_text(scene: Scene | Study) -> str:
    """', a = 8, formulation = galerkin'."""
    return "".join(f", {k} = {v:g}" if isinstance(v, float) else f", {k} = {v}" for k, v in scene.parameters.items())


def contact_text(contact: dict[str, float]) -> str:
    """One line on how contact was solved and what it cost."""
    text = (
        f"contact: {contact['iterations_per_step']:.1f} iterations a step, {100 * contact['share']:.0f} % of the time; deepest "
        f"penetration {show(contact['penetration'], 'm')}"
    )
    if contact["unsolved"]:
        text += f"; {contact['unsolved']:.0f} of {contact['solves']:.0f} steps ended above the tolerance"
    return text


def overlap_text(overlap: dict[str, float]) -> str:
    """One line on how elements and particles were tied and what it cost."""
    text = (
        f"overlap: {overlap['constraints']:.0f} constraints, {100 * overlap['share']:.1f} % of the time; left of velocities "
        f"{overlap['velocities']:.1g}, of rates of directors {overlap['directors']:.1g}"
    )
    if overlap["damage"] > 0:
        text += f"; damage outside of the patch {100 * overlap['damage']:.2g} % of D_c"
    if overlap.get("growths"):
        text += f"; the patch grew {overlap['growths']:.0f} times"
    return text

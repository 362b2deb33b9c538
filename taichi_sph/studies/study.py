"""A study from its scenes to one answer: each case is an ordinary run in a folder of its own.

What is finished is kept, so a study that was interrupted, or in which a case failed, goes on where it was.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..errors import RunInterrupted, RunStopped, TaichiSphError
from ..output import files
from ..output.lock import locked
from ..run import session as running
from ..run import speed
from ..run.draw import can_draw
from ..run.gate import SUMMARY_FILE, check_out, checked_plan, default_out
from ..run.plan import Plan
from ..run.progress import Progress, bytes_text, duration_text
from ..run.tell import parameters_text
from ..scene import Study, dump
from ..scene.units import show


def run_study(
    study: Study,
    out: Path | None = None,
    *,
    overwrite: bool = False,
    arch: str = "cpu",
    threads: int | None = None,
    pictures: bool = True,
    command: str = "",
    simulation: Callable[..., running.WorldLike] | None = None,
) -> Path:
    """Runs what is not finished yet (all cases anew with `overwrite`), then judges all.

    SceneError before anything is written; RunStopped at the end when a case failed."""
    from ..output.study import STUDY_FILE

    out = out or default_out(study)
    progress = Progress()
    plans = plan_study(study, arch)
    check_out(out, sum(p.disk for p in plans.values()), STUDY_FILE)
    files.check_links(out, study.cases)
    tell_study(study, plans, progress)
    how: dict[str, Any] = {"arch": arch, "threads": threads, "simulation": simulation}
    with locked(out, progress.say):
        return _run_cases(study, out, plans, progress, overwrite=overwrite, pictures=pictures, command=command, **how)


def _run_cases(
    study: Study,
    out: Path,
    plans: dict[str, Plan],
    progress: Progress,
    *,
    overwrite: bool,
    arch: str,
    threads: int | None,
    pictures: bool,
    command: str,
    simulation: Callable[..., running.WorldLike] | None,
) -> Path:
    """`run_study`, in a folder that is ours alone."""
    from ..output.folder import read_json
    from ..output.study import STUDY_FILE, case_answer, finished, interrupted, study_answer, write_study_summary

    with files.whole(out / STUDY_FILE) as file:
        file.write(dump(study))
    (out / SUMMARY_FILE).unlink(missing_ok=True)
    command = command or f"taichi-sph run {out / STUDY_FILE}"
    failed: dict[str, str] = {}
    for number, (case, scene) in enumerate(study.cases.items(), 1):
        folder = out / case
        head = f"case {number} of {len(study.cases)}"
        if finished(folder, scene) and not overwrite:
            progress.say(f"{head}: {case} is finished already and kept; --overwrite runs it anew")
            progress.say(f"  {case_answer(case, read_json(folder / SUMMARY_FILE))}")
            continue
        going_on = interrupted(folder, scene) and not overwrite
        progress.say(f"{head}: {case}{' goes on from its checkpoint' if going_on else ''}, {plans[case].nodes} nodes, compiling ...")
        how: dict[str, Any] = {
            "arch": arch,
            "threads": threads,
            "pictures": False,
            "progress": Progress(terse=True),
            "simulation": simulation,
        }
        try:
            if going_on:
                running.resume(folder, **how)
            else:
                running.run(scene, folder, **how)
        except RunInterrupted as error:
            raise RunInterrupted(f"{error}; or with the whole study: taichi-sph resume {out}") from None
        except TaichiSphError as error:
            failed[case] = str(error)
            progress.say(f"  {case} stopped: {error}")
        else:
            progress.say(f"  {case_answer(case, read_json(folder / SUMMARY_FILE))}")
    how_many = threads or os.cpu_count() or 1
    summary = write_study_summary(out, study, failed, command=command, arch=arch, threads=how_many)
    drawn = draw_study(out, progress) if pictures else []
    for line in ("", *study_answer(study, summary), ""):
        progress.say(line)
    progress.say(f"written: {out}{os.sep} with {SUMMARY_FILE}, and a folder for each case (draw its pictures with taichi-sph render)")
    for path in drawn:
        progress.say(f"picture: {path}")
    if failed:
        raise RunStopped(
            f"{len(failed)} of {len(study.cases)} cases of '{study.name}' failed ({', '.join(failed)}); "
            f"run again what failed with: taichi-sph resume {out}"
        )
    return out


def plan_study(study: Study, arch: str, large: float = math.inf) -> dict[str, Plan]:
    """The plan of each case, refused where this machine cannot hold one; large: as in `plan`."""
    return {case: checked_plan(scene, arch, large) for case, scene in study.cases.items()}


def tell_study(study: Study, plans: dict[str, Plan], progress: Progress) -> None:
    """The lines of `validate`: a line for each case, and the sums."""
    progress.say(f"{study.title} ({study.name}, {study.quality}{parameters_text(study)}): {len(plans)} cases")
    width = max(map(len, plans))
    for case, p in plans.items():
        progress.say(
            f"  {case:{width}}  {p.nodes} nodes, {sum(b.stress_points for b in p.bodies)} stress points, "
            f"dt {show(p.dt, 's')}, {p.steps} steps, {duration_text(p.seconds)} of stepping"
        )
    memory = max(p.memory for p in plans.values())
    disk = sum(p.disk for p in plans.values())
    seconds = speed.BEGIN + sum(p.seconds + p.writing + p.compiling for p in plans.values())  # one comparison is drawn
    progress.say(f"  estimated in all: memory {bytes_text(memory)}, disk {bytes_text(disk)}, {duration_text(seconds)}")


def draw_study(out: Path, progress: Progress | None = None) -> list[Path]:
    """The last frames of all finished cases on one page, or their numbers where the frames show nothing at one scale;
    nothing where fewer than two are finished."""
    from ..output.folder import read_json
    from ..output.study import finished, read_study

    progress = progress or Progress()
    study = read_study(out)
    folders = [out / case for case, scene in study.cases.items() if finished(out / case, scene)]
    if len(folders) < 2 or not can_draw(progress):
        return []
    from ..render import alike, render_compare, render_targets

    if not alike(folders):
        return [render_targets(read_json(out / SUMMARY_FILE), out / "pictures" / "targets.png")]
    columns = 2 if len(folders) <= 4 else 3
    return [render_compare(folders, out / "pictures" / "comparison.png", title=study.title, columns=columns)]

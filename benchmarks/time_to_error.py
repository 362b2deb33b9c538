"""How long until the answer is good to so many percent? galerkin, collocation and finite elements on two static cases.

The clamped plate of scenes/clamped_plate.py at e/L = 1e-3 and the roof of scenes/scordelis_lo.py, regular quadrangles.
Finite elements of the plate: scikit-fem's Morley triangles (thin plate; e/L = 1e-3 is thin to 2e-5); of the roof, for
which the library has no shell: MITC4 of taichi_sph/verification/elements.py, assembled in plain Python, solved by SciPy's sparse LU,
seconds of the solution alone beside those of all. Ours are those of the relaxation; building the model and loading or
compiling its kernels stand beside them.

    pip install -e '.[fem]' && python benchmarks/time_to_error.py --out benchmarks/time_to_error.json
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np

from taichi_sph import runtime
from taichi_sph.bodies.shell.instead.modes import free_directions
from taichi_sph.errors import TaichiSphError
from taichi_sph.output.record import machine, versions
from taichi_sph.scene import Scene
from taichi_sph.scene.script import load_scene
from taichi_sph.verification.elements import shell_stiffness
from taichi_sph.world.world import World

SCENES = Path(__file__).resolve().parents[1] / "scenes"
SIZES = {"plate": (8, 12, 20, 40), "roof": (8, 12, 20, 40)}  # nodes along the longer side
FINER = (16, 32, 64, 128)  # cells of the library's plate
WANTED = (0.05, 0.02, 0.005)  # errors


def scene(case: str, formulation: str, nodes: int) -> Scene:
    """The regular quadrangles of the paper, on so many nodes."""
    if case == "plate":
        found = load_scene(SCENES / "clamped_plate.py", {"slenderness": 1e-3, "quality": "paper", "formulation": formulation})
        return found.derive(**{"numerics.spacing": 1.0 / (nodes - 1)})
    found = load_scene(SCENES / "scordelis_lo.py", {"nodes": "regular", "quality": "paper", "formulation": formulation})
    return found.derive(**{"numerics.spacing": 25.0 / (nodes - 1)})


def ours(case: str, formulation: str, nodes: int) -> dict:
    """Error and seconds of one run; no error where no equilibrium is found."""
    given = scene(case, formulation, nodes)
    began = time.perf_counter()
    sim = World(given)
    built = time.perf_counter()
    try:
        sim.advance(1)
        error = abs(_deflection(given, sim.shell.mesh.points, runtime.get(sim.shell.nodes.u, sim.shell.nodes.n)) - 1)
    except TaichiSphError:
        error = None
    end = time.perf_counter()
    return {
        "nodes": sim.shell.nodes.n,
        "error": error,
        "solve": end - built,
        "seconds": end - built,
        "build": built - began,
        "steps": sim.step,
    }


def _deflection(given: Scene, X: np.ndarray, u: np.ndarray) -> float:
    """Over the reference: at a node, or the mean of the nodes around the point."""
    from taichi_sph.output.measures.plates import at_point

    options = given.quantities[0].options
    point = np.array([options["x"], options["y"], options.get("z", 0.0)])
    return float(at_point(X, u.astype(float), point)[2] / options["reference"])


def elements(case: str, nodes: int) -> dict:
    """The same nodes with MITC4."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import spsolve

    given = scene(case, "galerkin", nodes)
    sim = World(given)  # for its mesh, its supports and its loads
    shell = given.shells[0]
    free = free_directions(sim.shell)
    n, c, f = free.shape
    at = np.argwhere(np.abs(free).max(axis=1) > 0.5)
    basis = csc_array(
        (free[at[:, 0], :, at[:, 1]].ravel(), ((c * at[:, :1] + np.arange(c)).ravel(), np.repeat(np.arange(len(at)), c))),
        shape=(c * n, len(at)),
    )
    load = np.zeros((n, c))
    area = sim.shell.mesh.node_areas
    for pressure in given.pressures:
        load[:, :3] += pressure.value * area[:, None] * sim.shell.mesh.node_normals
    if given.gravity is not None:
        load[:, :3] += area[:, None] * shell.thickness * shell.material.density * np.array(given.gravity)
    began = time.perf_counter()
    K = shell_stiffness(sim.shell.mesh, shell.material.young, shell.material.poisson, shell.thickness)
    K = (basis.T @ K @ basis).tocsc()
    assembled = time.perf_counter()
    u = (basis @ spsolve(K, basis.T @ load.ravel())).reshape(n, c)[:, :3]
    end = time.perf_counter()
    return {"nodes": n, "error": abs(_deflection(given, sim.shell.mesh.points, u) - 1), "solve": end - assembled, "seconds": end - began}


def library(cells: int) -> dict:
    """scikit-fem: the clamped plate with Morley triangles, unit stiffness and load."""
    import skfem
    from skfem.helpers import dd, ddot, eye, trace
    from skfem.models.poisson import unit_load

    began = time.perf_counter()
    line = np.linspace(0, 1, cells + 1)
    mesh = skfem.MeshTri.init_tensor(line, line)
    basis = skfem.Basis(mesh, skfem.ElementTriMorley(), intorder=4)

    @skfem.BilinearForm
    def bending(u, v, w):
        return ddot(0.7 * dd(u) + 0.3 * eye(trace(dd(u)), 2), dd(v))

    K, load = bending.assemble(basis), unit_load.assemble(basis)
    assembled = time.perf_counter()
    u = skfem.solve(*skfem.condense(K, load, D=basis.get_dofs().all(["u", "u_n"])))
    end = time.perf_counter()
    middle = u[basis.nodal_dofs[0, np.argmin(np.linalg.norm(mesh.p - 0.5, axis=0))]]
    reference = 1.265319e-3  # thin plate
    return {"nodes": mesh.p.shape[1], "error": abs(middle / reference - 1), "solve": end - assembled, "seconds": end - began}


def to_error(rows: list[dict], wanted: float) -> float | None:
    """Seconds to an error, by the line in log-log between the two sizes around it; None where no size reaches it."""
    rows = [r for r in rows if r["error"] is not None]
    for before, after in zip(rows, rows[1:]):
        if before["error"] >= wanted >= after["error"]:
            part = math.log(before["error"] / wanted) / math.log(before["error"] / after["error"])
            return math.exp((1 - part) * math.log(before["seconds"]) + part * math.log(after["seconds"]))
    return rows[0]["seconds"] if rows and rows[0]["error"] <= wanted else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path)
    out = parser.parse_args().out
    content: dict = {"machine": machine(), "versions": versions(), "cases": {}}
    for case, sizes in SIZES.items():
        methods = {
            "galerkin": lambda n, case=case: ours(case, "galerkin", n),
            "collocation": lambda n, case=case: ours(case, "collocation", n),
            "MITC4": lambda n, case=case: elements(case, n),
        }
        for formulation in ("galerkin", "collocation"):
            ours(case, formulation, min(sizes))  # compiled
        found = {name: [method(n) for n in sizes] for name, method in methods.items()}
        if case == "plate":
            library(8)
            found["scikit-fem, Morley"] = [library(n) for n in FINER]
        print(f"\n{case}\nmethod                 nodes   error [%]   all [s]   solve [s]")
        for name, rows in found.items():
            for r in rows:
                error = "none" if r["error"] is None else f"{100 * r['error']:.2f}"
                print(f"{name:20s} {r['nodes']:7d} {error:>11s} {r['seconds']:9.3f} {r['solve']:11.3f}")
        print("seconds to an error of " + ", ".join(f"{100 * w:g} %" for w in WANTED))
        for name, rows in found.items():
            times = [to_error(rows, w) for w in WANTED]
            print(f"{name:20s} " + ", ".join("not reached" if t is None else f"{t:.2f}" for t in times))
        content["cases"][case] = found
    if out is not None:
        out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        print(f"\nwritten: {out}")


if __name__ == "__main__":
    main()

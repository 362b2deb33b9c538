"""What each scene requires, and nothing else: fields, bytes, kernels, seconds to compile.

    python benchmarks/required.py [--out benchmarks/required.json] [SCENE ...]

Each scene (draft; of a study its first run) is built and does one step in a process of its own, with an empty cache of kernels and again
with a full one. Prints a table in markdown.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SCENES = Path(__file__).parents[1] / "scenes"
ONE = """
import json, sys
from pathlib import Path
from taichi_sph.run.doctor import requirements
from taichi_sph.scene import Study
from taichi_sph.scene.script import load
scene = load(Path(sys.argv[1]))
if isinstance(scene, Study):
    scene = next(iter(scene.cases.values()))
print(json.dumps(requirements(scene)))
"""
FEATURES = {
    "bending": r"nodes\.omega",
    "plasticity": r"cells\.plastic",
    "contact": r"pairs\.",
    "fluid": r".*\.rate_before",
}  # names of fields


def required(path: Path) -> dict:
    """requirements() of the scene, cold; with `warm`, seconds to the end of the first step when the kernels are in the cache."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(2):
            run = subprocess.run(
                [sys.executable, "-c", ONE, str(path)],
                capture_output=True,
                text=True,
                env={**os.environ, "TI_OFFLINE_CACHE_FILE_PATH": folder},
            )
            if run.returncode:
                sys.exit(f"{path.stem}: {run.stderr.strip().splitlines()[-1]}")
            found.append(json.loads(run.stdout.strip().splitlines()[-1]))
    cold, warm = found
    return {**cold, "warm": warm["built"] + warm["first_step"]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", help="names; default: all")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    paths = [SCENES / f"{name}.py" for name in options.scenes] or sorted(SCENES.glob("[!_]*.py"))
    print(f"| scene | nodes | fields | bytes per node | kernels | {' | '.join(FEATURES)} | s cold | s warm |")
    print(f"|{' --- |' * (7 + len(FEATURES))}")
    rows = {}
    for path in paths:
        r = rows[path.stem] = required(path)
        has = ["yes" if any(re.match(pattern, name) for name in r["fields"]) else "" for pattern in FEATURES.values()]
        each = sum(r["fields"].values()) / r["nodes"]
        print(
            f"| {path.stem} | {r['nodes']} | {len(r['fields'])} | {each:.0f} | {len(r['kernels'])} | {' | '.join(has)} "
            f"| {r['built'] + r['first_step']:.1f} | {r['warm']:.1f} |",
            flush=True,
        )
    if options.out:
        options.out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

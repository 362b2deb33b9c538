"""Classical cases of shells by particles and by finite elements on the same nodes, in one table.

    python benchmarks/elements.py [--quality draft] [--cases clamped_plate,wave] [--forms galerkin,elements,elements_1]

Each case is a run of a scene of the package in a folder of its own under --out; what is there already is not computed again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

CASES = {
    "clamped_plate": "A3: deflection over Mindlin's; order of convergence",
    "cantilever": "A4: tip over Timoshenko's; distance of the tip from its place on the circle over the length",
    "scordelis_lo": "A5: deflection over 0.3024",
    "pinched_cylinder": "A6: deflection over 1.5036e-5 (spread), 1.8248e-5 (point)",
    "hemisphere": "deflection over 0.0940 (MacNeal and Harder 1985)",
    "wave": "A7: amplitude of the returns; when they come",
    "plate_modes": "A8: frequencies over Mindlin's",
    "critical_step": "A9: predicted step over the measured limit",
}


def summary_of(scene: str, form: str, quality: str, out: Path) -> dict[str, Any]:
    """The summary of a run, made now or before."""
    folder = out / f"{scene}-{form}-{quality}"
    if not (folder / "summary.json").is_file():
        command = [sys.executable, "-m", "taichi_sph", "run", scene, "--quality", quality, "--set", f"formulation={form}"]
        done = subprocess.run([*command, "--out", str(folder), "--overwrite"], capture_output=True, text=True)
        if not (folder / "summary.json").is_file():
            raise SystemExit(f"{scene}, {form}: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def shown(quantity: dict[str, Any] | None) -> str:
    """The value; in brackets where it is not as expected."""
    if quantity is None or quantity["value"] is None:
        return ""
    text = f"{quantity['value']:.4g}"
    return f"({text})" if quantity.get("met") is False else text


def table(scene: str, forms: list[str], quality: str, out: Path) -> str:
    """Markdown: a line for each quantity that has a target, a column for each form."""
    found = {form: summary_of(scene, form, quality, out)["quantities"] for form in forms}
    names = dict.fromkeys(name.replace(f"{form}_", "") for form in forms for name, q in found[form].items() if q.get("target") is not None)
    lines = [f"\n{CASES.get(scene, scene)}\n", f"| {scene}, {quality} | {' | '.join(forms)} |", "| --- " * (len(forms) + 1) + "|"]
    for name in names:
        values = [next((q for key, q in found[form].items() if key.replace(f"{form}_", "") == name), None) for form in forms]
        lines.append(f"| {name} | {' | '.join(shown(value) for value in values)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--cases", default=",".join(CASES))
    parser.add_argument("--forms", default="galerkin,elements,elements_1")
    parser.add_argument("--out", type=Path, default=Path("runs/elements"))
    args = parser.parse_args()
    for scene in args.cases.split(","):
        print(table(scene, args.forms.split(","), args.quality, args.out), flush=True)


if __name__ == "__main__":
    main()

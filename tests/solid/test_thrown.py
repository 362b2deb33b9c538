"""A solid that is thrown at a shell: its history, its speed, and what the answer says of both, as of a rigid striker."""

import subprocess
import sys

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output.answer import answer
from taichi_sph.output.folder import RunFolder
from taichi_sph.output.histories import History
from taichi_sph.output.measures import perforation
from taichi_sph.output.measures.entry import way
from taichi_sph.output.measures.fragments import flight
from taichi_sph.output.measures.penetration import penetration_depth
from taichi_sph.scene import (
    Brick,
    Concrete,
    Delay,
    InitialVelocity,
    Material,
    Numerics,
    Output,
    Pinball,
    Rigid,
    Scene,
    Solid,
)

SCENE = """
from taichi_sph.scene import InitialVelocity, Material, Numerics, Ogive, Output, Plate, Quantity, Scene, Shell, Solid, material


def scene(quality="draft"):
    steel = Material(name="steel", young=210e9, poisson=0.3, density=7800.0)
    plate = Shell(
        name="plate", surface=Plate(length=0.1, width=0.1, origin=(-0.05, -0.05, 0)), thickness=1e-3, material=material("steel, tank"),
        motion="free",
    )
    nose = Ogive(radius=9e-3, length=5e-3, crh=0.5, origin=(0, 0, 14.6e-3), turned=True)
    return Scene(
        name="thrown", title="a bullet on a plate", source="tests", shells=[plate],
        solids=[Solid(name="bullet", shape=nose, material=steel, spacing=4.5e-3)],
        initial=[InitialVelocity(body="bullet", velocity=(0, 0, -60.0))], duration=3e-5, numerics=Numerics(spacing=5e-3),
        output=Output(frames=6, samples=30),
        quantities=[
            Quantity(name="body_speed", unit="m/s", options={"body": "bullet"}),
            Quantity(name="body_speed", unit="m/s", options={"time": 0.0}),
            Quantity(name="body_length", unit="m"),
        ],
    )
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("thrown")
    (folder / "thrown.py").write_text(SCENE)
    command = [sys.executable, "-m", "taichi_sph", "run", "thrown.py", "--out", "out", "--no-pictures", "--threads", "1"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return RunFolder(folder / "out")


def test_the_history_is_that_of_the_centre_of_mass(run):
    history = run.history("solid_bullet")
    assert history.path.read_text().splitlines()[0] == "time [s],x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]"
    assert history["vz"][0] == pytest.approx(-60.0, rel=1e-6) and -60.0 < history["vz"][-1] < -40.0
    way = history["z"][0] - history["z"][-1]
    assert way == pytest.approx(-np.trapezoid(history["vz"], history.time), rel=0.01)


def test_measures_and_answer_speak_of_it(run):
    v = perforation.speeds(run.history("solid_bullet"))
    found = run.summary["quantities"]
    assert found["body_speed(body=bullet)"]["value"] == pytest.approx(v[-1], rel=1e-9)
    assert found["body_speed(time=0.0)"]["value"] == pytest.approx(60.0, rel=1e-6)
    assert perforation.body_speed(run, run.scene, axis="z", beyond=-1.0) is None
    with pytest.raises(SceneError, match="names a solid that starts with a velocity; did you mean 'bullet'"):
        perforation.body_speed(run, run.scene, body="bulet")
    place, direction, speed = flight(run)
    np.testing.assert_allclose(direction, (0, 0, -1), atol=1e-9)
    assert speed == pytest.approx(60.0, rel=1e-6)
    text = "\n".join(answer(run))
    assert f"The bullet ends at {v[-1]:.3g} m/s after 60 m/s (its centre of mass)." in text


def bricks() -> Scene:
    """A brick that may break, thrown at a second one. Two balls fly elsewhere."""
    law = Concrete(tension=2e6, compression=12e6, B=3100.0)
    concrete = Material(name="c", young=10e9, poisson=0.2, density=2300.0, damage=law, delay=Delay(a=1, tau_c=2e-6), critical_damage=0.9)
    balls = [
        Rigid(name=f"ball{k}", mass=1e-3, pinballs=[Pinball(centre=(0.1 * k, 0, 0.1), radius=1e-3)], velocity=(0, 0, 20.0)) for k in (1, 2)
    ]
    return Scene(
        name="bricks", title="Bricks", source="tests", rigids=balls,
        solids=[
            Solid(name=name, shape=Brick(size=(0.02, 0.02, 0.02), origin=(0, 0, low)), material=concrete)
            for name, low in (("first", 0.0), ("second", -0.0201))
        ],
        initial=[InitialVelocity(body="first", velocity=(0, 0, -50.0))], duration=3e-6, numerics=Numerics(spacing=5e-3),
        output=Output(frames=2, samples=4),
    )  # fmt: skip


def test_the_section_is_of_what_is_struck(tmp_path, monkeypatch):
    """The flier is no solid that is struck, and its depth is its own way: with two rigid bodies beside it that could not say theirs.
    Without the other solid there is no section."""
    pytest.importorskip("matplotlib")
    from taichi_sph.render.crater import section
    from taichi_sph.run.session import run as compute

    compute(bricks(), tmp_path / "run", pictures=True)
    with RunFolder(tmp_path / "run") as folder:
        assert (folder.pictures / "crater.png").is_file()
        gone = way(folder.history("solid_first"))
        assert gone is not None and gone[-1] == pytest.approx(50.0 * 3e-6, rel=0.05)
        own = section(folder)
        assert own is not None and own.axes[0].get_xlim()[1] == pytest.approx(2.2e3 * gone.max())
        alone = {kind: [file for file in folder.of_kind(kind) if file.name != "second"] for kind in ("rigid", "solid")}
        monkeypatch.setattr(folder, "of_kind", alone.get)
        assert section(folder) is None


def test_what_rests_has_no_way(tmp_path):
    """No direction, no depth: None, and no nan."""
    still = {name: np.zeros(3) for name in ("time", "x", "y", "z", "vx", "vy", "vz")}
    assert way(History(tmp_path / "rigid_a.csv", still, {})) is None
    np.testing.assert_allclose(way(History(tmp_path / "rigid_a.csv", still | {"x": np.arange(3.0), "vx": np.ones(3)}, {})), np.arange(3.0))
    (tmp_path / "histories").mkdir()
    columns = "time [s],x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]"
    (tmp_path / "histories" / "rigid_a.csv").write_text(f"{columns}\n0,0,0,0,0,0,0\n1,0,0,-1,0,0,-1\n")
    assert penetration_depth(RunFolder(tmp_path), None) is None

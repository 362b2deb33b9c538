"""Scenes by name from any folder, modules beside a script, and a scene to start from."""

from __future__ import annotations

from pathlib import Path

import pytest

from taichi_sph import cli
from taichi_sph.errors import SceneError
from taichi_sph.run.new import write_scene
from taichi_sph.run.plan import plan
from taichi_sph.scene import load_scene, parameters_of


def test_a_scene_of_the_package_runs_from_any_folder(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as done:
        cli.main(arguments=["validate", "tank_leak"])
    assert done.value.code == 0 and "Tank filled to 100 %" in capsys.readouterr().out
    with pytest.raises(SceneError, match="there is no scene 'tank_lek'; did you mean 'tank_leak'"):
        cli._find("tank_lek")


def test_scenes_of_the_folder_come_before_those_of_the_package(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenes").mkdir()
    own = write_scene("tank_leak", Path("scenes"))
    assert cli._find("tank_leak") == own and cli._find("empty_tank").is_file()


def test_what_begins_with_an_underscore_is_no_scene(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError, match="there is no scene '_tank'"):
        cli._find("_tank")


def test_each_script_finds_the_modules_of_its_own_folder(tmp_path) -> None:
    for folder, speed in (("one", 100.0), ("two", 150.0)):
        (tmp_path / folder).mkdir()
        script = write_scene("hit", tmp_path / folder)
        (tmp_path / folder / "shared.py").write_text(f"SPEED = {speed}\n")
        script.write_text("from shared import SPEED\n\n" + script.read_text().replace("velocity: Speed = 200.0", "velocity: Speed = SPEED"))
        assert parameters_of(script)["velocity"].default == speed


def test_a_new_scene_can_be_run(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as done:
        cli.main(arguments=["new", "my_sheet"])
    assert done.value.code == 0 and "written: my_sheet.py" in capsys.readouterr().out
    scene = load_scene(Path("my_sheet.py"), {"velocity": "250"})
    assert scene.name == "my_sheet" and plan(scene).nodes > 1000 and scene.rigids[0].velocity[2] == -250
    for name, said in (("my_sheet", "is there already"), ("../x", "is no name for a scene"), ("", "is no name for a scene")):
        with pytest.raises(SceneError, match=said):
            write_scene(name, Path())


@pytest.mark.parametrize(
    ("name", "said", "why"),
    [
        ("slab_penetration", {"velocity": "0"}, "velocity = 0 m/s: give more than 0"),
        ("slab_penetration", {"velocity": "-100"}, "velocity = -100 m/s: give more than 0"),
        ("slab_penetration", {"compression": "0"}, "compression = 0 Pa: give more than 0"),
        ("slab_penetration", {"tau_c": "0"}, "tau_c = 0 s: give more than 0"),
        ("slab_penetration", {"spacing": "0"}, "spacing = 0 m: give more than 0, or leave it out for 3.15 mm"),
        ("slab_penetration", {"pilot": "-1 mm"}, "pilot = -0.001 m: give half the width of the hole, or 0 for none"),
        ("empty_tank", {"velocity": "0", "metal": "mild"}, r"velocity = 0 m/s: a bullet of metal \(mild\) needs more than 0"),
        ("tank_leak", {"velocity": "-5", "metal": "hard"}, r"velocity = -5 m/s: a bullet of metal \(hard\) needs more than 0"),
    ],
)
def test_scenes_refuse_what_means_nothing(name, said, why) -> None:
    with pytest.raises(SceneError, match=why):
        load_scene(cli._find(name), said)

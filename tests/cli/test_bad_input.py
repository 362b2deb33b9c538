"""Whatever is wrong with what a user gives: one sentence on stderr, exit code 2, nothing written."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ..scene.examples import spoiled
from ..scene.malformed import MALFORMED
from .conftest import files


def refused(result: tuple[int, str, str], before: dict[str, bytes], work: Path, said: str = "") -> None:
    code, out, err = result
    assert code == 2, err
    assert said in err
    assert err.startswith("taichi-sph: ") and err.count("\n") == 1 and "Traceback" not in out + err
    assert files(work) == before


@pytest.mark.parametrize("command", ["run", "validate"])
@pytest.mark.parametrize(("key", "value", "said"), MALFORMED, ids=lambda v: str(v)[:40])
def test_scenes(call, work, fake, command, key, value, said):
    path = work / "bad.json"
    path.write_text(json.dumps(spoiled(key, value)))
    refused(call(command, str(path)), files(work), work, said)
    assert fake.asked == []


SCRIPT = """
from taichi_sph.scene import load_scene
def scene(quality: str = "draft", n: int = 3):
    return load_scene("small.json")
"""

OPTIONS = [
    (["run"], "Missing argument 'SCENE'"),
    (["run", "smal"], "there is no scene 'smal'; did you mean 'small'?"),
    (["run", "none.py"], "there is no scene file 'none.py'"),
    (["run", "small.toml"], "there is no scene file"),
    (["run", "."], "there is no scene '.'"),
    (["runn", "small"], "No such command 'runn'"),
    (["run", "small", "--qualty", "draft"], "No such option: --qualty"),
    (["run", "small", "--threads", "0"], "--threads"),
    (["run", "small", "--threads", "two"], "--threads"),
    (["run", "small", "--arch", "gpu"], "--arch"),
    (["run", "small", "--set", "n"], "is not of the form key=value"),
    (["run", "small", "--set", "n="], "is not of the form key=value"),
    (["run", "small", "--set", "n=1", "--set", "n=2"], "--set n is given twice"),
    (["run", "small", "--set", "n=x"], "option n = 'x' is not a whole number"),
    (["run", "small", "--set", "m=1"], "unknown option 'm' of small.py"),
    (["run", "small", "--set", "numerics.spacng=1"], "did you mean 'spacing'?"),
    (["run", "small", "--set", "numerics.spacing=1kg"], "is not a length"),
    (["run", "small", "--quality", "best"], "is not allowed"),
    (["run", "small", "--quality", "draft", "--set", "quality=paper"], "contradicts"),
    (["run", "small", "--out", "small.json"], "is a file; give a folder"),
    (["run", "small", "--out", "."], "holds files that are not of a run"),
    (["run", "small", "--out", "small.json/deep"], "cannot be written"),
    (["resume"], "Missing argument 'DIR'"),
    (["resume", "nowhere"], "'nowhere' is not a run"),
    (["resume", "."], "'.' is not a run"),
    (["render", "nowhere"], "'nowhere'"),
    (["compare", "nowhere"], "there is no run folder 'nowhere'"),
    (["results"], "no run is recorded"),
    (["results", "nowhere"], "there is no run folder 'nowhere'"),
    (["spectrum", "small", "--cells", "1"], "--cells"),
]


@pytest.mark.parametrize(("arguments", "said"), OPTIONS, ids=lambda v: " ".join(v) if isinstance(v, list) else "")
def test_options(call, work, fake, scene_file, arguments, said):
    (work / "scenes").mkdir()
    (work / "scenes" / "small.py").write_text(SCRIPT)
    refused(call(*arguments), files(work), work, said)


def test_a_script_that_lies_here(call, work, fake):
    """`new` writes into this folder where there is no scenes/; the bare name is that of a scene, and the sentence names the file."""
    (work / "mine.py").write_text(SCRIPT)
    refused(call("run", "mine"), files(work), work, "there is no scene 'mine' in scenes/; the script here is 'mine.py'")


FACET = "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex {}\nendloop\nendfacet\nendsolid"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "there is no mesh file"),
        ("", "is an empty file"),
        ("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "mesh plate.stl"),
        (FACET.format("nan 1 0"), "'nan' stands where a coordinate should"),
        (FACET.format("2 0 0"), "is flat"),
        (FACET.format("0 1 1"), "z = constant"),
    ],
)  # fmt: skip
def test_meshes(call, work, fake, content, said):
    data = spoiled("shells.0.surface", {"kind": "mesh", "path": "plate.stl", "scale": 2e-3})
    data["shells"][0]["cuts"], data["forces"], data["motions"] = [], [], []
    (work / "bad.json").write_text(json.dumps(data))
    if content is not None:
        (work / "plate.stl").write_text(content)
    refused(call("run", "bad.json"), files(work), work, said)


def cut_off(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-10])


def flip_a_bit(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-3] ^= 1
    path.write_bytes(bytes(data))


def empty(path: Path) -> None:
    path.write_bytes(b"")


def foreign(path: Path) -> None:
    from taichi_sph.output import checkpoint

    saved = checkpoint.load(path)
    checkpoint.save(path.parent, scene_hash="0", time=saved.time, step=saved.step, dt=saved.dt, state=saved.state)


def other_arrays(path: Path) -> None:
    from taichi_sph.output import checkpoint
    from taichi_sph.output.record import scene_hash
    from taichi_sph.scene import load_scene

    scene = load_scene(path.parents[1] / "scene.json")
    checkpoint.save(
        path.parent, scene_hash=scene_hash(scene), time=1e-5, step=int(path.stem.split("_")[1]), dt=1.0, state={"y": np.zeros(3)}
    )


def another_scene(path: Path) -> None:
    scene = path.parents[1] / "scene.json"
    scene.write_text(scene.read_text().replace('"poisson": 0.2', '"poisson": 0.25'))


def broken_scene(path: Path) -> None:
    (path.parents[1] / "scene.json").write_text("{")


def none_left(path: Path) -> None:
    path.unlink()


CHECKPOINTS = [
    (cut_off, "is cut off"),
    (flip_a_bit, "checksum does not match"),
    (empty, "is not a checkpoint of this package"),
    (foreign, "belongs to another scene"),
    (other_arrays, "belongs to another scene"),
    (another_scene, "belongs to another scene"),
    (broken_scene, "is not valid JSON"),
    (none_left, "there is no checkpoint"),
]


@pytest.mark.parametrize(("spoil", "said"), CHECKPOINTS, ids=lambda v: getattr(v, "__name__", ""))
def test_checkpoints(call, work, fake, scene_file, spoil, said):
    fake.on_step = lambda sim: sim.step == 30 and signal_self()
    code, _, _ = call("run", "small.json", "--out", "r", "--no-pictures")
    assert code == 130
    older, path = sorted((work / "r" / "checkpoints").iterdir())
    older.unlink()
    spoil(path)
    refused(call("resume", "r"), files(work), work, said)


def test_a_damaged_newest_checkpoint_is_passed_over_for_the_one_before_it(call, work, fake, scene_file):
    fake.on_step = lambda sim: sim.step == 30 and signal_self()
    assert call("run", "small.json", "--out", "r", "--no-pictures")[0] == 130
    older, newest = sorted((work / "r" / "checkpoints").iterdir())
    flip_a_bit(newest)
    fake.on_step = None
    code, out, err = call("resume", "r", "--no-pictures")
    assert (code, err) == (0, "") and "step 20" in out
    assert f"{newest.name}' is damaged" in out and f"put aside as {newest.name}.damaged, the one before it is taken" in out
    assert call("run", "small.json", "--out", "whole", "--no-pictures")[0] == 0
    records = [json.loads((work / name / "record.json").read_text())["result_hash"] for name in ("r", "whole")]
    assert records[0] == records[1]


def test_where_no_checkpoint_is_whole_one_sentence_names_all(call, work, fake, scene_file):
    fake.on_step = lambda sim: sim.step == 30 and signal_self()
    assert call("run", "small.json", "--out", "r", "--no-pictures")[0] == 130
    older, newest = sorted((work / "r" / "checkpoints").iterdir())
    cut_off(older)
    empty(newest)
    before = files(work)
    result = call("resume", "r")
    refused(result, before, work, f"{newest.name}' is not a checkpoint of this package; nor can an older one be used: ")
    assert f"{older.name}' is cut off" in result[2]


def signal_self() -> None:
    import signal

    signal.raise_signal(signal.SIGINT)

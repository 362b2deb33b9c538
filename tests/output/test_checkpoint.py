from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from taichi_sph.errors import RunStopped, SceneError
from taichi_sph.output import checkpoint

STATE = {
    "nodes.u": np.random.default_rng(1).normal(size=(50, 3)),
    "cells.broken": np.arange(40, dtype=np.int32),
    "cells.rupture_time": np.array([1e-6, np.nan]),
    "time": np.array(1.25e-5),
    "empty": np.empty((0, 2), dtype=np.float32),
}


def save(folder: Path, step: int = 10, **options: object) -> Path:
    keywords = {"scene_hash": "abc", "time": 1.25e-5, "step": step, "dt": 2e-8, "state": STATE, "keep": 2, "unset": ["rupture_time"]}
    return checkpoint.save(folder, **(keywords | {"extra": {"seconds": 3.5}} | options))


def test_round_trip_bit_for_bit(tmp_path: Path) -> None:
    read = checkpoint.load(save(tmp_path), "abc")
    assert (read.time, read.step, read.dt, read.extra) == (1.25e-5, 10, 2e-8, {"seconds": 3.5})
    assert read.state.keys() == STATE.keys()
    for name, array in STATE.items():
        assert read.state[name].dtype == array.dtype and read.state[name].shape == array.shape
        np.testing.assert_array_equal(read.state[name], array)
        assert read.state[name].flags.writeable


def test_last_k_kept(tmp_path: Path) -> None:
    for step in (1, 20, 300, 4000):
        save(tmp_path, step)
    assert [checkpoint.load(p).step for p in checkpoint.list_checkpoints(tmp_path)] == [300, 4000]
    assert checkpoint.latest(tmp_path).name == "step_000004000.checkpoint"
    assert len(list(tmp_path.iterdir())) == 2  # no temporary files


def test_the_newest_is_the_one_of_most_steps_beyond_nine_digits(tmp_path: Path) -> None:
    for step in (999_999_999, 1_000_000_000):
        save(tmp_path, step)
    assert checkpoint.latest(tmp_path).name == "step_1000000000.checkpoint"


def test_none_there(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="nothing to resume from"):
        checkpoint.latest(tmp_path)


def test_a_state_that_is_no_number_is_not_kept(tmp_path: Path) -> None:
    spoiled = STATE["nodes.u"].copy()
    spoiled[7, 1] = np.nan
    with pytest.raises(RunStopped, match="'nodes.u' holds a number that is not finite, first in entry 7, at t = 1.25e-05 s"):
        save(tmp_path, state=STATE | {"nodes.u": spoiled})
    assert checkpoint.list_checkpoints(tmp_path) == []
    read = checkpoint.load(save(tmp_path, state=STATE | {"nodes.u": spoiled}, unset=None))  # of a run that failed
    assert np.isnan(read.state["nodes.u"][7, 1])


def edit(path: Path, **changes: object) -> None:
    """Rewrites the header and the sum, so that the file is whole and lies."""
    data = path.read_bytes()
    end = data.index(b"\n", len(checkpoint.MAGIC))
    header = json.loads(data[len(checkpoint.MAGIC) : end]) | changes
    data = checkpoint.MAGIC + json.dumps(header).encode() + data[end : -checkpoint.SUM]
    path.write_bytes(data + hashlib.sha256(data).digest())


def header_digit(path: Path) -> None:
    """Another time: one digit in the header."""
    path.write_bytes(path.read_bytes().replace(b"1.25e-05", b"1.35e-05"))


SPOILED = {
    "empty file": (lambda p: p.write_bytes(b""), "not a checkpoint"),
    "text": (lambda p: p.write_text("hello"), "not a checkpoint"),
    "zip": (lambda p: p.write_bytes(b"PK\x03\x04" + bytes(100)), "not a checkpoint"),
    "only the first line": (lambda p: p.write_bytes(checkpoint.MAGIC), "cut off in its header"),
    "half": (lambda p: p.write_bytes(p.read_bytes()[: p.stat().st_size // 2]), "cut off"),
    "last byte lost": (lambda p: p.write_bytes(p.read_bytes()[:-1]), "cut off"),
    "too long": (lambda p: p.write_bytes(p.read_bytes() + b"x"), "1 bytes too many"),
    "one bit": (lambda p: p.write_bytes(p.read_bytes()[:-3] + b"\xff" + p.read_bytes()[-2:]), "checksum"),
    "a digit of the time": (header_digit, "checksum"),
    "bad JSON": (lambda p: p.write_bytes(checkpoint.MAGIC + b"{oops\n"), "damaged header"),
    "deep JSON": (lambda p: p.write_bytes(checkpoint.MAGIC + b"[" * 200_000 + b"\n"), "damaged header"),
    "header a list": (lambda p: p.write_bytes(checkpoint.MAGIC + b"[1]\n"), "damaged header"),
    "newer version": (lambda p: edit(p, schema=99), "schema version 99"),
    "arrays missing": (lambda p: edit(p, arrays=[]), "too many"),
    "object arrays": (lambda p: edit(p, arrays=[["x", "|O", [3]]]), "unknown type"),
    "negative shape": (lambda p: edit(p, arrays=[["x", "<f8", [-3]]]), "negative length"),
    "a million million rows": (lambda p: edit(p, arrays=[["x", "<f8", [10**12]]]), "cut off"),
    "nonsense type": (lambda p: edit(p, arrays=[["x", "zz", [3]]]), "damaged header"),
    "time before the start": (lambda p: edit(p, time=-1.0), "time = -1"),
    "time without end": (lambda p: edit(p, time=float("inf")), "time = inf"),
    "negative step": (lambda p: edit(p, step=-1), "step = -1"),
    "half a step": (lambda p: edit(p, step=1.5), "damaged header"),
    "no dt": (lambda p: edit(p, dt=0.0), "dt = 0"),
    "NaN not announced": (lambda p: edit(p, not_finite=[]), "not finite in 'cells.rupture_time'"),
    "foreign scene": (lambda p: edit(p, scene_hash="other"), "another scene"),
    "missing": (lambda p: p.unlink(), "does not exist"),
    "folder": (lambda p: (p.unlink(), p.mkdir()), "cannot be read"),
    "link": (lambda p: p.replace(p.with_suffix(".kept")) and p.symlink_to(p.with_suffix(".kept")), "symbolic link"),
}


@pytest.mark.parametrize("name", SPOILED)
def test_spoiled_checkpoints_are_refused_with_a_sentence(tmp_path: Path, name: str) -> None:
    save(tmp_path, 5)
    path = save(tmp_path, 10)
    spoil, sentence = SPOILED[name]
    spoil(path)
    with pytest.raises(SceneError, match=sentence) as caught:
        checkpoint.load(path, "abc")
    assert "\n" not in str(caught.value)
    read, refused = checkpoint.newest_whole(tmp_path, "abc")  # the one before it is taken
    assert read.step == 5 and [p.name for p in refused] == ([path.name] if name != "missing" else [])


def test_where_none_is_whole_all_are_named(tmp_path: Path) -> None:
    for step in (5, 10):
        path = save(tmp_path, step)
        path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(
        SceneError, match="step_000000010.checkpoint' is cut off.*; nor .*: checkpoint .*step_000000005.checkpoint' is cut off"
    ):
        checkpoint.newest_whole(tmp_path, "abc")


def test_a_link_where_a_checkpoint_is_written_is_replaced_and_not_followed(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("mine")
    folder = tmp_path / "checkpoints"
    folder.mkdir()
    (folder / "step_000000010.checkpoint.tmp").symlink_to(precious)
    save(folder)
    assert precious.read_text() == "mine" and checkpoint.load(folder / "step_000000010.checkpoint").step == 10
    (tmp_path / "led").symlink_to(folder)
    with pytest.raises(SceneError, match="symbolic link"):
        save(tmp_path / "led")

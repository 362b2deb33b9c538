from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from taichi_sph.errors import SceneError
from taichi_sph.output import checkpoint

STATE = {
    "positions": np.random.default_rng(1).normal(size=(50, 3)),
    "broken": np.arange(40, dtype=np.int32),
    "time": np.array(1.25e-5),
    "empty": np.empty((0, 2), dtype=np.float32),
}


def save(folder: Path, step: int = 10, **options: object) -> Path:
    keywords = {"scene_hash": "abc", "time": 1.25e-5, "step": step, "state": STATE, "keep": 2, "extra": {"seconds": 3.5}}
    return checkpoint.save(folder, **(keywords | options))


def test_round_trip_bit_for_bit(tmp_path: Path) -> None:
    read = checkpoint.load(save(tmp_path), "abc")
    assert (read.time, read.step, read.extra) == (1.25e-5, 10, {"seconds": 3.5})
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


def test_none_there(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="nothing to resume from"):
        checkpoint.latest(tmp_path)


def edit(path: Path, **changes: object) -> None:
    """Rewrites the header only, so that it lies about the content."""
    data = path.read_bytes()
    end = data.index(b"\n", len(checkpoint.MAGIC))
    header = json.loads(data[len(checkpoint.MAGIC) : end]) | changes
    path.write_bytes(checkpoint.MAGIC + json.dumps(header).encode() + data[end:])


SPOILED = {
    "empty file": (lambda p: p.write_bytes(b""), "not a checkpoint"),
    "text": (lambda p: p.write_text("hello"), "not a checkpoint"),
    "zip": (lambda p: p.write_bytes(b"PK\x03\x04" + bytes(100)), "not a checkpoint"),
    "only the first line": (lambda p: p.write_bytes(checkpoint.MAGIC), "cut off in its header"),
    "half": (lambda p: p.write_bytes(p.read_bytes()[: p.stat().st_size // 2]), "cut off"),
    "last byte lost": (lambda p: p.write_bytes(p.read_bytes()[:-1]), "cut off"),
    "too long": (lambda p: p.write_bytes(p.read_bytes() + b"x"), "1 bytes too many"),
    "one bit": (lambda p: p.write_bytes(p.read_bytes()[:-3] + b"\xff" + p.read_bytes()[-2:]), "checksum"),
    "bad JSON": (lambda p: p.write_bytes(checkpoint.MAGIC + b"{oops\n"), "damaged header"),
    "header a list": (lambda p: p.write_bytes(checkpoint.MAGIC + b"[1]\n"), "damaged header"),
    "newer version": (lambda p: edit(p, schema=99), "schema version 99"),
    "no checksum": (lambda p: edit(p, checksum=""), "checksum"),
    "arrays missing": (lambda p: edit(p, arrays=[]), "too many"),
    "object arrays": (lambda p: edit(p, arrays=[["x", "|O", [3]]]), "unknown type"),
    "negative shape": (lambda p: edit(p, arrays=[["x", "<f8", [-3]]]), "cut off"),
    "nonsense type": (lambda p: edit(p, arrays=[["x", "zz", [3]]]), "damaged header"),
    "foreign scene": (lambda p: edit(p, scene_hash="other"), "another scene"),
    "missing": (lambda p: p.unlink(), "does not exist"),
    "folder": (lambda p: (p.unlink(), p.mkdir()), "cannot be read"),
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
    assert "step_000000005" in str(caught.value)  # says which older one is there

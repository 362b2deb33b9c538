"""The benchmark measures what runs: cells break on the way, and its bytes are those of fields that exist."""

import pytest

from taichi_sph.verification import bench


def test_measure(monkeypatch):
    monkeypatch.setattr(bench, "SECONDS", 0.3)
    r = bench.measure(4000, "cpu", None, "f64")
    assert r["nodes"] == pytest.approx(4000, rel=0.05)
    assert r["broken"] > 0 and r["steps"] > 10
    # per pair a coefficient and a number, forth and back; the rest is smaller
    pairs = 24 * r["pairs_per_node"]
    assert pairs < sum(r["bytes_per_node_step"].values()) < 1.7 * pairs
    assert r["best_node_steps_per_second"] >= r["node_steps_per_second"] > 0


def test_measure_metal(monkeypatch):
    monkeypatch.setattr(bench, "SECONDS", 0.3)
    r = bench.measure(1600, "cpu", None, "f64", metal=True)
    assert r["nodes"] == pytest.approx(1600, rel=0.06)
    assert r["yielding"] > 0.9 and r["broken"] > 0

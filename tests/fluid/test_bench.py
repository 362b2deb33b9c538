"""The benchmark of water measures what runs: lists wear out on the way, and its bytes are those of fields that exist."""

import pytest

from taichi_sph.verification import bench


def test_measure_fluid(monkeypatch):
    monkeypatch.setattr(bench, "SECONDS", 0.2)
    r = bench.measure_fluid(8000, "cpu", None, "f64")
    assert r["particles"] == 8000 and 50 < r["neighbours"] < 56
    assert r["steps"] > 5 and 2 < r["steps_per_list"] < 40
    pairs = 4 * (r["listed"] + 1)  # bytes: one number per neighbour listed
    assert pairs < r["bytes_per_particle_step"]["act"] < pairs + 350
    assert r["memory_per_particle"] == pytest.approx(850, rel=0.3)

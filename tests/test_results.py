"""What is recorded fits today's scenes, and RESULTS.md and README.md show it."""

from __future__ import annotations

from pathlib import Path

import pytest

from taichi_sph import cli
from taichi_sph.output import results

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.results


@pytest.fixture
def summaries(monkeypatch):
    monkeypatch.chdir(ROOT)
    return results.read_summaries()


def test_no_recorded_run_is_out_of_date(summaries):
    assert results.stale(summaries, cli._scene_of) == {}


def test_recorded_runs_come_from_clean_checkouts(summaries):
    for name, summary in summaries.items():
        assert summary["commit"] and not summary["commit"].endswith("+"), name


def test_results_and_readme_are_made_from_what_is_recorded(summaries):
    """If not: taichi-sph results --out RESULTS.md; taichi-sph results --out README.md"""
    assert (ROOT / "RESULTS.md").read_text(encoding="utf-8") == results.markdown(summaries.values())
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert readme == results.into(readme, results.overview(summaries.values()))


def test_pictures_are_small(summaries):
    pictures = [p for p in (ROOT / "renders").iterdir() if p.is_file()]
    assert pictures and all(p.stat().st_size < 300_000 for p in pictures)

"""Draft scenes have the bits that are recorded in golden.json; on another machine, its numbers. How to record: CONTRIBUTING.md."""

from __future__ import annotations

import pytest

from .golden import CASES, QUICK, computed, machine, recorded


@pytest.mark.parametrize("name", [pytest.param(name, marks=[] if name in QUICK else pytest.mark.long) for name in CASES])
def test_golden(name):
    found, again = computed(name, 1), computed(name, 2)
    assert found == again, "one and two threads differ"
    content = recorded()
    known = content["cases"][name]
    if content["machine"] == machine():
        changed = [key for key in ("bits", "ledger_bits") if found[key] != known[key]]
        assert not changed, f"{', '.join(changed)} moved; recorded {known['ledger']}, now {found['ledger']}"
        return
    near = CASES[name].near
    assert found["speed"] == pytest.approx(known["speed"], rel=near)
    energies = {key: value for key, value in known["ledger"].items() if not key.endswith("percent")}  # small differences of large numbers
    assert {key: found["ledger"][key] for key in energies} == pytest.approx(energies, rel=near, abs=near * max(map(abs, energies.values())))

"""What every field of a run is, as its pool was told: a row for each, and a page of Markdown."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable
from dataclasses import dataclass

from ..pool import Pool

HEAD = "| field | components | unit | meaning | kept | in frames |\n| --- | --- | --- | --- | --- | --- |\n"


@dataclass(frozen=True)
class Row:
    """One field. pool: its name without the number of the group; kept: a checkpoint holds it; shown: its name in frames, or empty."""

    pool: str
    about: str  # what the pool is: the first sentence of its class
    name: str
    components: int
    unit: str
    meaning: str
    kept: bool
    shown: str


def rows(pools: Iterable[Pool]) -> list[Row]:
    """A row for each field of the pools."""
    return [
        Row(
            re.sub(r"_\d+(?=\.|$)", "", pool.name),
            (inspect.getdoc(type(pool)) or "").partition("\n\n")[0].replace("\n", " "),
            name,
            getattr(entry.field, "n", 1),
            entry.unit,
            entry.doc,
            entry.keeps,
            entry.shown,
        )
        for pool in pools
        for name, entry in pool.fields.items()
    ]


def markdown(found: Iterable[Row]) -> str:
    """A table for each pool; fields of one name in several pools of one name are one row."""
    pools: dict[str, dict[str, Row]] = {}
    for row in found:
        pools.setdefault(row.pool, {}).setdefault(row.name, row)
    text = ""
    for pool, fields in sorted(pools.items()):
        about = next(iter(fields.values())).about
        text += f"\n## {pool}\n\n{about}\n\n{HEAD}"
        for row in fields.values():
            kept, shown = "yes" if row.kept else "", f"`{row.shown}`" if row.shown else ""
            cells = (f"`{row.name}`", str(row.components), row.unit, row.meaning, kept, shown)
            text += "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"
    return text

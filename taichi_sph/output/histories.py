"""Histories: one CSV per subject, one row per sample, units in the header ("time [s],kinetic [J]").

Numbers are written so that they read back bit for bit. Every row is flushed, so a killed run loses
at most the row it was writing, and the reader leaves out an unfinished last row.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import SceneError, nearest
from . import files

_HEADER = re.compile(r"^(?P<name>.*?)\s*\[(?P<unit>[^\]]*)\]$")


@dataclass(frozen=True)
class History:
    """Columns of one CSV: `columns[name]` is (n,), `units[name]` its unit ("-" when it has none)."""

    path: Path
    columns: dict[str, np.ndarray]
    units: dict[str, str]

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise SceneError(f"'{self.path.name}' has no column '{name}'{nearest(name, self.columns)}")
        return self.columns[name]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    @property
    def time(self) -> np.ndarray:
        return self["time"]


def _text(value: float) -> str:
    return repr(int(value)) if isinstance(value, (int, np.integer)) else repr(float(value))


def _header(units: Mapping[str, str]) -> str:
    return ",".join(f"{name} [{unit or '-'}]" for name, unit in units.items())


class HistoryWriter:
    """Appends rows to `path`. `units` gives the columns in order, "time" (s) first.

    `resume_at` None starts anew; a time [s] keeps the rows up to it.
    """

    def __init__(self, path: Path | str, units: Mapping[str, str], resume_at: float | None = None) -> None:
        if next(iter(units), None) != "time":
            raise ValueError("the first column of a history is time")
        self.path = Path(path)
        self.names = list(units)
        files.plain(self.path.parent)
        header = _header(units)
        if resume_at is not None and files.plain(self.path).exists():
            found = _text_of(self.path).partition("\n")[0]
            if found != header:
                raise SceneError(f"'{self.path}' holds other columns than this run writes: {_short(found)}")
            truncate(self.path, resume_at)
            self._file = files.append(self.path)
        else:
            self._file = files.begin(self.path)
            self._file.write(header + "\n")
        self._file.flush()

    def append(self, row: Mapping[str, float]) -> None:
        """One sample; exactly the columns of the header."""
        if row.keys() != set(self.names):
            raise ValueError(f"{self.path.name} has columns {self.names}, not {list(row)}")
        self._file.write(",".join(_text(row[name]) for name in self.names) + "\n")
        self._file.flush()

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> HistoryWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def write_history(path: Path | str, units: Mapping[str, str], columns: Mapping[str, np.ndarray]) -> Path:
    """A whole history at once (derived ones, such as the crack tip), put in place when complete."""
    path = Path(path)
    with files.whole(path) as file:
        file.write(_header(units) + "\n")
        for values in zip(*(columns[name] for name in units), strict=True):
            file.write(",".join(_text(v) for v in values) + "\n")
    return path


def _text_of(path: Path) -> str:
    """SceneError where there is none, or where it is no text."""
    try:
        return files.read_text(path)
    except FileNotFoundError:
        raise SceneError(f"there is no history '{path}'") from None
    except UnicodeDecodeError:
        raise SceneError(f"history '{path}' is not a text file") from None


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 100 else text[:97] + "..."


def truncate(path: Path | str, time: float) -> int:
    """Drops the rows later than `time` [s] and an unfinished last one; returns how many are left."""
    path = Path(path)
    lines = _text_of(path).splitlines(keepends=True)
    columns = lines[0].count(",") if lines else 0
    kept = lines[:1]
    for number, line in enumerate(lines[1:], start=2):
        if not line.endswith("\n"):
            break
        try:
            values = [float(value) for value in line.split(",")]
            if len(values) != columns + 1:
                raise ValueError
        except ValueError:
            raise SceneError(
                f"history '{path}', line {number}: not {columns + 1} numbers; what was lost there cannot be made again"
            ) from None
        if values[0] > time * (1 + 1e-12):
            break
        kept.append(line)
    with files.whole(path) as file:
        file.write("".join(kept))
    return len(kept) - 1


def read_history(path: Path | str) -> History:
    """Reads a CSV with units in its header; an unfinished last row is left out."""
    path = Path(path)
    text = _text_of(path)
    try:
        rows = list(csv.reader(text[: text.rfind("\n") + 1].splitlines()))
    except csv.Error as error:
        raise SceneError(f"history '{path}' is damaged ({error})") from None
    if not rows:
        raise SceneError(f"history '{path}' has no header")
    units: dict[str, str] = {}
    for title in rows[0]:
        match = _HEADER.match(title)
        if match is None:
            raise SceneError(f"history '{path}': column '{_short(title)}' has no unit; write 'name [unit]'")
        units[match["name"]] = match["unit"]
    values = np.empty((len(rows) - 1, len(units)))
    for number, row in enumerate(rows[1:], start=2):
        try:
            if len(row) != len(units):
                raise ValueError
            values[number - 2] = [float(v) for v in row]
        except ValueError:
            raise SceneError(f"history '{path}', line {number}: not {len(units)} numbers") from None
    return History(path, {name: values[:, i] for i, name in enumerate(units)}, units)

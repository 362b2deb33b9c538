"""What a run says while it works: a live line on a terminal, plain lines elsewhere, all of it in log.txt."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any, TextIO

from ..output import files
from ..scene.units import show

QUIET = 5.0  # s between plain lines, at least


def duration_text(seconds: float) -> str:
    """75 -> '1 min 15 s', 0.4 -> '0.4 s'."""
    if seconds < 10:
        return f"{seconds:.1f} s"
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def bytes_text(count: float) -> str:
    """1536000 -> '1.5 MB'."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"


class Progress:
    """Lines for people. `say` prints one; `update` replaces the last on a terminal, or waits its turn."""

    def __init__(self, stream: TextIO | None = None, terse: bool = False) -> None:
        """terse: what is said goes into the log only; the live line stays."""
        self.stream = stream or sys.stdout
        self.terse = terse
        self.live: Any = None
        self.terminal = self.stream.isatty()
        self._log: TextIO | None = None
        self._pending: list[str] = []  # said before there was a log
        self._last = -1e9

    def log_to(self, path: Path, append: bool = False) -> None:
        """From now on, and for what was said before, also into this file."""
        self._log = files.append(path) if append else files.begin(path)
        for line in self._pending:
            self._log.write(line + "\n")
        self._pending.clear()

    def say(self, text: str) -> None:
        self.note(text)
        if self.terse:
            return
        if self.live is not None:
            self.live.console.print(text, markup=False, highlight=False)
        else:
            print(text, file=self.stream, flush=True)

    def update(self, text: str, force: bool = False) -> None:
        """The state of the run, as often as it is known; shown as often as it is of use."""
        now = time.monotonic()
        if self.terminal:
            from rich.text import Text

            if self.live is None:
                from rich.console import Console
                from rich.live import Live

                self.live = Live(console=Console(file=self.stream), refresh_per_second=4, transient=True)
                self.live.start()
            self.live.update(Text(text))
        elif force or now - self._last >= QUIET:
            print(text, file=self.stream, flush=True)
        if force or now - self._last >= QUIET:
            self.note(text)
            self._last = now

    def close(self) -> None:
        if self.live is not None:
            self.live.stop()
            self.live = None
        if self._log is not None:
            self._log.close()
            self._log = None

    def note(self, text: str) -> None:
        """Into the log only."""
        if self._log is not None:
            self._log.write(text + "\n")
            self._log.flush()
        else:
            self._pending.append(text)


class Pace:
    """How long the rest of a run takes. The first steps load kernels and tell nothing about it: they are left out."""

    def __init__(self, duration: float) -> None:
        self.duration = duration
        self._from: tuple[float, float] | None = None  # s on the clock, and time of the scene

    def left(self, at: float) -> float | None:
        """Seconds to the end when the scene has come to the time `at`; None before a fiftieth of it was seen, or 20 s."""
        now = time.monotonic()
        if self._from is None:
            self._from = now, at
        spent, share = now - self._from[0], (at - self._from[1]) / max(self.duration - self._from[1], 1e-300)
        if share <= 0 or share >= 1 or (share < 0.02 and spent < 20):
            return None
        return spent * (1 / share - 1)


def progress_line(
    t: float, duration: float, dt: float, rule: str, eta: float | None, energies: dict[str, float], status: dict[str, Any]
) -> str:
    """'42 %  t 33.6 us  dt 104 ns (...)  energy error 0.012 %  37 broken  ETA 12 s'."""
    parts = [
        f"{min(100.0, 100 * t / duration):3.0f} %",
        f"t {show(t, 's')}",
        f"dt {show(dt, 's')} ({rule})",
        f"energy error {energies.get('closed_residual_percent', float('nan')):.2g} %",
        f"{status.get('broken', 0)} broken",
    ]
    for name, found in status.items():  # '28 newton steps', but 'residual 3.4e-06'
        if name != "broken" and found:
            words = name.replace("_", " ")
            parts.append(f"{words} {found:.3g}" if isinstance(found, float) else f"{found} {words}")
    if eta is not None:
        parts.append(f"ETA {duration_text(eta)}")
    return "  ".join(parts)

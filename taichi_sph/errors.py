"""Every error that a user can meet, with its exit code. The message is one sentence.

A sentence says which key of the scene, option or file is meant, the bad value, what is allowed
and, where names are concerned, the nearest valid one.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class TaichiSphError(Exception):
    """Base: something this package has to say, in one sentence."""

    exit_code = 1

    def __init__(self, sentence: object = ""):
        """A line break, or another sign that is not printed, is written as in a text of Python: it may come from the user."""
        super().__init__("".join(c if c.isprintable() else repr(c)[1:-1] for c in str(sentence)))


class SceneError(TaichiSphError):
    """A scene, mesh, checkpoint or option that cannot be used; nothing was written."""

    exit_code = 2


class RunStopped(TaichiSphError):
    """The watchdog stopped the run: body, particle, place, time, field, likely cause. goes_on: the state is sound, and with other settings
    a resume may go on from it."""

    exit_code = 3

    def __init__(self, sentence: object = "", goes_on: bool = False):
        super().__init__(sentence)
        self.goes_on = goes_on


class RunInterrupted(TaichiSphError):
    """Ctrl-C or SIGTERM: the state was saved first."""

    exit_code = 130


def nearest(name: str, valid: Iterable[str]) -> str:
    """The end of a sentence that offers a valid name: '; did you mean x?' or '; valid: a, b, c'."""
    names = [str(v) for v in valid]
    if not names:
        return "; there are none"
    lower = {n.lower(): n for n in reversed(names)}
    match = difflib.get_close_matches(str(name).lower(), lower, n=1, cutoff=0.6)
    if match:
        return f"; did you mean '{lower[match[0]]}'?"
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"; valid: {shown}"

"""How a load varies in time."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from .base import Choice, Frozen
from .units import Time


class Step(Frozen):
    """Full value from t = 0 on."""

    kind: Literal["step"] = "step"


class Ramp(Frozen):
    """Grows linearly from 0 to the full value at `rise`, then stays (T 2.111)."""

    kind: Literal["ramp"] = "ramp"
    rise: Annotated[Time, Field(gt=0)]


History = Annotated[Step | Ramp, *Choice]

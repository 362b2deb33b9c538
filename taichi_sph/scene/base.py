"""What every part of a scene is made of."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from .units import Length

Point = tuple[Length, Length, Length]


class Frozen(BaseModel):
    """Base of every scene part: immutable, unknown keys refused, finite numbers only."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)


def _kind(value: Any) -> Any:
    """A part that is chosen by its kind may be given by that name alone, with its defaults."""
    return {"kind": value} if isinstance(value, str) else value


Choice = (Field(discriminator="kind"), BeforeValidator(_kind))

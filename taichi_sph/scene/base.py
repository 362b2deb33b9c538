"""What every part of a scene is made of."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from .units import Dimensionless, Length

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)]  # names become file names
Quality = Literal["draft", "standard", "paper"]
Point = tuple[Length, Length, Length]


def _short_and_long(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    """The square of its length is a number, and not 0 unless it is (0, 0, 0), of which its owner speaks."""
    if any(direction) and not 1e-100 <= max(map(abs, direction)) <= 1e100:
        raise ValueError("is no direction: its largest number is outside 1e-100 to 1e100")
    return direction


Direction = Annotated[tuple[Dimensionless, Dimensionless, Dimensionless], AfterValidator(_short_and_long)]  # of any length


class Frozen(BaseModel):
    """Base of every scene part: immutable, unknown keys refused, finite numbers only."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)


class Body(Frozen):
    """What every body has. A kind of body adds its keys, and its checks against the rest of the scene.

    `bears`: the keys of a scene whose entries may name such a body ("forces", "probes", ...). `meets`: whether other bodies can touch it.
    """

    bears: ClassVar[frozenset[str]] = frozenset()
    what: ClassVar[str] = "body"  # the kind in words
    holds_springs: ClassVar[bool] = False  # whether a spring can end on it
    has_nodes: ClassVar[bool] = False  # whether it is made of nodes, among which a spring's radius chooses
    bounces: ClassVar[bool] = True  # whether a restitution may be said of its meetings
    soft: ClassVar[bool] = False  # whether it is a filling: two of them part by themselves, without contact
    name: Name

    @property
    def meets(self) -> bool:
        return True

    def sizes(self) -> tuple[int, float, float]:
        """Points, mass [kg] and longest step [s] of a body, before it is built: what an estimate takes of a kind that it does not know."""
        return 1, 0.0, math.inf

    def places(self) -> np.ndarray | None:
        """(N, 3) points at t = 0 [m] among which the regions of loads choose; None of a body that gets its points from a mesh."""
        return None

    def check(self, scene: Any) -> None:
        """ValueError with a sentence that starts with the key, where the body does not fit the rest of the scene."""


def _kind(value: Any) -> Any:
    """A part that is chosen by its kind may be given by that name alone, with its defaults."""
    return {"kind": value} if isinstance(value, str) else value


Choice = (Field(discriminator="kind"), BeforeValidator(_kind))

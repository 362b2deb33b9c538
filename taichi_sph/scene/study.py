"""A study: several scenes that are run one after the other and judged together."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StrictBool, StrictInt, model_validator

from ..errors import nearest
from .base import Frozen, Name
from .schema import Scene


class Convergence(Frozen):
    """Order of convergence of a quantity to its target: the slope of log |value - target| over log spacing through
    the named cases, at least `least`. The study shows it as `order_<name>`."""

    name: Name
    quantity: str
    cases: Annotated[tuple[Name, ...], Field(min_length=2)]
    least: float | None = None
    source: str = ""


class Study(Frozen):
    """What a scene script may return instead of a Scene. `cases`: short name, which becomes a folder, -> Scene.

    Each case carries its own quantities; the study shows them as `<quantity>_<case>`. Give the cases titles that
    end in what tells them apart: the comparison picture writes it over each.
    """

    name: Name
    title: str
    source: str
    quality: Literal["draft", "standard", "paper", "custom"] = "custom"
    parameters: dict[str, StrictBool | StrictInt | float | str] = {}
    cases: dict[Name, Scene] = Field(min_length=1)
    orders: tuple[Convergence, ...] = ()

    @model_validator(mode="after")
    def _folders_differ(self) -> Study:
        small = [name.lower() for name in self.cases]  # some disks do not tell A from a
        for name in self.cases:
            if small.count(name.lower()) > 1:
                raise ValueError(f"cases: '{name}' and another case differ in upper and lower case only")
            if name.lower() in ("pictures", "study.json", "summary.json"):
                raise ValueError(f"cases: '{name}' is the name of something else in the folder of a study")
        for number, order in enumerate(self.orders):
            for case in order.cases:
                if case not in self.cases:
                    raise ValueError(f"orders[{number}].cases: there is no case '{case}'{nearest(case, self.cases)}")
                if order.quantity not in [q.name for q in self.cases[case].quantities if q.value is not None]:
                    raise ValueError(f"orders[{number}]: case '{case}' has no target for '{order.quantity}'")
        return self

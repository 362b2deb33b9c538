"""Which kinds of bodies and of couplings there are: every folder whose said.py declares one, and what was registered."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from pkgutil import iter_modules
from typing import Any

from .base import Frozen


@dataclass(frozen=True)
class Kind:
    """One kind. `key`: where a scene says it ("shells"; "others" and "interactions" hold all kinds without a key of their own, by
    their `kind`). `made`: the function that makes what computes it, or "module:function" where that is loaded when needed: of bodies
    made(scene, groups so far, own) -> groups, of couplings made(scene, groups, own) -> couplings; own: what the scene says of this kind.
    `rank`: kinds are made in this order.
    """

    name: str
    key: str
    said: type[Frozen] | None
    made: Any
    rank: int = 9

    def own(self, scene: Any) -> tuple[Any, ...]:
        """What a scene says of this kind, in its order."""
        said = getattr(scene, self.key) if self.key else ()
        return tuple(one for one in said if type(one) is self.said and getattr(one, "kind", self.name) == self.name)

    def make(self, scene: Any, groups: Any) -> list[Any]:
        """The groups of bodies, or the couplings, of this kind in a scene."""
        made = self.made
        if isinstance(made, str):
            module, _, name = made.partition(":")
            made = getattr(import_module(module), name)
        return made(scene, groups, self.own(scene))


class Kinds:
    """The kinds of one package: `KIND` of the said.py of each of its folders, and the registered ones."""

    def __init__(self, package: str) -> None:
        self.package = package
        self.registered: list[Kind] = []

    @cached_property
    def found(self) -> tuple[Kind, ...]:
        kinds: list[Kind] = []
        for folder in iter_modules(import_module(self.package).__path__):
            name = f"{self.package}.{folder.name}.said"
            if not folder.ispkg or find_spec(name) is None:
                continue
            if (kind := getattr(import_module(name), "KIND", None)) is not None:  # a folder that kinds share has none
                kinds.append(kind)
        return tuple(sorted(kinds, key=lambda kind: kind.rank))

    def __call__(self, key: str | None = None) -> tuple[Kind, ...]:
        """All of them, or those of one key."""
        return tuple(kind for kind in (*self.found, *self.registered) if key is None or kind.key == key)

    def register(self, kind: Kind) -> None:
        """Adds a kind at run time; one of the same name is replaced."""
        if kind.name in [k.name for k in self.found]:
            raise ValueError(f"the kind '{kind.name}' is one of {self.package} already")
        self.registered = [k for k in self.registered if k.name != kind.name] + [kind]

"""One clear sentence out of a pydantic ValidationError: key path, bad value, what is allowed, nearest name."""

from __future__ import annotations

import re
import types
from collections.abc import Callable
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from ..errors import SceneError, nearest
from .missing import key_said, kind_said
from .units import Unit

T = TypeVar("T")

# error type of pydantic -> what is wrong, with the context of the error filled in
_SAID = {
    "greater_than": "must be greater than {gt}{unit}",
    "greater_than_equal": "must be at least {ge}{unit}",
    "less_than": "must be less than {lt}{unit}",
    "less_than_equal": "must be at most {le}{unit}",
    "finite_number": "must be a finite number",
    "float_type": "is not a number",
    "float_parsing": "is not a number",
    "int_type": "is not a whole number",
    "int_from_float": "is not a whole number",
    "int_parsing": "is not a whole number",
    "bool_type": "is neither true nor false",
    "bool_parsing": "is neither true nor false",
    "string_type": "is not a text",
    "string_pattern_mismatch": "may hold only letters, digits, '_', '-' and '.' (it becomes a file name)",
    "string_too_long": "is longer than {max_length} characters",
    "path_type": "is not a path",
    "dict_type": "is not a table of keys and values",
    "tuple_type": "is not a list",
    "missing": "is missing",
    "frozen_instance": "cannot be changed: a scene is frozen; derive a new one",
    "json_invalid": "is not valid JSON: {error}",
}


def sentence(error: ValidationError, model: type | None = None) -> str:
    """The first error in full, and how many more there are. `model` is the type that was validated."""
    problems = error.errors(include_url=False)
    first = min(
        problems, key=lambda p: (p["type"] != "extra_forbidden", p["loc"][:1] == ("parameters",))
    )  # a misspelt key explains a missing one
    loc, annotations = _readable(first["loc"], model)
    text = _one(first, loc, annotations)
    if first["type"].startswith("bool_"):  # of a switch that knows words as well
        also = [p for p in problems if p["type"] == "literal_error" and p["loc"][:-1] == first["loc"][:-1]]
        problems = [p for p in problems if p not in also]
        text += "".join(f", nor '{name}'" for p in also for name in _names(p["ctx"]["expected"]))
    others = dict.fromkeys(_path(_readable(p["loc"], model)[0]) or "?" for p in problems if p is not first)
    others.pop(_path(loc), None)  # each member of a union complains
    if others:
        more, keys = len(others), list(others)[:3]
        text += f" ({more} more error{'s' if more > 1 else ''}, in {', '.join(keys)}{', ...' if more > 3 else ''})"
    return shortened(text)


def shortened(text: str) -> str:
    """A sentence without names of thousands of letters."""
    return re.sub(r"'[^']{120,}'|[^\s']{120,}", lambda long: long[0][:60] + "..." + long[0][-1], text)


def checked(model: type[T], build: Callable[[], T], prefix: str = "") -> T:
    """build(), with its ValidationError turned into a SceneError."""
    try:
        return build()
    except ValidationError as error:
        raise SceneError(prefix + sentence(error, model)) from None


def _one(problem: Any, loc: list[str], annotations: list[Any]) -> str:
    kind, value, context = problem["type"], problem["input"], problem.get("ctx", {})
    key = _path(loc)
    if kind == "value_error":
        said = str(context["error"])
        if said.startswith(("is ", "has ", "divides ")):  # said by a unit about its value
            return f"{key} = {_shown(value)} {said}"
        owner = _model(annotations[-1] if annotations else None)
        is_key = owner is not None and re.split(r"\W", said, maxsplit=1)[0] in owner.model_fields
        return f"{key}{'.' if is_key else ': '}{said}" if key else said
    if kind == "extra_forbidden":
        owner = _model(annotations[-2] if len(annotations) > 1 else None)
        if said := key_said(owner, loc[-1]):
            return f"{key}{':' if said.startswith('not') else ''} {said}"
        where = f" in {_path(loc[:-1])}" if loc[:-1] else ""
        return f"unknown key '{loc[-1]}'{where}{nearest(loc[-1], owner.model_fields if owner else ())}"
    if kind in ("literal_error", "union_tag_invalid"):
        names = _names(context.get("expected") or context.get("expected_tags", ""))
        if kind == "union_tag_invalid":
            key, value = f"{key}.kind", context.get("tag")
            if said := kind_said(str(value), names):
                return f"{key} = {_shown(value)}: {said}"
        return f"{key} = {_shown(value)} is not allowed{nearest(str(value), names)}"
    if kind == "union_tag_not_found":
        return f"{key} needs a 'kind'{_kinds(annotations[-1] if annotations else None)}"
    if kind in ("model_type", "model_attributes_type", "dataclass_type"):
        return f"{key or 'the scene'} = {_shown(value)} is not a {context.get('class_name', 'table')}"
    if kind in ("too_short", "too_long"):
        need = context.get("min_length", context.get("max_length"))
        asked = f"at least {need} needed" if kind == "too_short" else f"at most {need} are allowed"
        return f"{key} holds {context.get('actual_length')} entries; {asked}"
    if kind == "missing":
        return f"{key} is missing" if not loc[-1].startswith("[") else f"{_path(loc[:-1])} lacks its entry {loc[-1]}"
    template = _SAID.get(kind)
    if template is None:
        return f"{key} = {_shown(value)}: {problem['msg']}"
    unit = _unit(annotations[-1] if annotations else None)
    said = template.format(**context, unit=f" {unit}" if unit else "")
    if kind == "json_invalid":
        return f"the file {said}"
    return f"{key} = {_shown(value)}{f' {unit}' if unit and not isinstance(value, str) else ''} {said}"


def _shown(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _path(loc: list[str]) -> str:
    path = ""
    for part in loc:
        path += part if part.startswith("[") or not path else f".{part}"
    return path


def _names(expected: str) -> list[str]:
    return [part.strip().strip("'") for part in expected.replace(" or ", ", ").split(",") if part.strip()]


def _readable(loc: tuple[int | str, ...], model: Any) -> tuple[list[str], list[Any]]:
    """The location without the tags that unions put into it, and the annotation at each of its parts."""
    path: list[str] = []
    kinds: list[Any] = []
    here: Any = model
    for part in loc:
        if isinstance(part, int):
            here = _item(here, part)
            path.append(f"[{part}]")
            kinds.append(here)
            continue
        chosen = _choose(here, part)
        if chosen is not None:  # a tag, not a key
            here = chosen
            if kinds:
                kinds[-1] = chosen
            continue
        owner = _model(here)
        if owner is None and here is not None and get_origin(_bare(here)) is not dict:
            continue  # the name of a member of a plain union, such as 'float' in Length | None
        field = owner.model_fields.get(part) if owner else None
        if field is None:
            here = _bare(get_args(_bare(here))[1]) if get_origin(_bare(here)) is dict else None
        else:
            here = Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
        path.append(part)
        kinds.append(here)
    return path, [model, *kinds]


def _bare(kind: Any) -> Any:
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def _members(kind: Any) -> tuple[Any, ...]:
    kind = _bare(kind)
    if get_origin(kind) not in (Union, types.UnionType):
        return (kind,)
    inner = ((m,) if get_origin(_bare(m)) not in (Union, types.UnionType) else _members(m) for m in get_args(kind))
    return tuple(m for members in inner for m in members)


def _model(kind: Any) -> type[BaseModel] | None:
    found = [m for m in map(_bare, _members(kind)) if isinstance(m, type) and issubclass(m, BaseModel)]
    return found[0] if len(found) == 1 else None


def _choose(kind: Any, tag: str) -> Any:
    """The member of a union of models with that `kind`."""
    members = [m for m in map(_bare, _members(kind)) if isinstance(m, type) and issubclass(m, BaseModel)]
    if len(members) < 2:
        return None
    return next((m for m in members if "kind" in m.model_fields and m.model_fields["kind"].default == tag), None)


def _kinds(kind: Any) -> str:
    members = [m for m in map(_bare, _members(kind)) if isinstance(m, type) and issubclass(m, BaseModel)]
    tags = [f"'{m.model_fields['kind'].default}'" for m in members if "kind" in m.model_fields]
    return f": one of {', '.join(tags)}" if tags else ""


def _item(kind: Any, index: int) -> Any:
    lists = [bare for member in _members(kind) if get_origin(bare := _bare(member)) in (tuple, list)]
    arguments = get_args(lists[0] if lists else _bare(kind))
    if not arguments:
        return None
    return arguments[0] if len(arguments) == 1 or arguments[1] is Ellipsis else arguments[min(index, len(arguments) - 1)]


def _unit(kind: Any) -> str:
    for member in (kind, *_members(kind)):
        if get_origin(member) is Annotated:
            for mark in get_args(member)[1:]:
                if isinstance(mark, Unit):
                    return mark.symbol
            inner = _unit(get_args(member)[0])
            if inner:
                return inner
    return ""

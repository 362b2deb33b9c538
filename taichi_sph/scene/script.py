"""Scene scripts: load, vary, derive, and turn into JSON and back.

A script is a Python file with a function `scene(quality="draft", a=10.0, ...)` that returns a Scene, or a Study
of several. The typed parameters of that function are its options (`--set a=8`); dotted keys reach any other
part of the scene, or of every scene of a study (`--set numerics.spacing=1mm`). A JSON file holds one scene
or one study, as the record of a run does.
"""

from __future__ import annotations

import contextlib
import gc
import inspect
import json
import sys
import types
import typing
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import TypeAdapter, ValidationError
from pydantic_core import from_json

from .. import scene as vocabulary
from ..errors import SceneError, TaichiSphError, nearest
from .check import sentence
from .schema import Scene
from .study import Study
from .surfaces import MeshFile

SceneFunction = Callable[..., Scene | Study]
JSON_BYTES = 256_000_000  # the largest JSON file that is read


def load_scene(source: Path | str | SceneFunction, settings: Mapping[str, Any] | None = None) -> Scene:
    """`load`, of what must be a single scene."""
    found = load(source, settings)
    if isinstance(found, Study):
        raise SceneError(f"'{found.name}' is a study of {len(found.cases)} scenes; a single scene is needed here")
    return found


def load(source: Path | str | SceneFunction, settings: Mapping[str, Any] | None = None) -> Scene | Study:
    """The scene or study of a script, a JSON file or a scene function, with `settings` applied.

    Parameters of the scene function go to it; other keys of a scene ("numerics.spacing") to `derive`.
    Values may be texts, as they come from a command line.
    """
    settings = dict(settings or {})
    if callable(source):
        folder = Path(inspect.getfile(source)).resolve().parent
        scene, rest = _call(source, settings, Path(inspect.getfile(source)).name)
    else:
        path = Path(source)
        folder = path.resolve().parent
        if not path.is_file():
            raise SceneError(f"there is no scene file '{path}'")
        if path.suffix == ".py":
            scene, rest = _call(_function(path), settings, path.name)
        elif path.suffix == ".json":
            scene, rest = _from_json(path), settings
        else:
            raise SceneError(f"'{path}' is not a scene: a scene is a .py script or a .json file")
    changes = {key: _literal(value) for key, value in rest.items()}
    if isinstance(scene, Study):
        cases = {
            name: derive(_anchored(case, folder), **changes) if changes else _anchored(case, folder) for name, case in scene.cases.items()
        }
        return scene.model_copy(update={"cases": cases, "parameters": {**scene.parameters, **_recorded(changes)}})
    scene = _anchored(scene, folder)
    return derive(scene, **changes) if changes else scene


def parameters_of(source: Path | str | SceneFunction) -> dict[str, inspect.Parameter]:
    """The parameters of a scene function, with their types resolved."""
    function = source if callable(source) else _function(Path(source))
    hints = typing.get_type_hints(function, include_extras=True)
    return {n: p.replace(annotation=hints.get(n, str)) for n, p in inspect.signature(function).parameters.items()}


def derive(scene: Scene, **changes: Any) -> Scene:
    """A new scene with some keys changed: derive(s, **{"numerics.spacing": "1 mm", "duration": 8e-5}).

    List entries go by number or by name ("shells.plate.thickness"). A new spacing makes the quality "custom".
    """
    data = scene.model_dump(mode="json")
    for key, value in changes.items():
        _set(data, key, value)
    if "numerics.spacing" in changes and "quality" not in changes:
        data["quality"] = "custom"
    data["parameters"] = {**data["parameters"], **_recorded(changes)}
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        raise SceneError(sentence(error, Scene)) from None


def value_at(scene: Scene | Study, key: str) -> Any:
    """The value of a dotted key, of a study that of its first scene; SceneError with the nearest name where there is none."""
    first = next(iter(scene.cases.values())) if isinstance(scene, Study) else scene
    value, path = first.model_dump(mode="json"), ""
    for part in key.split("."):
        value = value[_index(value, part, path)]
        path = f"{path}.{part}" if path else part
    return value


def _recorded(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Those of some changes that are plain values, but for words that change nothing."""
    return {k: v for k, v in changes.items() if isinstance(v, (bool, int, float, str)) and k not in ("title", "quality")}


def dump(scene: Scene | Study) -> str:
    """The scene as JSON, numbers in SI; `load` reads it back equal."""
    return scene.model_dump_json(indent=2) + "\n"


def _from_json(path: Path) -> Scene | Study:
    try:
        if (size := path.stat().st_size) > JSON_BYTES:
            raise SceneError(f"'{path}' holds {size / 1e6:.3g} MB; at most {JSON_BYTES / 1e6:.3g} MB are read of a scene")
        text = path.read_bytes()
    except OSError as error:
        raise SceneError(f"'{path}' cannot be read: {error.strerror}") from None
    kind = _kind(path, text)
    try:
        with _uncollected():
            return kind.model_validate_json(text)
    except ValidationError as error:
        raise SceneError(f"{path.name}: {sentence(error, kind)}") from None


def _kind(path: Path, text: bytes) -> type[Scene | Study]:
    """Which of the two a text of JSON spells; a text that is none is judged as a scene."""
    try:
        content = from_json(text)
    except ValueError as error:
        if "recursion" in str(error):
            raise SceneError(f"{path.name}: its brackets are nested too deeply for a scene") from None
        return Scene
    return Study if isinstance(content, dict) and "cases" in content else Scene


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Without the collector of garbage, which would look at a million new values again and again; none of them is garbage."""
    there = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if there:
            gc.enable()


@contextlib.contextmanager
def _beside(path: Path) -> Iterator[None]:
    """While a script is read it finds the modules of its folder, as if Python ran it; each script those of its own."""
    folder = path.resolve().parent
    before = set(sys.modules)
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        for name in set(sys.modules) - before:
            found = getattr(sys.modules[name], "__file__", None)
            if found and Path(found).parent == folder:
                del sys.modules[name]


def _function(path: Path) -> SceneFunction:
    """Runs a script under another name than __main__ and returns its `scene` function."""
    if not path.is_file():
        raise SceneError(f"there is no scene file '{path}'")
    module = types.ModuleType(f"taichi_sph_scene_{path.stem}")
    module.__file__ = str(path.resolve())
    sys.modules[module.__name__] = module  # where get_type_hints looks names up
    try:
        with _beside(path):
            exec(compile(path.read_bytes(), str(path), "exec"), module.__dict__)
    except ValidationError as error:
        raise SceneError(_in_script(error, path)) from None
    except TaichiSphError:
        raise
    except SyntaxError as error:
        raise SceneError(f"{path.name} line {error.lineno}: it is not valid Python ({error.msg})") from None
    except Exception as error:
        raise SceneError(f"{_line(error, path)}: {type(error).__name__}: {error}") from None
    except SystemExit as error:
        raise SceneError(f"{_line(error, path)}: it ended the program") from None
    function = module.__dict__.get("scene")
    if not callable(function):
        raise SceneError(f"{path.name} has no function 'scene': a scene script defines scene(...) and returns a Scene")
    return function


def _call(function: SceneFunction, settings: Mapping[str, Any], name: str) -> tuple[Scene | Study, dict[str, Any]]:
    """The scene that the function makes, and the settings that are none of its parameters."""
    parameters = parameters_of(function)
    values: dict[str, Any] = {}
    rest: dict[str, Any] = {}
    for key, value in settings.items():
        if key in parameters:
            values[key] = _typed(key, value, parameters[key].annotation)
        elif "." in key or key in ("duration", "title"):
            rest[key] = value
        else:
            raise SceneError(f"unknown option '{key}' of {name}{nearest(key, parameters)}")
    for key, parameter in parameters.items():
        if key not in values and parameter.default is parameter.empty:
            raise SceneError(f"option '{key}' of {name} has no default: give --set {key}=...")
        if key not in values:
            values[key] = _typed(key, parameter.default, parameter.annotation)
    try:
        scene = function(**values)
    except ValidationError as error:
        raise SceneError(_in_script(error, Path(name))) from None
    except TaichiSphError:
        raise
    except Exception as error:
        raise SceneError(f"{_line(error, Path(name))}: {type(error).__name__}: {error}") from None
    if not isinstance(scene, Scene | Study):
        raise SceneError(f"{name}: scene(...) returned {type(scene).__name__}, not a Scene")
    recorded = {key: value for key, value in values.items() if key != "quality" and value is not None}
    # the parameters are what the script was called with, whatever it wrote there itself
    update = {"parameters": recorded, "quality": values.get("quality", scene.quality)}
    try:
        return type(scene).model_validate({**scene.model_dump(), **update}), rest
    except ValidationError as error:
        raise SceneError(f"{name}: {sentence(error, type(scene))}") from None


def _typed(key: str, value: Any, kind: Any) -> Any:
    """`value` (perhaps a text) as the parameter's type, or a sentence."""
    if isinstance(value, str) and kind is not str:
        value = _text(value, kind)
    try:
        return TypeAdapter(kind).validate_python(value, strict=kind in (int, bool) or None)
    except ValidationError as error:
        said = sentence(error, kind)
        raise SceneError(f"option {key}{said if said.startswith(' ') else ': ' + said}") from None


def _text(value: str, kind: Any) -> Any:
    if kind is bool:
        return {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}.get(value.lower(), value)
    if get_origin(kind) is Literal:
        return next((option for option in get_args(kind) if str(option) == value), value)
    return _literal(value)


def _literal(value: Any) -> Any:
    """A text of the command line as the number, truth value, null or list that it spells, else itself."""
    if not isinstance(value, str | bytes):
        return value
    try:
        return json.loads(value)
    except ValueError:
        return value


def _set(data: Any, key: str, value: Any) -> None:
    *parents, last = key.split(".")
    path = ""
    for part in parents:
        data = data[_index(data, part, path)]
        path = f"{path}.{part}" if path else part
    last = _index(data, last, path)
    if isinstance(data, dict) and isinstance(data[last], dict) and isinstance(value, dict):
        value = {**data[last], **value} if value.get("kind", data[last].get("kind")) == data[last].get("kind") else value
    data[last] = value


def _index(data: Any, part: str, path: str) -> Any:
    """The key, number or name `part` in a table or list of the scene."""
    where = f" in {path}" if path else ""
    if isinstance(data, dict):
        if part in data:
            return part
        raise SceneError(f"unknown key '{part}'{where}{nearest(part, data)}")
    if isinstance(data, (list, tuple)):
        names = [str(entry.get("name", i)) if isinstance(entry, dict) else str(i) for i, entry in enumerate(data)]
        if part in names:
            return names.index(part)
        if part.isdigit() and int(part) < len(data):
            return int(part)
        raise SceneError(f"there is no entry '{part}'{where}{nearest(part, names)}")
    raise SceneError(f"'{path}' is a single value: it has no key '{part}'")


def _anchored(scene: Scene, folder: Path) -> Scene:
    """Mesh paths are meant from the folder of the script."""
    changed = {}
    for bodies, key in (("shells", "surface"), ("rigids", "surface"), ("solids", "shape")):
        said = getattr(scene, bodies)
        files = [isinstance(getattr(body, key), MeshFile) and not getattr(body, key).path.is_absolute() for body in said]
        if any(files):
            changed[bodies] = tuple(_found(body, key, folder) if is_file else body for body, is_file in zip(said, files))
    return scene.model_copy(update=changed) if changed else scene


def _found(body: Any, key: str, folder: Path) -> Any:
    """The body with the path of its mesh from that folder."""
    file = getattr(body, key)
    return body.model_copy(update={key: file.model_copy(update={"path": folder / file.path})})


def _in_script(error: ValidationError, path: Path) -> str:
    """Where in the script, which part, and what is wrong with it."""
    return f"{_line(error, path)}: {error.title}: {sentence(error, getattr(vocabulary, error.title, None))}"


def _line(error: BaseException, path: Path) -> str:
    """'name line n': the deepest line of the script that the error passed through."""
    line, trace = None, error.__traceback__
    while trace is not None:
        if Path(trace.tb_frame.f_code.co_filename).name == path.name:
            line = trace.tb_lineno
        trace = trace.tb_next
    return f"{path.name} line {line}" if line else path.name

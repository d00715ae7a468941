"""What is simulated and filmed: the scene file, read once and checked before anything runs.

A scene is a TOML file. Unknown keys, wrong types and impossible values end in one `SceneError`
that names the file, the key, the value and what to write instead.
"""

import difflib
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import PrivateAttr, ValidationError

from solver import formula, scene_body, scene_physics, scene_render, schema
from solver.scene_body import Body, Obstacle
from solver.scene_physics import (FACES, Detonation, Domain, Fluid, Fuel, Initial, MovingWall,
                                  Output, Soot, Time)
from solver.scene_render import Render
from solver.schema import Section, parameter

COORDINATES = ("x", "y", "z", "pi")
PATHS = ("mesh", "image")   # keys whose text may be the path of a file
LONGEST_MESSAGE = 600


class SceneError(Exception):
    """A scene that cannot be run; the message is one line, whatever the scene holds."""

    def __init__(self, message: str):
        line = "".join(letter if letter.isprintable() else " " for letter in message)
        super().__init__(line if len(line) <= LONGEST_MESSAGE else line[:LONGEST_MESSAGE] + " ...")


class Scene(Section):
    """A whole scene file."""

    title: str = parameter("", "shown in logs and files")
    seed: int = parameter(1, "of every random number; one stream per purpose", "", ge=0, lt=2**63)
    domain: Domain = parameter(Domain(), "the box")
    time: Time = parameter(..., "steps and frames")
    fluid: Fluid = parameter(Fluid(), "the flow")
    initial: Initial = parameter(Initial(), "state at the start")
    detonation: Detonation = parameter(Detonation(), "where the fuel starts")
    fuel: Fuel | None = parameter(None, "burning particles; absent: no fire")
    soot: Soot | None = parameter(None, "soot particles; absent: none are made")
    body: tuple[Body, ...] = parameter((), "bodies")
    obstacle: tuple[Obstacle, ...] = parameter((), "planes on which pieces bounce, slide and rest")
    output: Output = parameter(Output(), "snapshots")
    render: Render | None = parameter(None, "the picture; absent: not filmed")
    _path: Path = PrivateAttr(default=Path("scene.toml"))

    @property
    def path(self) -> Path:
        """The file it was read from; relative paths in the scene start at its folder."""
        return self._path

    @property
    def has_temperature(self) -> bool:
        """Whether anything can change the temperature or depends on it."""
        return self.fuel is not None or self.initial.T != "" or self.fluid.buoyancy > 0

    @property
    def is_closed(self) -> bool:
        """Whether no face of the box is open: then all expansion must be taken up inside."""
        return not any(self.domain.face(name) == "open" for name in FACES)


def load(path: str | Path, overrides: Sequence[str] = ()) -> Scene:
    """Read, override (`key.sub=value`, TOML values) and check a scene; raises `SceneError`."""
    path = Path(path)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SceneError(f"{path}: no such scene file; fix: give the path of a .toml "
                         "file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"{path}: cannot be read as a text file ({error}); fix: give a TOML "
                         "file") from None
    except (ValueError, RecursionError) as error:   # also: brackets or digits without end
        raise SceneError(f"{path}: not valid TOML: {error}; fix: correct that line") from None
    for override in overrides:
        apply_override(data, override)
    return build(data, path)


def save(scene: Scene, path: Path) -> None:
    """Write the scene as it was run: every parameter, overrides included, files by full path."""
    data = scene.model_dump(exclude_none=True)
    path.write_text(tomli_w.dumps(_with_full_paths(data, scene.path.parent)), encoding="utf-8")


def _with_full_paths(value: Any, folder: Path) -> Any:
    if isinstance(value, list | tuple):
        return [_with_full_paths(item, folder) for item in value]
    if not isinstance(value, dict):
        return value
    return {key: str((folder / item).resolve()) if _names_file(key, item, folder)
            else _with_full_paths(item, folder) for key, item in value.items()}


def named_files(part: Any, folder: Path) -> Iterator[Path]:
    """The files that a part of a scene, as nested dictionaries, names: meshes and pictures."""
    if isinstance(part, dict):
        yield from (folder / item for key, item in part.items() if _names_file(key, item, folder))
        part = list(part.values())
    if isinstance(part, list):
        for item in part:
            yield from named_files(item, folder)


def _names_file(key: str, value: Any, folder: Path) -> bool:
    """Whether a value is the path of a file: a mesh may be a generated one instead."""
    try:
        return key in PATHS and bool(value) and (folder / value).is_file()
    except (OSError, ValueError):   # too long for a name, or not one
        return False


def build(data: dict[str, Any], path: Path = Path("scene.toml")) -> Scene:
    """Check a scene given as nested dictionaries; raises `SceneError`."""
    try:
        scene = Scene.model_validate(data)
    except ValidationError as error:
        raise SceneError(f"{path}: {_first_error(error)}") from None
    scene._path = path
    for key, value, fix in _contradictions(scene):
        raise SceneError(f"{path}: {key} = {_short(value)}: {fix}")
    return scene


def apply_override(data: dict[str, Any], override: str) -> None:
    """Write `section.key=value` into `data`; list items are addressed by index or by name."""
    key, sign, text = override.partition("=")
    parts = key.strip().split(".")
    if not sign or not all(parts):
        raise SceneError(f"--set {override}: fix: write section.key=value, as in time.end=0.1")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError) as error:
        raise SceneError(f"--set {override}: the value is not TOML ({error}); "
                         'fix: quote text, as in domain.boundary="open"') from None
    place: Any = data
    for part in parts[:-1]:
        place = _descend(place, part, override)
    if not isinstance(place, dict):
        raise SceneError(f"--set {override}: {parts[-2]} is not a table of the scene")
    place[parts[-1]] = value


def _descend(place: Any, part: str, override: str) -> Any:
    if isinstance(place, dict):
        return place.setdefault(part, {})
    if isinstance(place, list):
        for index, item in enumerate(place):
            if part == str(index) or isinstance(item, dict) and item.get("name") == part:
                return item
    raise SceneError(f"--set {override}: the scene has no entry {part!r}")


def _first_error(error: ValidationError) -> str:
    """The most useful of pydantic's errors as `key = value: complaint; fix`."""
    errors = sorted(error.errors(), key=lambda item: item["type"] == "missing")
    first = errors[0]
    key = ".".join(_short_name(part) for part in _written(first))
    text = f"{key}: {_complaint(first)}"
    if first["type"] != "missing":
        text = f"{key} = {_short(first['input'])}: {_complaint(first)}"
    others = len({e["loc"] for e in errors}) - 1
    return text + (f" (and {others} more)" if others else "")


def _written(item: Any) -> list[Any]:
    """Where an error is, as the user wrote it: pydantic adds the alternatives of a union that it
    tried, which nobody wrote. An unknown key may look like one, and is the last."""
    loc = list(item["loc"])
    last = loc[-1:] if item["type"] == "extra_forbidden" else []
    return [part for part in loc[:len(loc) - len(last)] if not _is_union_tag(part)] + last


def _is_union_tag(part: Any) -> bool:
    return isinstance(part, str) and (part.startswith(("literal[", "tuple[", "function-"))
                                      or part[:1].isupper() and len(part) > 1)


def _complaint(item: Any) -> str:
    loc = _written(item)
    if item["type"] == "extra_forbidden":
        known = _known_keys(loc[:-1])
        near = difflib.get_close_matches(str(loc[-1]), known, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"known keys: {', '.join(known)}"
        return f"unknown key; fix: remove it ({hint})"
    if item["type"] == "missing":
        return "missing; fix: add it"
    message = item["msg"][0].lower() + item["msg"][1:]
    return f"{message}; fix: {_range_hint(loc)}"


def _range_hint(loc: Sequence[Any]) -> str:
    for section, key, info in schema.walk(Scene):
        names = [str(part) for part in loc if not isinstance(part, int)]
        if names == [*(section.split(".") if section else []), key]:
            unit = f" {schema.unit_of(info)}" if schema.unit_of(info) else ""
            legal = schema.range_of(info)
            return f"give {legal or info.description}{unit}"
    return "see python -m solver --parameters"


def _known_keys(loc: Sequence[Any]) -> list[str]:
    model: type[Section] | None = Scene
    for part in loc:
        if isinstance(part, str) and model is not None and part in model.model_fields:
            model = schema.section_of(model.model_fields[part].annotation)
    return list(model.model_fields) if model is not None else []


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _short_name(part: Any) -> str:
    text = str(part)
    return text if len(text) <= 40 else text[:37] + "..."


def _contradictions(scene: Scene) -> Iterator[tuple[str, Any, str]]:
    """Values that are each legal but cannot stand together, as (key, value, complaint; fix)."""
    yield from _boundary_contradictions(scene.domain)
    yield from _expression_errors(scene.initial)
    fluid, fuel = scene.fluid, scene.fuel
    if fluid.max_temperature <= fluid.ambient_temperature:
        yield ("fluid.max_temperature", fluid.max_temperature,
               f"must exceed ambient_temperature = {fluid.ambient_temperature:g}; fix: raise it")
    if scene.time.frame > scene.time.end:
        yield ("time.frame", scene.time.frame, f"is longer than the run; fix: at most time.end = "
               f"{scene.time.end:g}")
    if fuel is not None:
        if fuel.ignited > fuel.particles:
            yield ("fuel.ignited", fuel.ignited, "more than there are particles; fix: at most "
                   f"fuel.particles = {fuel.particles}")
        if not all(0 <= x <= size for x, size in zip(scene.detonation.position, scene.domain.size,
                                                     strict=True)):
            yield ("detonation.position", scene.detonation.position,
                   f"is outside the box; fix: between 0 and domain.size = {scene.domain.size}")
        if scene.is_closed and scene.domain.expansion == "refuse" and fuel.gas > 0:
            yield ("domain.boundary", scene.domain.boundary, "a closed box cannot take the gas of "
                   'the fuel; fix: open a face, or set domain.expansion = "spread"')
    if scene.soot is not None and fuel is None:
        yield "soot", "given", "soot comes from fuel; fix: add [fuel] or remove [soot]"
    yield from _body_contradictions(scene)
    yield from scene_physics.contradictions(scene)
    yield from scene_body.contradictions(scene)
    yield from scene_render.contradictions(scene)


def _boundary_contradictions(domain: Domain) -> Iterator[tuple[str, Any, str]]:
    for axis, letter in enumerate("xyz"):
        low, high = (domain.face(f"{letter}_{side}") for side in ("min", "max"))
        if (low == "periodic") != (high == "periodic"):
            yield (f"domain.boundary.{letter}_max", high, "one face of the axis is periodic and "
                   "the other is not; fix: make both periodic")
        for side, face in (("min", low), ("max", high)):
            if isinstance(face, MovingWall) and face.wall[axis] != 0:
                yield (f"domain.boundary.{letter}_{side}.wall", face.wall,
                       "a wall cannot move through itself; fix: set its normal component to 0")


def _expression_errors(initial: Initial) -> Iterator[tuple[str, Any, str]]:
    for key in ("u", "v", "w", "T"):
        expression = getattr(initial, key)
        if not expression:
            continue
        try:
            formula.check(expression, COORDINATES)
        except formula.FormulaError as error:
            yield f"initial.{key}", _short(expression), f"{error}; fix: correct it"


def _body_contradictions(scene: Scene) -> Iterator[tuple[str, Any, str]]:
    names = [body.name for body in scene.body]
    for index, body in enumerate(scene.body):
        key = f"body.{index}"
        if names.index(body.name) != index:
            yield f"{key}.name", body.name, "used twice; fix: give each body its own name"
        if body.density is not None and body.areal_density is not None:
            yield (f"{key}.density", body.density, "given beside areal_density; fix: keep one")
        if body.density is None and body.areal_density is None:
            yield f"{key}.density", None, "the body has no mass; fix: give density or areal_density"
        if body.shape == "mesh" and not body.mesh:
            yield f"{key}.mesh", body.mesh, 'missing; fix: a path, or a generated one, "animal"'


def table(model: type[Section] = Scene) -> Iterable[tuple[str, str, str, str, str, str]]:
    """Rows (section, key, default, unit, range, meaning) of every parameter."""
    for section, key, info in schema.walk(model):
        default = "required" if info.is_required() else _short(info.default)
        yield (section, key, default, schema.unit_of(info), schema.range_of(info),
               info.description or "")

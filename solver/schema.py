"""How one parameter of a scene is written down: default, unit, range and meaning in one place.

Every section of a scene file is a `Section`; every key of it is a `parameter`.
`python -m solver --parameters` prints the table that these declarations hold.
"""

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

Vector = tuple[float, float, float]
Positive3 = tuple[Annotated[float, Field(gt=0)], Annotated[float, Field(gt=0)],
                  Annotated[float, Field(gt=0)]]

RANGE_SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤",
               "min_length": "length ≥", "max_length": "length ≤"}


class Section(BaseModel):
    """A table of the scene file; unknown keys are refused and values never change after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=True)


def parameter(default: Any, meaning: str, unit: str = "", **bounds: Any) -> Any:
    """Declare one key: its default (`...` where the scene must give it), meaning, unit and bounds.

    `bounds` are pydantic's: gt, ge, lt, le, min_length, max_length. Units are those of the box:
    L length, s time, M mass, K temperature of the scene (not Kelvin).
    """
    return Field(default, description=meaning, json_schema_extra={"unit": unit}, **bounds)


def unit_of(info: FieldInfo) -> str:
    """The unit that `parameter` recorded, or an empty string."""
    extra = info.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def range_of(info: FieldInfo) -> str:
    """The legal values in words: bounds, or the choices of a Literal."""
    bounds = [f"{sign} {getattr(item, name):g}" for item in info.metadata
              for name, sign in RANGE_SIGNS.items() if hasattr(item, name)]
    choices = [f'"{value}"' if isinstance(value, str) else str(value)
               for value in _literals(info.annotation)]
    return " | ".join(choices) if choices else " and ".join(bounds)


def _literals(annotation: Any) -> Iterator[Any]:
    if get_origin(annotation) is Literal:
        yield from get_args(annotation)
    elif get_origin(annotation) in (Union, UnionType, Annotated):
        for part in get_args(annotation):
            yield from _literals(part)


def section_of(annotation: Any) -> type[Section] | None:
    """The section class inside an annotation such as `tuple[Body, ...]` or `Fuel | None`."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation
    for part in get_args(annotation):
        found = section_of(part)
        if found is not None:
            return found
    return None


def _is_also_plain(annotation: Any) -> bool:
    """Whether a key may hold a plain value instead of its section: "open", or a table per face."""
    return (get_origin(annotation) in (Union, UnionType)
            and any(section_of(part) is None and part is not type(None)
                    for part in get_args(annotation)))


def walk(model: type[Section], prefix: str = "") -> Iterator[tuple[str, str, FieldInfo]]:
    """Every parameter as (section, key, declaration), in the order of declaration.

    A section that several keys of one table may hold (a moving wall) is entered at the first.
    """
    seen: set[type[Section]] = set()
    for key, info in model.model_fields.items():
        inner = section_of(info.annotation)
        if inner is None or _is_also_plain(info.annotation):
            yield prefix, key, info
        if inner is not None and inner not in seen:
            yield from walk(inner, f"{prefix}.{key}" if prefix else key)
            if _is_also_plain(info.annotation):
                seen.add(inner)

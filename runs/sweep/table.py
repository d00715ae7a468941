"""Which runs does a sweep consist of? A table of scene overrides, read and checked before any runs.

TOML: a base scene, and rows, or the values of each key, of which all combinations run.

    scene = "window"                      # of runs/scenes, or the path of a scene from here
    [grid]                                # 2 × 3 runs
    "fuel.gas" = [0.5, 0.9]
    "seed" = [1, 2, 3]
    [[row]]                               # and one more
    "fuel.gas" = 5.0
    name = "too much"

CSV: a column per key and a line per run, values as in TOML; a column `name` names the folders, and
the first line is `# scene = "window"`.
"""

import csv
import itertools
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from solver.scene import Scene, SceneError, load

SCENES = Path(__file__).resolve().parents[1] / "scenes"
FOLDER_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}")


class TableError(Exception):
    """A table that is no sweep; the message is one line for the user."""


@dataclass(frozen=True)
class Case:
    """One run: its folder's name, its values by key, and the scene with them."""

    name: str
    values: dict[str, Any]
    scene: Scene

    @property
    def overrides(self) -> list[str]:
        """The values as `key=value`, as --set takes them."""
        return [f"{key}={as_toml(value)}" for key, value in self.values.items()]


def read(path: Path) -> list[Case]:
    """All runs of a sweep, every scene checked; raises `TableError` or `SceneError`."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise TableError(f"{path}: cannot be read ({error}); fix: give a .toml or .csv "
                         "table") from None
    base, rows = _csv_rows(path, text) if path.suffix == ".csv" else _toml_rows(path, text)
    scene = path.parent / base
    if not scene.is_file() and (SCENES / f"{base}.toml").is_file():
        scene = SCENES / f"{base}.toml"
    if not rows:
        raise TableError(f"{path}: holds no run; fix: add [grid] or [[row]]")
    width = len(str(len(rows) - 1))
    cases, names = [], set()
    for number, row in enumerate(rows):
        name = row.pop("name", f"{number:0{width}d}")
        if not isinstance(name, str) or not FOLDER_NAME.fullmatch(name) or name in names:
            raise TableError(f"{path}: run {number}: name = {name!r}; fix: a name that no other "
                             "run has, of letters, digits and _ . + -")
        names.add(name)
        overrides = [f"{key}={as_toml(value)}" for key, value in row.items()]
        try:
            cases.append(Case(name, row, load(scene, overrides)))
        except SceneError as error:
            raise TableError(f"{path}: run {name}: {error}") from None
    return cases


def as_toml(value: Any) -> str:
    """A value as TOML writes it, on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {as_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    return tomli_w.dumps({"v": value})[4:].strip()


def _toml_rows(path: Path, text: str) -> tuple[str, list[dict[str, Any]]]:
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise TableError(f"{path}: not valid TOML: {error}; fix: correct that line") from None
    unknown = data.keys() - {"scene", "grid", "row"}
    grid, rows = data.get("grid", {}), data.get("row", [])
    if unknown or not isinstance(data.get("scene"), str):
        raise TableError(f"{path}: {', '.join(sorted(unknown)) or 'scene'}: "
                         f"{'unknown' if unknown else 'missing'}; fix: scene = \"NAME\", [grid] "
                         "and [[row]]")
    if not isinstance(grid, dict) or not isinstance(rows, list):
        raise TableError(f"{path}: grid is a table of lists, row a list of tables")
    for key, values in grid.items():
        if not isinstance(values, list) or not values:
            raise TableError(f"{path}: grid.{key} = {values!r}: fix: a list of values; quote keys "
                             "with dots")
    combinations = [dict(zip(grid, values, strict=True))
                    for values in itertools.product(*grid.values())] if grid else []
    return data["scene"], combinations + [dict(row) for row in rows]


def _csv_rows(path: Path, text: str) -> tuple[str, list[dict[str, Any]]]:
    lines = text.splitlines()
    match = re.fullmatch(r'#\s*scene\s*=\s*"?([^"]+)"?\s*', lines[0] if lines else "")
    if not match:
        raise TableError(f'{path}: line 1; fix: # scene = "NAME"')
    rows = []
    for number, cells in enumerate(csv.DictReader(lines[1:]), start=3):
        row: dict[str, Any] = {}
        for key, cell in cells.items():
            if key is None or cell is None:
                raise TableError(f"{path}: line {number}: not as many values as there are keys; "
                                 "fix: quote values with commas")
            row[key] = _value(cell) if key != "name" else cell
        rows.append(row)
    return match[1], rows


def _value(cell: str) -> Any:
    """A cell as TOML; what is no TOML is text."""
    try:
        return tomllib.loads(f"v = {cell}")["v"]
    except ValueError:
        return cell

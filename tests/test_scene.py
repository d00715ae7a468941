"""A scene is read once and checked: defaults, overrides, and one clear error for every mistake."""

import math
from pathlib import Path

import pytest

from solver import scene as scenes
from solver import schema
from solver.scene import SceneError, build, load, save

MINIMAL = {"time": {"end": 1.0, "frame": 0.1}}
SCENES = Path(__file__).parent.parent / "runs" / "scenes"


def scene_with(**sections):
    return build({**MINIMAL, **sections})


def error_of(**sections) -> str:
    with pytest.raises(SceneError) as caught:
        scene_with(**sections)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_only_the_times_are_required():
    scene = build(MINIMAL)
    assert scene.domain.cells == (32, 32, 32)
    assert scene.fluid.reynolds == math.inf
    assert scene.fuel is None and scene.body == ()


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_scene_of_the_project_is_valid(path):
    assert load(path).time.end > 0


@pytest.mark.parametrize("sections, words", [
    ({"domian": {}}, ["domian", "unknown key", "'domain'"]),
    ({"domain": {"cell": [8, 8, 8]}}, ["domain.cell", "unknown key", "'cells'"]),
    ({"domain": {"cells": [8, 8]}}, ["domain.cells"]),
    ({"domain": {"cells": [8, 8, 0]}}, ["domain.cells", "0", "fix"]),
    ({"domain": {"size": [1.0, -1.0, 1.0]}}, ["domain.size", "-1.0", "greater than 0"]),
    ({"domain": {"boundary": "closed"}}, ["domain.boundary", "'closed'"]),
    ({"domain": {"boundary": {"x_min": "periodic"}}}, ["x_max", "periodic", "both"]),
    ({"domain": {"boundary": {"y_max": {"wall": [1.0, 1.0, 0.0]}}}}, ["y_max", "normal"]),
    ({"time": {"end": 1.0, "frame": 2.0}}, ["time.frame", "2.0", "at most"]),
    ({"time": {"end": "soon", "frame": 0.1}}, ["time.end", "'soon'"]),
    ({"time": {"frame": 0.1}}, ["time.end", "missing"]),
    ({"time": {"end": math.nan, "frame": 0.1}}, ["time.end", "nan"]),
    ({"fluid": {"reynolds": 0}}, ["fluid.reynolds", "0", "greater than 0"]),
    ({"fluid": {"max_temperature": 1.0}}, ["max_temperature", "1.0", "raise"]),
    ({"fuel": {"mass": -1}}, ["fuel.mass", "-1", "> 0", "M"]),
    ({"fuel": {"particles": 2, "ignited": 3}}, ["fuel.ignited", "3", "at most"]),
    ({"fuel": {}, "detonation": {"position": [2.0, 0.5, 0.5]}}, ["detonation.position", "outside"]),
    ({"soot": {}}, ["soot", "[fuel]"]),
    ({"fuel": {}, "fluid": {"source": "1"}}, ["fluid.source", "[fuel]", "remove"]),
    ({"initial": {"u": "import os"}}, ["initial.u", "import os", "expression"]),
    ({"initial": {"u": "q + 1"}}, ["initial.u", "q"]),
    ({"initial": {"u": "__import__('os')"}}, ["initial.u"]),
    ({"body": [{"name": "a", "shape": "box"}]}, ["body.0.density", "mass", "areal_density"]),
    ({"body": [{"name": "a", "shape": "mesh", "density": 1.0}]}, ["body.0.mesh", "missing"]),
    ({"body": [{"name": "a", "shape": "box", "density": 1.0}] * 2}, ["body.1.name", "twice"]),
], ids=lambda value: str(value)[:40])
def test_a_mistake_is_one_line_with_file_key_value_and_fix(sections, words):
    message = error_of(**sections)
    assert message.startswith("scene.toml: ") and "fix" in message
    for word in words:
        assert word in message, message


def test_closed_box_with_fire_names_both_remedies():
    message = error_of(fuel={}, domain={"boundary": "wall"})
    assert "open" in message and 'expansion = "spread"' in message
    assert scene_with(fuel={}, domain={"boundary": "wall", "expansion": "spread"}).is_closed


def test_overrides_reach_tables_and_bodies_by_name(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text('time = { end = 1.0, frame = 0.1 }\n[[body]]\nname = "a"\nshape = "box"\n'
                    "density = 1.0\n")
    scene = load(path, ["domain.cells=[4, 5, 6]", "body.a.force=7.0", 'domain.boundary="wall"'])
    assert scene.domain.cells == (4, 5, 6) and scene.body[0].force == 7.0
    for bad in ("domain.cells", "time.end=soon", "body.b.force=1.0", "=1"):
        with pytest.raises(SceneError, match="--set"):
            load(path, [bad])


def test_files_that_are_no_scene(tmp_path):
    missing, broken, binary = (tmp_path / name for name in ("no.toml", "bad.toml", "binary.toml"))
    broken.write_text("time = {")
    binary.write_bytes(b"\xff\xfe\x00")
    for path, word in ((missing, "no such"), (broken, "not valid TOML"), (binary, "cannot be read"),
                       (tmp_path, "cannot be read")):
        with pytest.raises(SceneError, match=word) as caught:
            load(path)
        assert str(path) in str(caught.value)


def test_saved_scene_is_the_same_scene(tmp_path):
    for path in SCENES.glob("*.toml"):
        scene = load(path, ["time.cfl=0.25"])
        copy = tmp_path / path.name
        save(scene, copy)
        assert load(copy).model_dump() == scene.model_dump()


def test_only_paths_are_saved_as_full_paths(tmp_path):
    path, copy = tmp_path / "scene.toml", tmp_path / "copy" / "scene.toml"
    path.write_text('title = "pane"\ntime = { end = 1.0, frame = 0.1 }\n'
                    '[[body]]\nname = "pane"\nshape = "pane"\nareal_density = 1.0\n'
                    '[[body]]\nname = "cow"\nshape = "mesh"\nmesh = "cow.obj"\ndensity = 1.0\n')
    for name in ("pane", "cow", "cow.obj"):   # files that happen to be there
        (tmp_path / name).write_text("")
    copy.parent.mkdir()
    save(load(path), copy)
    saved = load(copy)
    assert (saved.title, [body.name for body in saved.body]) == ("pane", ["pane", "cow"])
    assert saved.body[1].mesh == str(tmp_path / "cow.obj")


def test_table_names_every_parameter_once_with_meaning():
    rows = list(scenes.table())
    keys = [(section, key) for section, key, *_ in rows]
    assert len(set(keys)) == len(keys)
    assert all(meaning for *_, meaning in rows)
    assert ("fuel", "burn_rate", "0.21", "M/s", "> 0") in [row[:5] for row in rows]
    assert {key for _, key, _ in schema.walk(scenes.Scene)} == {key for _, key in keys}


def test_table_tells_a_boundary_as_one_kind_and_face_by_face():
    rows = {(section, key): (default, legal) for section, key, default, _, legal, _
            in scenes.table()}
    kinds = '"open" | "wall" | "slip" | "periodic"'
    assert rows["domain", "boundary"] == rows["domain.boundary", "y_max"] == ("'open'", kinds)
    assert rows["domain.boundary.x_min", "wall"][0] == "required"

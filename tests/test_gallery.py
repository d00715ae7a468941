"""The claims of the gallery can hold and can fail; its command says what it does and refuses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from partition.build import build as build_fragments
from render.image import save_png
from render.sequence import frame_path
from runs import films, strip, watch
from runs.__main__ import gallery
from solver import scene as scenes
from solver.files import snapshot_path

pytestmark = pytest.mark.serial

PANE = {"name": "pane", "shape": "pane", "size": (0.8, 0.8, 0.02), "areal_density": 10.0,
        "points": 60, "fracture": {"pieces": 6, "root": "detonation"}}


def run_of(move, scene_changes=None, body=PANE, frames=11):
    """A film whose pieces stand at `move(start, time, piece)`."""
    scene = scenes.build({"time": {"end": 1.0, "frame": 0.1}, "body": [body], "obstacle": [{}],
                          "detonation": {"position": (0.5, 0.5, 0.4)}} | (scene_changes or {}))
    fragments = build_fragments(scene)
    area, _, centre = fragments.measures()
    time = np.linspace(0, 1, frames)
    position = np.array([[move(c, t, n) for n, c in enumerate(centre)] for t in time])
    velocity = np.gradient(position, time, axis=0)
    orientation = np.tile([1.0, 0, 0, 0], (frames, len(area), 1))
    shape = fragments.vertices + (position - centre)[:, fragments.piece_of_vertex]
    return watch.Run(Path("out"), scene, fragments, time, position, orientation, velocity, area,
                     shape)


def outwards(sign):
    """Pieces near the centre move first (or last)."""
    def move(start, time, piece):
        away = np.linalg.norm(start[:2] - 0.5)
        return start + (0, 0, time * np.exp(-sign * 4 * away))
    return move


def test_pane_that_parts_from_its_centre_is_told_from_one_that_does_not():
    assert watch.centre_first(run_of(outwards(1))).holds
    assert not watch.centre_first(run_of(outwards(-1))).holds


@pytest.mark.parametrize("sign", [1, -1])
def test_speed_is_held_against_mass(sign):
    area = run_of(outwards(1)).mass
    found = watch.small_fly_faster(run_of(lambda start, time, piece: start + (
        0, 0, time * area[piece] ** -sign)))
    assert found.holds == (sign == 1) and f"{-sign:.2f}" in found.text


def test_rest_needs_the_ground_and_an_end_of_motion():
    flat = PANE | {"rotate": (90.0, 0.0, 0.0), "fracture": {"pieces": 8}}

    def held(move):
        return watch.comes_to_rest(run_of(move, body=flat)).holds

    def landing(height):
        return lambda start, time, piece: start * (1, 0, 1) + (
            0, max(height, start[1] - 2 * time), 0)

    def lying(count):
        return lambda start, time, piece: landing(0.01 if piece < count else 0.3)(start, time,
                                                                                  piece)
    assert held(landing(0.01))
    assert held(lying(7)) and not held(lying(6))      # more than three quarters of 8
    assert not held(landing(0.3))                                         # in the air
    assert not held(landing(0.0))                                         # sunk in
    assert not held(lambda s, t, n: s * (1, 0, 1) + (t, 0.01, 0))         # sliding on


def test_head_alone_breaks():
    still = run_of(lambda start, time, piece: start)
    heavy, ahead = np.array([5.0, 1, 1, 1, 1, 1]), np.array([0, 1, 1, 1, 1, 1])[:, None]
    thrown = still.position + still.time[:, None, None] * ahead * (0.5, 0, 0)
    thrown[:, 1:, 0] += 2
    good = replace(still, mass=heavy, position=thrown)
    assert watch.head_alone_breaks(good).holds
    assert not watch.head_alone_breaks(replace(good, position=thrown * (-1, 1, 1))).holds
    assert not watch.head_alone_breaks(replace(good, position=thrown + still.time[
        :, None, None])).holds


def test_balloon_must_grow_before_its_pieces_part():
    sphere = {"name": "ball", "shape": "sphere", "radius": 0.2, "detail": 2, "density": 1.0,
              "fracture": {"pieces": 4}}
    still = run_of(lambda start, time, piece: start, body=sphere)
    assert not watch.swells_before_it_bursts(still).holds
    grown = (still.shape - 0.5) * (1 + still.time[:, None, None]) + 0.5
    turned = still.orientation.copy()
    turned[6:, 1] = [0, 1, 0, 0]
    found = watch.swells_before_it_bursts(replace(still, shape=grown, orientation=turned))
    assert found.holds and f"{1.5 ** 3:.2f} times its volume at t = 0.5" in found.text


@pytest.mark.parametrize("colours, holds", [
    (((30, 30, 40), (200, 80, 20), (240, 190, 60), (150, 60, 20)), True),
    (((30, 30, 40), (240, 190, 60), (200, 80, 20), (150, 60, 20)), False),     # cools only
    (((30, 30, 40),) * 4, False)])                                             # no fire
def test_colours_of_the_frames_are_followed(tmp_path, colours, holds):
    found = run_of(lambda start, time, piece: start, frames=4)
    (tmp_path / "snapshots").mkdir()
    (tmp_path / "frames").mkdir()
    for frame, colour in enumerate(colours):
        snapshot_path(tmp_path, frame).touch()
        save_png(frame_path(tmp_path / "frames", frame), np.full((9, 9, 3), colour, np.uint8), "")
    assert watch.red_to_yellow(replace(found, path=tmp_path)).holds == holds


def test_every_film_has_a_scene_and_a_figure_and_all_scenes_are_shown():
    known = {path.stem for path in films.SCENES.glob("*.toml")}
    assert known == set(films.NAMES)
    assert {film.figure for film in films.FILMS} == {"5.1", "5.2", "5.4", "5.5", "5.6", "5.7"}
    for film in films.FILMS:
        scene, _ = films.loaded(film, None)
        assert scene.title


def test_unknown_film_is_refused_with_the_names(capsys):
    assert gallery(["windows"]) == 2
    assert "window" in capsys.readouterr().err


def test_frames_of_a_strip_begin_and_end_the_film_and_are_denser_at_its_start():
    chosen = strip.spread(list(range(101)), 10)
    assert chosen[0] == 0 and chosen[-1] == 100 and len(chosen) == 10
    assert np.all(np.diff(chosen, 2)[:-1] >= -1) and chosen[1] < chosen[-1] - chosen[-2]
    assert strip.spread([3, 4], 10) == [3, 4]

"""A picture is right whatever is in it, and costs only what is in it."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from partition.build import build as break_up
from render import sequence
from render.fire import Fire
from render.frame import BATCH, Film
from solver import files, scene
from tests import render_run
from tests.render_run import WINDOW, still

UNIFORM = {"kind": "uniform", "colour": [0.3, 0.6, 0.9]}


def film_of(data: dict[str, Any], fire: bool = False) -> Film:
    found = scene.build(data)
    assert found.render is not None
    return Film(found, found.render, break_up(found) if found.body else None,
                Fire(found, found.render, 65.0) if fire else None)


def snapshot(film: Film, flight: float = 0.0, share: float | None = None) -> files.Snapshot:
    """Pieces after a flight; with `share` also the fire."""
    blocks: dict[str, Any] = {}
    if film.scene.body:
        blocks |= render_run.bodies(break_up(film.scene), film.scene, flight)
    if share is not None:
        blocks |= render_run.fire(film.scene, share)
    particles: dict[str, dict[str, Any]] = {"fuel": {}, "soot": {}}
    for name, values in blocks.items():
        if name.startswith("particles/"):
            particles[name.split("/")[1]][name.split("/")[2]] = values
    spacing = np.array(film.scene.domain.size) / film.scene.domain.cells
    fields = {"T": files.Field(blocks["fields/T"], spacing / 2, spacing)} if share else {}
    return files.Snapshot(1, 0.1, 1, fields, particles,
                          {name[7:]: values for name, values in blocks.items()
                           if name.startswith("bodies/")})


@pytest.mark.parametrize("samples", [1, 2, 3, 4])
def test_constant_surrounding_is_constant(samples):
    light = still({"width": 5, "height": 4, "samples": samples, "backdrop": UNIFORM})
    assert light == pytest.approx(np.broadcast_to((0.3, 0.6, 0.9), (4, 5, 3)), rel=1e-6)


def test_intact_pane_shows_no_cracks():
    """The broken pane looks like the same pane in one piece until its pieces part."""
    render = {"width": 60, "height": 60, "samples": 1,
              "camera": {"position": [0.5, 0.52, 1.6], "target": [0.5, 0.5, 0.6]}}
    broken = film_of({**WINDOW, "render": render})
    assert broken.pieces is not None and (broken.pieces.neighbour >= 0).sum() > 100
    whole = film_of({**WINDOW, "render": render,
                     "body": [{**WINDOW["body"][0], "fracture": {"pieces": 1}}]})
    intact = broken.frame(snapshot(broken)).light
    assert intact == pytest.approx(whole.frame(snapshot(whole)).light, abs=1e-3)
    assert abs(intact - broken.frame(snapshot(broken, 1e-5)).light).max() < 0.05
    assert abs(intact - broken.frame(snapshot(broken, 0.1)).light).max() > 0.2


def test_a_crack_shows_both_faces_or_none():
    """Faces of a pair appear together, once the pair has moved by crack_gap of the thickness."""
    film = film_of(WINDOW)
    assert film.pieces is not None
    pieces = film.pieces
    thickness = pieces.gap[0] / film.render.crack_gap
    assert thickness == pytest.approx(0.01 * 0.3 / (0.3 + 1.1 * 0.01), rel=0.02)
    poses = snapshot(film).bodies
    for shift, parted in ((0.9, False), (1.1, True)):
        moved = poses["position"].copy()
        moved[3, 0] += shift * pieces.gap[0]
        shown = film.pieces.posed({**poses, "position": moved})
        inner = len(shown.piece) - (pieces.neighbour < 0).sum()
        pairs = (pieces.neighbour == 3).sum() + ((pieces.neighbour >= 0) & (pieces.rest.piece == 3)
                                                 ).sum()
        assert inner == (pairs if parted else 0)


def test_rows_and_bands_do_not_show(monkeypatch):
    """Bit for bit the same picture from rows traced apart and from smaller batches."""
    film = film_of({**WINDOW, "render": {"width": 24, "height": 20}}, fire=True)
    moment = snapshot(film, 0.1, 0.5)
    whole = film.frame(moment).light
    assert whole.max() > 0.5
    rows = [range(0, 7), range(7, 8), range(8, 20)]
    parts = [film.frame(moment, some).light for some in rows]
    assert np.array_equal(whole, np.concatenate(parts))
    assert np.array_equal(whole[2::3], film.frame(moment, range(2, 20, 3)).light)
    monkeypatch.setattr("render.frame.BATCH", BATCH // 500)
    assert np.array_equal(whole, film.frame(moment).light)


def test_fire_lights_its_surroundings():
    """A wall beside the fire is brighter and redder with it; its light is gone with glow = 0."""
    data = {**WINDOW, "body": [], "render": {
        "width": 12, "height": 12, "light": [], "volume": {"smoke": 0.0},
        "camera": {"position": [0.5, 0.5, 3.0], "target": [0.5, 0.5, 0.5]},
        "object": [{"shape": "box", "low": [-1, -1, -0.3], "high": [2, 2, -0.2],
                    "material": "matt"}]}}
    dark = {**data, "render": {**data["render"], "volume": {"glow": 0.0, "smoke": 0.0}}}
    with_glow, without = film_of(data, fire=True), film_of(dark, fire=True)
    lit = with_glow.frame(snapshot(with_glow, share=0.3)).light[0, 0]
    unlit = without.frame(snapshot(without, share=0.3)).light[0, 0]
    gain = lit - unlit
    assert gain[0] > 5e-4 and gain[0] > gain[1] > gain[2] >= 0


def test_incandescent_pieces_have_the_colour_of_their_temperature():
    """Pieces in the fire glow like it, pieces in the cold do not; the fire itself stays unseen."""
    data = {**WINDOW, "body": [
        {"name": "hot", "shape": "sphere", "radius": 0.1, "place": [0.46, 0.52, 0.48],
         "areal_density": 1.0, "material": "hot"},
        {"name": "cold", "shape": "sphere", "radius": 0.1, "place": [0.15, 0.15, 0.15],
         "areal_density": 1.0, "material": "hot"}],
        "render": {"width": 40, "height": 40, "ambient": [0, 0, 0], "light": [],
                   "backdrop": {"kind": "uniform", "colour": [0, 0, 0]},
                   "volume": {"visible": False}, "material": {"hot": {"incandescent": True}}}}
    film = film_of(data, fire=True)
    light = film.frame(snapshot(film, share=0.4)).light
    glowing = light[light.max(axis=2) > 0.05]
    assert 15 < len(glowing) < 60     # one ball of two
    colour = glowing[glowing[:, 0].argmax()]
    assert colour[0] > colour[1] > colour[2]
    unlit = film_of({**data, "render": {**data["render"], "material": {"hot": {}}}}, fire=True)
    assert not unlit.frame(snapshot(unlit, share=0.4)).light.any()


def test_smoke_casts_a_shadow():
    """A cloud between a lamp and the ground darkens the ground under it, and only there."""
    data = {**WINDOW, "body": [], "render": {
        "width": 30, "height": 30, "ambient": [0, 0, 0], "samples": 1,
        "light": [{"kind": "directional", "direction": [0, -1, 0]}],
        "camera": {"position": [0.5, -0.1, 5], "target": [0.5, -0.3, 0.5], "fov": 30},
        "volume": {"exposure": 0.0, "albedo": [0, 0, 0]},
        "object": [{"shape": "plane", "place": [0, -0.3, 0], "material": "matt"}]}}
    open_sky = {**data, "render": {**data["render"], "volume": {
        "exposure": 0.0, "albedo": [0, 0, 0], "shadows": False}}}
    clouded, clear = film_of(data, fire=True), film_of(open_sky, fire=True)
    with_shadow = clouded.frame(snapshot(clouded, share=0.6)).light
    without = clear.frame(snapshot(clear, share=0.6)).light
    assert np.all(with_shadow <= without + 1e-12)
    assert with_shadow[:, 0] == pytest.approx(without[:, 0])
    assert (with_shadow < 0.5 * without).any()


@pytest.mark.parametrize("look", [
    {"width": 1, "height": 1}, {"width": 1, "height": 37}, {"width": 4000, "height": 1},
    {"light": []}, {"depth": 0}, {"samples": 1},
    {"camera": {"position": [0.5, 0.5, 0.6], "target": [0.5, 0.5, 0.0]}},         # inside the pane
    {"camera": {"position": [0.46, 0.52, 0.48], "target": [0.5, 0.9, 0.9]}},      # inside the fire
    {"camera": {"position": [0.5, 0.5, 0.62], "target": [0.5, 0.5, 0.0], "fov": 170}},
    {"object": [{"shape": "box", "low": [-9, -9, -9], "high": [9, 9, 9], "material": "mirror"}]},
    {"object": [{"shape": "plane", "material": "wood"}],
     "material": {"wood": {"texture": {"kind": "wood"}, "specular": 1.0}}},
    {"volume": {"contrast": 1.0, "exposure": 1e6}}, {"tone": "linear"},
])
def test_light_is_finite_and_not_negative(look):
    film = film_of({**WINDOW, "render": {"width": 16, "height": 16, **look}}, fire=True)
    light = film.frame(snapshot(film, 0.02, 0.4)).light
    assert light.shape == (film.render.height, film.render.width, 3)
    assert np.isfinite(light).all() and light.min() >= 0


def test_without_fire_there_is_no_volume(tmp_path, monkeypatch):
    """Neither a scene without temperature nor one with the volume switched off makes a volume."""
    class OneRank:
        rank, size = 0, 1

    cold = scene.build({"time": {"end": 1.0, "frame": 1.0}, "render": {}})
    hidden = scene.build({**WINDOW, "render": {"volume": {"visible": False}}})
    for found in (cold, hidden):
        assert found.render is not None
        assert sequence.fire_of(tmp_path, found, found.render, OneRank) is None
    film = film_of({**WINDOW, "render": {"width": 4, "height": 4}})
    monkeypatch.setattr("render.frame.march", lambda *_: pytest.fail("marched through nothing"))
    film.frame(snapshot(film, share=0.5))


@pytest.mark.serial
def test_without_bodies_neither_embree_nor_meshes_are_loaded(tmp_path):
    """Nor the libraries of fire and film, when there is none."""
    program = """
import sys
from tests.render_run import still
light = still({"width": 4, "height": 4, "object": [{"shape": "box", "material": "brick"}]})
loaded = {"embreex", "meshio", "trimesh", "scipy", "colour", "av", "petsc4py"} & set(sys.modules)
assert light.max() > 0
print(sorted(loaded - LOADED_BY_THE_TEST))
"""
    helper = "LOADED_BY_THE_TEST = {'scipy', 'meshio', 'trimesh'}\n"
    result = subprocess.run([sys.executable, "-c", helper + program], capture_output=True,
                            text=True, check=False)
    assert (result.stdout, result.stderr) == ("[]\n", "")

"""The *_thesis scenes hold the thesis' Table 5.3, each parameter of Table 5.1 in its place."""

from typing import Any

import pytest

from runs.films import FILMS, SCENES
from solver import scene as scenes

pytestmark = pytest.mark.serial

# symbol: key of the scene, then the columns windows, cow 1, cow 2; None: N/A there
TABLE: dict[str, Any] = {
    "alpha": ("render.volume.splat.alpha", 1.4, None, None),
    "min_d": ("render.volume.splat.min_density", 0.05, None, None),
    "max_d": ("render.volume.splat.max_density", 0.95, None, None),
    "nf": ("render.volume.splat.filter", 5, None, None),
    "tau": ("render.volume.splat.tau", 0.01, None, None),
    "alpha_d": ("fuel.drag", 0, 0, 0),
    "alpha_h": ("fuel.heat_transfer", 200000, 50000, 30000),
    "b_h, per cell": ("fuel.heat", 23000, 3000, 6000),
    "b_g": ("fuel.gas", 2.61, 2.61, 2.61),
    "b_s": ("fuel.soot", 1.0, 1.0, 1.0),
    "c_m": ("fuel.thermal_mass", 20.54, 10, 10),
    "c_k": ("fluid.conductivity", 0.0, 0.0, 0.0),
    "c_r": ("fluid.cooling", 5.0, 5.0, 5.0),
    "F_c": ("body.0.force", 30.0, 40.0, 10.0),
    "m": ("fuel.mass", 0.36, 0.36, 0.36),
    "n_p": ("fuel.particles", 1000, 100, 100),
    "n_r": ("body.0.fracture.pieces", (16, 512), 17, 33),
    "nx, ny, nz": ("domain.cells", (32, 32, 32), (20, 20, 20), (20, 20, 20)),
    "r_d": ("detonation.radius", 0.1, 0.01, 0.05),
    "T_a": ("fluid.ambient_temperature", 5.0, 5.0, 5.0),
    "T_i": ("fuel.ignition_temperature", 10.0, 10.0, 10.0),
    "T_max": ("fluid.max_temperature", 100.0, 100.0, 100.0),
    "z_f": ("fuel.burn_rate", 0.21, 0.21, 0.21),
    "z_s": ("soot.burn_rate", 0.5, 0.5, 0.5),
    "vx, vy, vz": ("render.volume.splat.cells", (300, 300, 300), None, None),
    "pos_det": ("detonation.position", (0.46573, 0.52375, 0.48), (0.5, 0.55, 0.5),
                (0.525, 0.525, 0.48)),
    "thres_mf": ("fuel.min_mass", 1e-6, 1e-6, 1e-6),
    "thres_ms": ("soot.min_mass", 1e-5, 1e-5, 1e-5),
    "thres_cm": ("fuel.min_thermal_mass", 1e-4, 1e-4, 1e-4),
    "c_soot": ("soot.threshold", 0.02, 0.02, 0.02),
    "np_i": ("fuel.ignited", 10, 1, 1),
    "np_it, per frame": ("fuel.rate", 50, 5, 25),
}
COLUMN = {"window_thesis": 1, "closeup_thesis": 1, "cow_head_thesis": 2, "cow_balloon_thesis": 3}


def value(scene, key):
    for part in key.split("."):
        scene = scene[int(part)] if part.isdigit() else getattr(scene, part)
    return scene


@pytest.mark.parametrize("name", COLUMN)
def test_scene_has_every_number_of_the_table(name):
    scene = scenes.load(SCENES / f"{name}.toml")
    cells = scene.domain.cells[0] ** 3
    found, expected = {}, {}
    for symbol, (key, *columns) in TABLE.items():
        number = columns[COLUMN[name] - 1]
        if number is None:
            continue
        mine = value(scene, key)
        if symbol.startswith("b_h"):     # K per volume here
            mine = round(mine * cells / 100) * 100
        elif symbol.startswith("np_it"):
            mine = round(mine * scene.time.frame, 9)
        elif symbol == "n_r":
            number = number if COLUMN[name] > 1 else number[name == "closeup_thesis"]
        found[symbol], expected[symbol] = mine, number
    assert found == expected
    assert len(found) == 32 - 6 * (COLUMN[name] > 1)


def test_table_is_as_long_as_the_thesis():
    assert len(TABLE) == 32
    assert {film.name for film in FILMS if film.name.endswith("_thesis")} == set(COLUMN)

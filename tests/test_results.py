"""What a run left can be listed, checked, summarised, thinned and handed on, by one command."""

import csv
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

from solver import estimate
from solver.files import read_snapshot, snapshot_path
from solver.results.__main__ import main
from solver.xdmf import Index
from tests.fire_case import build

pytestmark = pytest.mark.serial

SCENE = """
[domain]
cells = [6, 5, 4]
size = [0.6, 1.0, 1.6]
[time]
end = 0.03
frame = 0.01
[initial]
T = "x + 10*y"
[detonation]
position = [0.3, 0.5, 0.8]
[fuel]
particles = 400
ignited = 5
rate = 4000.0
mass = 1e-6
[soot]
[[body]]
name = "pane"
shape = "pane"
size = [0.4, 0.4, 0.02]
place = [0.3, 0.5, 1.2]
points = 10
areal_density = 1.0
velocity = [0.0, 0.0, 1.0]
fracture = { method = "bfs", pieces = 2 }
"""


def simulate(folder, out, *overrides):
    options = [word for override in overrides for word in ("--set", override)]
    subprocess.run([sys.executable, "-m", "solver", folder / "scene.toml", "-o", folder / out,
                    "--fragments", folder / "fragments.h5", *options], check=True,
                   capture_output=True)
    return folder / out


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("results")
    (made / "scene.toml").write_text(SCENE)
    subprocess.run([sys.executable, "-m", "partition", made / "scene.toml", "-o",
                    made / "fragments.h5"], check=True, capture_output=True)
    simulate(made, "out")
    return made


@pytest.fixture
def out(folder, tmp_path):
    shutil.copytree(folder / "out", tmp_path / "out")
    return tmp_path / "out"


def said(capsys, *words):
    code = main([str(word) for word in words])
    return code, *capsys.readouterr()


def test_a_run_is_listed_verified_and_summarised(out, capsys):
    code, text, _ = said(capsys, "list", out)
    assert code == 0 and text.count("snap_") == 4 and "2 pieces" in text
    number = len(read_snapshot(out, 3, ()).particles["fuel"]["id"])
    assert f"{number} fuel" in text
    code, text, _ = said(capsys, "verify", out)
    assert code == 0 and text == "all 6 files are whole\n"
    (out / "checkpoints/SHA256SUMS").unlink()
    code, text, _ = said(capsys, "verify", out)
    assert code == 0 and text == "all 6 files are whole (only opened, without a checksum: 1)\n"
    code, text, _ = said(capsys, "summary", out)
    values = read_snapshot(out, 3).fields["T"].values
    assert code == 0 and f"{values.min():.6g} to {values.max():.6g}" in text and "done" in text


def test_what_is_damaged_or_missing_is_named(out, capsys):
    data = bytearray(snapshot_path(out, 1).read_bytes())
    data[len(data) // 2] ^= 1
    snapshot_path(out, 1).write_bytes(data)
    snapshot_path(out, 2).unlink()
    code, text, _ = said(capsys, "verify", out)
    assert code == 1 and "snap_000001.h5: damaged" in text and "snap_000002.h5: missing" in text
    assert "snap_000000" not in text and "snap_000003" not in text


@pytest.mark.parametrize("words, complaint", [
    (["list", "nowhere"], "holds no run"), (["summary", "nowhere"], "holds no snapshots"),
    (["convert", "{out}", "--to", "csv", "-o", "{out}/snapshots/x"], "holds the run itself"),
    (["convert", "{out}", "--to", "csv", "-o", "{out}/scene.toml"], "is a file"),
    (["convert", "{out}", "--to", "csv", "-o", "{out}/csv", "--frames", "9"], "none of these"),
    (["convert", "{out}", "--to", "csv", "-o", "{out}/csv", "--frames", "a"], "not a range")])
def test_bad_input_is_one_line(out, capsys, words, complaint):
    code, text, errors = said(capsys, *(word.format(out=out) for word in words))
    assert code == 2 and text == "" and errors.count("\n") == 1
    assert errors.startswith("error: ") and complaint in errors and "fix:" in errors
    assert not (out / "snapshots/x").exists()


def test_a_format_whose_library_is_missing_says_how_to_get_it(out, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    code, _, errors = said(capsys, "convert", out, "--to", "usd", "-o", out / "usd")
    assert code == 2 and "pxr" in errors and "fix: bash runs/setup_ecosystem.sh" in errors


def test_tables_hold_the_particles(out, capsys):
    code, _, _ = said(capsys, "convert", out, "--to", "csv", "-o", out / "csv", "--frames", "1:3")
    assert code == 0 and len(list((out / "csv").glob("fuel_*.csv"))) == 2
    with open(out / "csv/fuel_000002.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    stored = read_snapshot(out, 2, ()).particles["fuel"]
    assert [float(row["z"]) for row in rows] == stored["position"][:, 2].tolist()


def test_the_index_of_a_run_grows_to_what_one_made_afterwards_is(out, capsys):
    grown = (out / "run.xdmf").read_text()
    code, text, _ = said(capsys, "index", out)
    assert code == 0 and "4 frames" in text and (out / "run.xdmf").read_text() == grown
    snapshot_path(out, 3).write_bytes(b"")
    assert Index(out).rebuild() == 3   # a damaged one is left out


def test_particles_are_thinned_by_their_ids_and_columns_chosen(folder):
    thin = simulate(folder, "thin", "output.thinning=0.25", 'output.columns=["mass"]',
                    'output.species=["fuel"]')
    kept = []
    for frame in range(4):
        whole, some = (read_snapshot(run, frame, ()).particles for run in (folder / "out", thin))
        assert set(some) == {"fuel"} and set(some["fuel"]) == {"position", "mass", "id"}
        ids = some["fuel"]["id"]
        rows = np.searchsorted(whole["fuel"]["id"], ids, sorter=np.argsort(whole["fuel"]["id"]))
        rows = np.argsort(whole["fuel"]["id"])[rows]
        np.testing.assert_array_equal(whole["fuel"]["position"][rows], some["fuel"]["position"])
        kept.append((set(ids.tolist()), set(whole["fuel"]["id"].tolist())))
        assert 0.15 < len(ids) / len(whole["fuel"]["id"]) < 0.35
    for chosen, _ in kept:   # whoever is chosen stays so while it lives
        assert all(chosen & living == some & chosen for some, living in kept)


def test_the_estimate_of_steps_is_that_of_the_run(folder):
    from solver.scene import load
    scene = load(folder / "out/scene.toml")
    lines = (folder / "out/run.log.jsonl").read_text().splitlines()
    made = json.loads(lines[-1])["step"]
    assert made / 3 <= estimate.steps(scene) <= 3 * made
    fast = build(initial={"u": "100*y"})
    assert estimate.steps(fast) > 10 * estimate.steps(build())
    fast = build(initial={"u": "100*y"}, domain={"cells": [64, 64, 64]})
    assert estimate.seconds(fast, 2, 2, 1e-8) < estimate.seconds(fast, 1, 2, 1e-8)
    assert estimate.seconds(fast, 2, 1, 1e-8) == estimate.seconds(fast, 1, 1, 1e-8)

"""A small portion of `python -m runs stress`, and that it would notice what it looks for."""

import tomllib

import numpy as np
import pytest

from runs.stress import fuzz, generate, kills, malformed, soak
from runs.stress.__main__ import PARTS, README, parser
from runs.stress.launch import Job, Lasting, alive
from runs.stress.result import Result
from solver import scene as scenes

pytestmark = pytest.mark.serial


def test_three_kills(tmp_path):
    result, = kills.main(tmp_path / "kills", 0.06)
    assert result.tried == 3 and result.failures == []


def test_random_scenes_are_valid_varied_and_the_same_for_a_seed():
    built = [scenes.build(generate.valid_scene(seed)) for seed in range(60)]
    assert generate.valid_scene(5) == generate.valid_scene(5)
    assert {scene.time.integrator for scene in built} == set(generate.INTEGRATORS)
    assert {scene.fluid.advection for scene in built} == set(generate.SCHEMES)
    for has in (lambda s: s.fuel, lambda s: s.soot, lambda s: s.body, lambda s: s.fluid.source,
                lambda s: s.domain.cells[2] == 1, lambda s: s.is_closed):
        assert 0 < sum(map(bool, map(has, built))) < 60


@pytest.mark.parametrize("program, words", [
    ("open('{away}', 'w').close()", "open"), ("import os; os.system('touch {away}')", "os.system"),
    ("import os; os.mkdir('{away}')", "os.mkdir"), ("open('{out}/file', 'w').close()", ""),
    ("import subprocess; subprocess.run(['touch', '{away}'])", "subprocess.Popen")])
def test_what_a_program_does_outside_its_folder_is_seen(tmp_path, monkeypatch, program, words):
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "program.py").write_text(program.format(away=tmp_path / "away", out=out))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    job = Job(0, ("-m", "runs.stress.watched", str(tmp_path / "harm"), str(out), "program"),
              tmp_path / "log")
    assert job.end(30) == 0, job.output()
    harm = (tmp_path / "harm").read_text()
    assert (words in harm and "away" in harm) if words else harm == ""


def test_a_damaged_scene_is_a_clear_error(tmp_path):
    (tmp_path / "scene.toml").write_text('[time]\nend = 1.0\nframe = 0.1\n[initial]\n'
                                         f'u = "open(\'{fuzz.TRAP}\', \'w\')"\n')
    assert malformed.attempt(tmp_path, "solver") == ("", 2)


def test_what_lasts_is_ended(tmp_path):
    job = Job(0, ("-c", "import time; time.sleep(60)"), tmp_path / "log")
    pid, = job.pids()
    with pytest.raises(Lasting):
        job.end(0.1)
    assert not alive(pid)


@pytest.mark.parametrize("memory, files, failures", [(101, 9, 0), (103, 9, 1), (100, 10, 1)])
def test_growth_is_noticed(tmp_path, memory, files, failures):
    samples = {500: [[(99, 10), (100, 9)], [(100, 9), (90, 12)]],
               5000: [[(memory, files), (100, 9)]]}
    assert len(soak.judge(samples, 5000, 0, tmp_path).failures) == failures


def test_a_soak_that_ended_early_has_failed(tmp_path):
    assert len(soak.judge({500: [[(100, 9), (100, 9)]]}, 5000, 1, tmp_path).failures) == 2


def test_the_table_says_how_often_it_held():
    result = Result("tried", "must", 3, ["no"], "found")
    assert result.row() == "| tried | must | 2 of 3 | found |"
    assert all(f"`{name}`" in README.read_text(encoding="utf-8") for name in PARTS)
    assert parser().parse_args(["kills", "--share", "0.5"]).share == 0.5


def test_damage_depends_on_the_seed_alone():

    text = malformed.valid_scenes()[0]
    twice = [fuzz.damaged(text, tomllib.loads(text), np.random.default_rng(4)) for _ in range(2)]
    assert twice[0] == twice[1] and twice[0] != text.encode()

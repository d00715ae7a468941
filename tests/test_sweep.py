"""A sweep: a table of overrides, one folder each, resumable, with a summary; none is run twice."""

import csv
import json
import os
import tomllib

import pytest

from runs.sweep import run, summary, table
from runs.sweep.__main__ import main
from runs.sweep.table import TableError

pytestmark = pytest.mark.serial

SCENE = """
[domain]
cells = [8, 8, 8]
[time]
end = 0.02
frame = 0.01
[initial]
noise = 0.3
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "base.toml").write_text(SCENE)
    return tmp_path


def read(folder, text, name="table.toml"):
    (folder / name).write_text(text)
    return table.read(folder / name)


def test_a_grid_is_all_combinations_and_rows_come_after(folder):
    cases = read(folder, 'scene = "base.toml"\n[grid]\nseed = [1, 2, 3]\n"initial.noise" = '
                 '[0.1, 0.2]\n[[row]]\nname = "walls"\n"domain.boundary" = "wall"')
    assert [case.name for case in cases] == ["0", "1", "2", "3", "4", "5", "walls"]
    assert [(case.scene.seed, case.scene.initial.noise) for case in cases[:3]] == [
        (1, 0.1), (1, 0.2), (2, 0.1)]
    assert cases[6].scene.domain.boundary == "wall"
    assert cases[6].overrides == ['domain.boundary="wall"']


def test_a_csv_says_the_same(folder):
    cases = read(folder, '# scene = "base.toml"\nname,seed,domain.cells,domain.boundary\n'
                 'small,3,"[8, 9, 10]",wall\n', "table.csv")
    assert cases[0].name == "small" and cases[0].scene.seed == 3
    assert cases[0].scene.domain.cells == (8, 9, 10)
    assert cases[0].scene.domain.boundary == "wall"


@pytest.mark.parametrize("value", [1, 2.5, "text", [1, 2], {"wall": [0.0, 1.0, 0.0]}, True,
                                   float("inf"), [["a"], []]])
def test_values_are_written_as_toml(value):

    assert tomllib.loads(f"v = {table.as_toml(value)}")["v"] == value


@pytest.mark.parametrize("text, word", [
    ("", "scene"), ('scene = "none.toml"\n[grid]\nseed = [1]', "no such scene file"),
    ('scene = "base.toml"', "no run"), ('scene = "base.toml"\n[grid]\nseed = 1', "list of values"),
    ('scene = "base.toml"\nrows = 1', "rows"), ("scene = ", "TOML"),
    ('scene = "base.toml"\n[[row]]\nname = "../up"', "letters, digits"),
    ('scene = "base.toml"\n[[row]]\nname = "a"\n[[row]]\nname = "a"', "no other"),
    ('scene = "base.toml"\n[[row]]\n"time.ends" = 1.0', "time.ends")])
def test_bad_tables_are_one_line_and_nothing_runs(folder, text, word, capsys):
    (folder / "table.toml").write_text(text)
    assert main([str(folder / "table.toml"), "-o", str(folder / "out")]) == 2
    error = capsys.readouterr().err
    assert word in error and error.count("\n") == 1 and not (folder / "out").exists()
    with pytest.raises(TableError):
        table.read(folder / "table.toml")


def test_it_runs_what_is_left_and_goes_on_with_what_was_stopped(folder, capsys, monkeypatch):
    for name in [name for name in os.environ if name.startswith(("OMPI_", "PMIX_"))]:
        monkeypatch.delenv(name)     # this process looks like a rank to mpirun
    out, path = folder / "out", folder / "table.toml"
    path.write_text('scene = "base.toml"\n[grid]\n"initial.noise" = [0.1, 0.2]\n[[row]]\n'
                    'name = "bad"\n"initial.u" = "1/(x-x)"')
    start = [str(path), "-o", str(out), "--ranks", "1"]
    assert main([*start, "--only", "1", "--", "--walltime", "1h", "--walltime-margin", "1h"]) == 85
    cases = table.read(path)
    assert [summary.row(case, out / case.name)["state"] for case in cases] == [
        "to do", "stopped", "to do"]
    assert main(start) == 1                      # "bad" fails, the others run
    assert "not finite" in capsys.readouterr().err
    assert [run.is_done(case, out / case.name) for case in cases] == [True, True, False]
    assert "continues from" in (out / "1" / "sweep.log").read_text()
    rows = list(csv.DictReader((out / "summary.csv").read_text().splitlines()))
    assert [row["state"] for row in rows[:2]] == ["done", "done"] and rows[0]["initial.noise"] == \
        "0.1" and float(rows[0]["energy"]) < float(rows[1]["energy"])
    assert (out / "summary.png").stat().st_size > 1000
    log = (out / "0" / "sweep.log").read_text()
    main([*start, "--only", "0"])
    assert (out / "0" / "sweep.log").read_text() == log     # done: not run again
    assert json.loads((out / "0" / "status.json").read_text())["state"] == "done"

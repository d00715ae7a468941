"""Damaged HDF5 files: one clear line, nothing written, no crash and no hang, whoever reads them.

Each case starts from a good file and makes it wrong: cut short, bytes flipped, datasets of another
type or shape, or gone, claims beyond the file's size, links that leave the file or go in circles.
Every command gets its cases in one process, which a crash would end.
"""

import json
import shutil
import subprocess
import sys
import threading

import h5py
import numpy as np
import pytest

from partition.fragments import FORMAT
from solver.files import SNAPSHOT, checkpoint_paths, seal, snapshot_path
from solver.files_checksum import check

pytestmark = pytest.mark.serial
LONGEST = 120   # s, of one command: a hang

SCENE = """
[domain]
cells = [6, 6, 6]
[time]
end = 0.02
frame = 0.01
[initial]
T = "x"
[detonation]
position = [0.5, 0.5, 0.5]
[fuel]
particles = 20
ignited = 2
mass = 1e-5
[[body]]
name = "pane"
shape = "pane"
size = [0.4, 0.4, 0.02]
place = [0.5, 0.5, 0.7]
points = 10
areal_density = 1.0
fracture = { method = "bfs", pieces = 2 }
[render]
width = 8
height = 8
"""


def cut(fraction):
    def damage(path):
        data = path.read_bytes()
        path.write_bytes(data[:int(fraction * len(data))])
    return damage


def flipped(seed, share):
    """Bytes of the file's structure (its first part) or anywhere, turned over."""
    def damage(path):
        data = bytearray(path.read_bytes())
        random = np.random.default_rng(seed)
        for place in random.integers(0, int(share * len(data)), 12):
            data[place] ^= int(random.integers(1, 256))
        path.write_bytes(bytes(data))
    return damage


def replaced(name, make):
    """A dataset made anew by `make(group, name, old values)`."""
    def damage(path):
        with h5py.File(path, "r+") as file:
            if name not in file:
                return
            values = file[name][()] if isinstance(file[name], h5py.Dataset) else None
            attributes = dict(file[name].attrs)
            del file[name]
            group, _, last = name.rpartition("/")
            made = make(file.require_group(group) if group else file, last, values)
            if made is not None:
                made.attrs.update(attributes)
    return damage


def attribute(name, key, value):
    def damage(path):
        with h5py.File(path, "r+") as file:
            if name in file:
                if value is None:
                    file[name].attrs.pop(key, None)
                else:
                    file[name].attrs[key] = value
    return damage


def gone(_group, _name, _values):
    return None


def text(group, name, values):
    return group.create_dataset(name, data=np.full(values.shape, b"x"))


def objects(group, name, _values):
    return group.create_dataset(name, (3,), h5py.string_dtype())


def scalar(group, name, _values):
    return group.create_dataset(name, data=1.0)


def shorter(group, name, values):
    return group.create_dataset(name, data=values[:-1])


def empty(group, name, values):
    return group.create_dataset(name, (0,) * values.ndim, values.dtype)


def huge(group, name, values):
    return group.create_dataset(name, (1 << 40,) + (1,) * (values.ndim - 1), values.dtype,
                                chunks=(1024,) + (1,) * (values.ndim - 1))


def not_finite(group, name, values):
    return group.create_dataset(name, data=np.full(values.shape, np.nan))


def out_of_range(group, name, values):
    return group.create_dataset(name, data=values + 10**6)


def external_link(group, name, _values):
    group[name] = h5py.ExternalLink("/etc/passwd", "/x")


def soft_circle(group, name, _values):
    group[name] = h5py.SoftLink(f"{group.name}/{name}")


def group_circle(group, name, _values):
    inner = group.create_group(name)
    inner["again"] = inner


def external_storage(group, name, values):
    return group.create_dataset(name, values.shape, values.dtype,
                                external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])


def virtual(group, name, values):
    layout = h5py.VirtualLayout(values.shape, values.dtype)
    layout[...] = h5py.VirtualSource("/etc/passwd", "x", values.shape, values.dtype)
    return group.create_virtual_dataset(name, layout)


ANYWHERE = {f"cut at {share}": cut(share) for share in (0, 0.001, 0.1, 0.5, 0.9, 0.999)}
ANYWHERE |= {f"flipped {seed}": flipped(seed, share)
             for seed, share in enumerate([0.02, 0.05, 0.1, 0.1, 0.2, 0.3, 0.5, 1, 1, 1])}
ANYWHERE |= {"not HDF5": lambda path: path.write_text("no HDF5"),
             "another format": attribute("/", "format", "brisance-other"),
             "format a number": attribute("/", "format", 3.0),
             "not complete": attribute("/", "complete", None)}
KINDS = {f.__name__: f for f in (gone, text, objects, scalar, shorter, empty, huge, not_finite,
                                 external_link, soft_circle, group_circle, external_storage,
                                 virtual)}
FRAGMENTS = ANYWHERE | {f"{name} {kind}": replaced(name, make) for kind, make in KINDS.items()
                        for name in ("vertices", "faces")}
FRAGMENTS |= {"faces out of range": replaced("faces", out_of_range),
              "names gone": replaced("names", gone), "body gone": replaced("body", gone)}
SNAPSHOTS = ANYWHERE | {f"{name} {kind}": replaced(name, make) for kind, make in KINDS.items()
                        for name in ("fields/T", "bodies/position")}
SNAPSHOTS |= {"no time": attribute("/", "time", None), "time a text": attribute("/", "time", "x"),
              "no spacing": attribute("fields/T", "spacing", None),
              "spacing 0": attribute("fields/T", "spacing", [0.0, 0.0, 0.0]),
              "origin a text": attribute("fields/T", "origin", "x"),
              "fields gone": replaced("fields", gone), "bodies gone": replaced("bodies", gone),
              "particles gone": replaced("particles", gone),
              "position shorter": replaced("particles/fuel/position", shorter)}
CHECKPOINTS = ANYWHERE | {f"{name} {kind}": replaced(name, make) for kind, make in KINDS.items()
                          for name in ("fields/u", "particles/mass") if kind != "not_finite"}
CHECKPOINTS |= {"scene gone": replaced("scene", gone), "no step": attribute("/", "step", None),
                "ranks a text": attribute("/", "ranks", "x")}

# Runs main() of a command once per line of input, so that its imports are paid for once.
MANY = """
import contextlib, importlib, io, json, sys, traceback
module = importlib.import_module(sys.argv[1] + ".__main__")
for line in sys.stdin:
    said, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(errors):
        sys.argv[1:] = json.loads(line)
        try:
            code = module.main()
        except BaseException:
            code = traceback.format_exc()
    print("CASE" + json.dumps([code, said.getvalue(), errors.getvalue()]), flush=True)
"""


class Commands:
    """One process per program, for all tests of this file."""

    def __init__(self):
        self.processes = {}

    def run_many(self, module, commands):
        """(exit code or traceback, output, errors) of each command line."""
        if module not in self.processes:
            self.processes[module] = subprocess.Popen(
                [sys.executable, "-c", MANY, module], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        process, found = self.processes[module], []
        for words in commands:
            process.stdin.write(json.dumps([str(word) for word in words]) + "\n")
            process.stdin.flush()
            watchdog = threading.Timer(LONGEST, process.kill)
            watchdog.start()
            line = next((line for line in process.stdout if line.startswith("CASE")), None)
            watchdog.cancel()
            assert line is not None, f"the process ended at {words}"
            found.append(json.loads(line[4:]))
        return found

    def end(self):
        for process in self.processes.values():
            process.kill()
            process.communicate()


@pytest.fixture(scope="module")
def run_many():
    commands = Commands()
    yield commands.run_many
    commands.end()


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    folder = tmp_path_factory.mktemp("good")
    scene = folder / "scene.toml"
    scene.write_text(SCENE)
    for words in (["partition", scene, "-o", folder / "out/fragments.h5"],
                  ["solver", scene, "-o", folder / "out"]):
        subprocess.run([sys.executable, "-m", *words], check=True, capture_output=True)
    return folder


def prepared(good, folder, cases, of):
    """A copy of the run for every case, damaged; and what each copy holds, by name."""
    outs = []
    for number, (name, damage) in enumerate(cases.items()):
        out = folder / f"case{number}"
        shutil.copytree(good / "out", out)
        if not name.startswith("flipped"):   # HDF5 itself may crash: only a checksum helps
            (out / "snapshots/SHA256SUMS").unlink()
            (out / "checkpoints/SHA256SUMS").unlink()
        damage(of(out))
        outs.append(out)
    return outs, [contents(out) for out in outs]


def contents(out):
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*"))
            if path.is_file()}


def assert_refused(name, result, allowed=(2,)):
    code, _, errors = result
    assert code in allowed, f"{name}: {code} {errors}"
    assert errors.startswith("error: ") and errors.count("\n") == 1, f"{name}: {errors}"
    assert "fix:" in errors and "Traceback" not in errors, f"{name}: {errors}"


# What cannot be told from good without a checksum: numbers in place of other numbers.
HARMLESS = ("flipped", "not_finite", "gone", "shorter", "empty", "cut")


def judge(cases, results, harmless=HARMLESS):
    refused = 0
    for name, result in zip(cases, results, strict=True):
        if result[0] == 0 and any(word in name for word in harmless):
            continue
        assert_refused(name, result)
        refused += 1
    assert refused >= 0.6 * len(cases)


def test_the_solver_refuses_damaged_fragments(good, tmp_path, run_many):
    outs, before = prepared(good, tmp_path, FRAGMENTS, lambda out: out / "fragments.h5")
    commands = [[good / "scene.toml", "-o", tmp_path / f"new{n}", "--fragments",
                 out / "fragments.h5", "--set", "time.end=0.01"] for n, out in enumerate(outs)]
    results = run_many("solver", commands)
    judge(FRAGMENTS, results, tuple(word for word in HARMLESS if word != "flipped"))
    for number, (result, out) in enumerate(zip(results, outs, strict=True)):
        assert contents(out) == before[number]
        assert result[0] == 0 or not (tmp_path / f"new{number}").exists()


@pytest.fixture(scope="module")
def damaged(good, tmp_path_factory):
    """Runs with one damaged snapshot each, for commands that only read."""
    return prepared(good, tmp_path_factory.mktemp("damaged"), SNAPSHOTS,
                    lambda out: snapshot_path(out, 2))


@pytest.mark.parametrize("words", [["list"], ["summary"], ["verify"], ["convert", "--to", "csv"],
                                   ["convert", "--to", "vtkhdf"]], ids=" ".join)
def test_the_results_of_a_damaged_run_are_refused(damaged, tmp_path, run_many, words):
    outs, before = damaged
    target = [["-o", tmp_path / f"to{n}"] if "convert" in words else [] for n in range(len(outs))]
    results = run_many("solver.results", [[words[0], out, *words[1:], *more]
                                          for out, more in zip(outs, target, strict=True)])
    assert [contents(out) for out in outs] == before
    for name, result in zip(SNAPSHOTS, results, strict=True):
        if words[0] in ("list", "verify"):
            assert result[0] in (0, 1) and not result[2], f"{name}: {result}"
        elif result[0] != 0:
            assert_refused(name, result)
    if words[0] not in ("list", "verify"):
        assert sum(result[0] == 2 for result in results) >= 0.4 * len(results)


def test_the_renderer_refuses_damaged_snapshots(damaged, tmp_path, run_many):
    outs, before = damaged
    results = run_many("render", [[out, "--frames", "2", "-o", tmp_path / f"f{n}"]
                                  for n, out in enumerate(outs)])
    judge(SNAPSHOTS, results, (*HARMLESS, "particles gone"))
    assert [contents(out) for out in outs] == before


def test_a_restart_from_a_damaged_checkpoint_is_refused_or_goes_back(good, tmp_path, run_many):
    outs, _ = prepared(good, tmp_path, CHECKPOINTS, lambda out: checkpoint_paths(out)[-1])
    results = run_many("solver", [[good / "scene.toml", "-o", out, "--restart"] for out in outs])
    for name, result in zip(CHECKPOINTS, results, strict=True):
        if result[0] != 0:
            assert_refused(name, result, (2, 1))


def test_a_damaged_file_is_known_by_its_checksum(good, tmp_path, run_many):
    """With SHA256SUMS in place every change is found, also of numbers into other numbers."""
    out = tmp_path / "out"
    shutil.copytree(good / "out", out)
    path = snapshot_path(out, 1)
    whole = path.read_bytes()
    assert check(path, SNAPSHOT) == ""
    for place in np.linspace(0, len(whole) - 1, 40).astype(int):
        data = bytearray(whole)
        data[place] ^= 1
        path.write_bytes(bytes(data))
        assert check(path, SNAPSHOT), place
    code, said, _ = run_many("solver.results", [["verify", out]])[0]
    assert code == 1 and "snap_000001.h5: damaged" in said and "files are whole" in said


def test_fragments_are_known_by_their_checksum(good, tmp_path):
    """They travel alone: it stands at their end, and every change before it is found."""
    whole = (good / "out/fragments.h5").read_bytes()
    path = tmp_path / "moved.h5"
    path.write_bytes(whole)
    assert check(path, FORMAT) == ""
    for place in np.linspace(0, len(whole) - len(seal(b"")) - 1, 60).astype(int):
        data = bytearray(whole)
        data[place] ^= 1
        path.write_bytes(bytes(data))
        assert "damaged" in check(path, FORMAT), place

"""`python -m runs` redoes what is out of date, and nothing else.

The three programs are replaced by quick ones that write down what they were given, so that the
products change exactly when what they are made from does.
"""

import json
import os

import pytest

from runs import chain
from solver import scene as scenes

SCENE = """
title = "a test"
[time]
end = 0.2
frame = 0.1
[[body]]
name = "pane"
shape = "mesh"
mesh = "pane.stl"
areal_density = 1.0
[render]
width = 30
"""


class Programs:
    """Stand-ins for the three programs; `ran` lists the stages in the order in which they ran."""

    def __init__(self, out):
        self.out = out
        self.scene = None
        self.ran = []
        self.commands = {}
        self.frames = 2
        self.fails = ""
        self.kept = []  # frames that the renderer found

    def __call__(self, command, name):
        self.ran.append(name)
        self.commands[name] = command
        if name == self.fails:
            raise chain.StageFailed(name, 7)
        sections = {stage.name: stage.sections
                    for stage in chain.stages(self.scene, self.out, 2, ())}
        given = json.dumps(sections[name], sort_keys=True)
        if name == "partition":
            self.write("fragments.h5", json.dumps(sections[name]["[[body]]"]))
        elif name == "solver":
            for frame in range(self.frames):
                self.write(f"snapshots/snap_{frame:06d}.h5", given)
        else:
            self.kept = sorted(path.name for path in self.out.glob("frames/*.png"))
            for path in self.out.glob("snapshots/*.h5"):
                self.write(f"frames/{path.stem.replace('snap', 'frame')}.png", given)
            self.write("scene.mp4", given)
        return 0.0

    def write(self, name, text):
        path = self.out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


class Case:
    """A scene with a mesh in a folder; `run()` chains it and says which programs ran."""

    def __init__(self, folder, monkeypatch):
        self.folder = folder
        self.out = folder / "out"
        self.programs = Programs(self.out)
        self.edit(SCENE)
        (folder / "pane.stl").write_text("a mesh", encoding="utf-8")
        monkeypatch.setattr(chain, "_execute", self.programs)

    def edit(self, text):
        (self.folder / "scene.toml").write_text(text, encoding="utf-8")

    def run(self, **options):
        self.programs.ran = []
        self.programs.scene = scenes.load(self.folder / "scene.toml")
        chain.run(self.programs.scene, self.out, ranks=2, **options)
        return self.programs.ran


pytestmark = pytest.mark.serial

ALL = ["partition", "solver", "render"]


@pytest.fixture
def case(tmp_path, monkeypatch):
    return Case(tmp_path, monkeypatch)


def test_first_run_does_all_and_the_second_nothing(case):
    assert case.run() == ALL
    assert case.run() == []
    assert case.run(force=True) == ALL


@pytest.mark.parametrize("old, new, stages", [
    ("width = 30", "width = 40", ["render"]),
    ("frame = 0.1", "frame = 0.05", ["solver", "render"]),
    ('shape = "mesh"', 'shape = "mesh"\nscale = 2.0', ALL),
    ("areal_density = 1.0", "areal_density = 2.0", ["solver", "render"]),
    ('title = "a test"', 'title = "another"', ["solver", "render"]),
    ('shape = "mesh"', 'shape = "mesh"\nmaterial = "glass"', ["render"]),
    ("frame = 0.1", "frame = 0.10  # a comment", []),
])
def test_change_in_the_scene_redoes_what_depends_on_it(case, old, new, stages):
    case.run()
    case.edit(SCENE.replace(old, new))
    assert case.run() == stages
    assert case.run() == []


def test_touched_files_redo_nothing(case):
    case.run()
    for path in [case.folder / "pane.stl", case.folder / "scene.toml",
                 *case.out.rglob("*.h5"), *case.out.rglob("*.png")]:
        os.utime(path, ns=(0, 10**18))
    assert case.run() == []


def test_changed_mesh_is_cut_again(case):
    case.run()
    (case.folder / "pane.stl").write_text("another", encoding="utf-8")
    assert case.run() == ["partition", "solver"]  # the snapshots came out the same


def test_chain_stops_where_a_stage_gives_the_same_result(case):
    case.run()
    (case.out / "fragments.h5").write_text("damaged", encoding="utf-8")
    assert case.run() == ["partition"]


@pytest.mark.parametrize("name", ["snapshots/snap_000001.h5", "fragments.h5", "scene.mp4"])
def test_lost_product_is_made_again(case, name):
    case.run()
    (case.out / name).unlink()
    assert len(case.run()) == 1
    assert (case.out / name).is_file()
    assert case.run() == []


def test_changed_code_redoes_its_stage(case, monkeypatch):
    for path in ("partition/a.py", "solver/a.py", "solver/scene.py", "render/a.py"):
        (case.folder / path).parent.mkdir(exist_ok=True)
        (case.folder / path).write_text("1", encoding="utf-8")
    monkeypatch.setattr(chain, "ROOT", case.folder)
    case.run()
    (case.folder / "render/a.py").write_text("2", encoding="utf-8")
    assert case.run() == ["render"]
    (case.folder / "solver/scene.py").write_text("2", encoding="utf-8")
    assert case.run() == ALL


def test_failed_stage_ends_the_chain_and_is_tried_again(case):
    case.programs.fails = "solver"
    with pytest.raises(chain.StageFailed) as failure:
        case.run()
    assert failure.value.code == 7
    assert case.programs.ran == ["partition", "solver"]
    case.programs.fails = ""
    assert case.run() == ["solver", "render"]


def test_run_made_by_hand_is_not_overwritten(case):
    """The solver refuses a folder that holds a run, unless this chain made it."""
    case.run()
    assert "--overwrite" not in case.programs.commands["solver"]
    case.edit(SCENE.replace("frame = 0.1", "frame = 0.05"))
    case.run()
    assert "--overwrite" in case.programs.commands["solver"]
    (case.out / "made.json").unlink()
    case.run()
    assert "--overwrite" not in case.programs.commands["solver"]


def test_redone_stage_leaves_nothing_old(case):
    case.programs.frames = 5
    case.run()
    case.programs.frames = 2
    assert case.run(force=True) == ALL
    assert len(list((case.out / "snapshots").iterdir())) == 2
    assert len(list((case.out / "frames").iterdir())) == 2
    assert case.programs.kept == []


def test_renderer_is_left_the_frames_it_may_reuse(case):
    case.programs.frames = 3
    case.run()
    case.programs.frames = 2
    case.edit(SCENE.replace("end = 0.2", "end = 0.1"))
    assert case.run() == ["solver", "render"]
    assert case.programs.kept == ["frame_000000.png", "frame_000001.png"]


def test_stage_that_makes_nothing_has_failed(case):
    case.programs.frames = 0
    with pytest.raises(chain.StageFailed, match="made no snapshots"):
        case.run()


def test_scene_pays_only_for_what_it_has(case):
    case.edit("[time]\nend = 0.2\nframe = 0.1\n")
    assert case.run() == ["solver"]


def test_damaged_record_redoes_everything(case):
    case.run()
    (case.out / "made.json").write_text("{", encoding="utf-8")
    assert case.run() == ALL


def test_programs_are_given_the_same_scene_and_files(case):
    scene = scenes.load(case.folder / "scene.toml", ["time.end=0.1"])
    commands = {stage.name: stage.command
                for stage in chain.stages(scene, case.out, 3, ["time.end=0.1"])}
    for name, command in commands.items():
        assert command[command.index("-m") + 1] == name
        assert str(case.folder / "scene.toml") in command
        assert command[command.index("--set") + 1] == "time.end=0.1"
    assert commands["solver"][:4] == ("mpirun", "--oversubscribe", "-n", "3")
    assert str(case.out / "fragments.h5") in commands["partition"]
    assert str(case.out / "fragments.h5") in commands["solver"]

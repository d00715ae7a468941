"""From a scene to its video: partition, solver and render in turn, each only if it is out of date.

    SCENE ─ partition ─> OUT/fragments.h5 ─ solver ─> OUT/snapshots/ ─ render ─> OUT/frames/, video

A stage reads some sections of the scene, some files, and its own code; `stages` says which. They
are separate programs joined by files: each can be run alone, with its own number of ranks.
"""

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from runs.ranks import environment, mpirun
from runs.record import Digests, Record, digest_of
from solver.files import snapshot_frames
from solver.scene import Scene, named_files

ROOT = Path(__file__).resolve().parent.parent
SHARED_CODE = ("solver/scene*.py", "solver/schema.py", "solver/files*.py", "partition/fragments.py")

# Keys of a body that say how it moves or looks: no reason to cut it again.
NOT_SHAPE = {"density", "areal_density", "force", "velocity", "spin", "material", "laws",
             "deform_until"}
MOST_RANKS_BY_DEFAULT = 4


@dataclass(frozen=True)
class Stage:
    """One program of the chain.

    skipped   why the scene does not need it; empty: it does
    command   what to run
    sections  the parts of the scene it depends on, by name
    inputs    the files it reads, as patterns relative to OUT
    products  the files it makes, likewise
    reusable  of these, files that the program itself checks, and keeps where they are still right
    to_replace  what to add to the command where this chain made the old products
    """

    name: str
    skipped: str
    command: tuple[str, ...]
    sections: dict[str, Any]
    inputs: tuple[str, ...]
    products: tuple[str, ...]
    reusable: frozenset[str] = frozenset()
    to_replace: tuple[str, ...] = ()


class StageFailed(Exception):
    """A stage ended without its result; `code` is what to exit with."""

    def __init__(self, name: str, code: int, why: str = ""):
        super().__init__(f"{name} {why or f'failed with exit code {code}'}")
        self.code = code


def default_ranks() -> int:
    """As many ranks as there are cores for us, but no more than small grids profit from."""
    return min(len(os.sched_getaffinity(0)), MOST_RANKS_BY_DEFAULT)


def video_name(scene: Scene) -> str:
    """The video of NAME.toml is OUT/NAME.mp4."""
    return f"{scene.path.stem}.mp4"


def stages(scene: Scene, out: Path, ranks: int, overrides: Sequence[str]) -> Iterator[Stage]:
    """The chain for a scene; a stage is asked for once those before it are up to date."""
    data = scene.model_dump(mode="json")
    render, bodies = data.pop("render"), data.pop("body")
    shapes = [{key: body[key] for key in body.keys() - NOT_SHAPE} for body in bodies]
    looks = [{key: body[key] for key in body.keys() & {"name", *NOT_SHAPE}} for body in bodies]
    motions = [{key: body[key] for key in body.keys() - {"material"}} for body in bodies]

    chosen = [part for override in overrides for part in ("--set", override)]
    fragments = ("fragments.h5",) if bodies else ()
    video = video_name(scene)

    yield Stage(
        "partition", "" if bodies else "the scene has no [[body]]",
        (sys.executable, "-m", "partition", str(scene.path), *chosen,
         "-o", str(out / "fragments.h5")),
        {"seed": data["seed"], "[detonation]": data["detonation"], "[[body]]": shapes},
        (), fragments)
    sections = {f"[{name}]" if isinstance(part, dict) else name: part
                for name, part in data.items()}
    yield Stage(
        "solver", "",
        (*mpirun(ranks), sys.executable, "-m", "solver", str(scene.path), *chosen, "-o", str(out),
         *(part for name in fragments for part in ("--fragments", str(out / name)))),
        sections | {"[[body]]": motions}, fragments, ("snapshots/*.h5",),
        to_replace=("--overwrite",))
    yield Stage(
        "render", "" if render else "the scene has no [render]",
        (*mpirun(ranks), sys.executable, "-m", "render", str(out), "--scene", str(scene.path),
         *chosen, "-o", str(out / "frames"), "--video", str(out / video)),
        sections | {"[[body]]": looks, "[render]": render},
        (*fragments, "snapshots/*.h5"), ("frames/*.png", video),
        frozenset(f"frames/frame_{frame:06d}.png" for frame in snapshot_frames(out)))


def run(scene: Scene, out: Path, ranks: int, overrides: Sequence[str] = (),
        force: bool = False) -> Path | None:
    """Bring OUT up to date; returns the video, if the scene asks for one. Raises `StageFailed`."""
    record = Record(out)
    start = time.perf_counter()
    for stage in stages(scene, out, ranks, overrides):
        if stage.skipped:
            record.forget(stage.name)
            _say(stage, f"skipped: {stage.skipped}")
            continue
        sources = _sources(stage, scene, record)
        reason = "asked for by --force" if force else record.why_outdated(stage.name, sources)
        if not reason:
            _say(stage, "up to date")
            continue
        _say(stage, f"runs: {reason}")
        ours = force or record.knows(stage.name)
        record.begin(stage.name, frozenset() if force else stage.reusable)
        seconds = _execute((*stage.command, *(stage.to_replace if ours else ())), stage.name)
        products = _matches(out, stage.products)
        if not products:
            raise StageFailed(stage.name, 1, f"made no {stage.products[0]} in {out}")
        record.remember(stage.name, sources, products, seconds)
        _say(stage, f"done in {seconds:.1f} s")
    print(f"all of {out} is up to date after {time.perf_counter() - start:.1f} s")
    return out / video_name(scene) if scene.render else None


def is_outdated(scene: Scene, out: Path, ranks: int, overrides: Sequence[str] = ()) -> bool:
    """Whether `run` would have something to do."""
    record = Record(out)
    return any(record.why_outdated(stage.name, _sources(stage, scene, record))
               for stage in stages(scene, out, ranks, overrides) if not stage.skipped)


def _sources(stage: Stage, scene: Scene, record: Record) -> Digests:
    """Digests of everything the result of a stage depends on."""
    sections = {name: digest_of(part) for name, part in stage.sections.items()}
    named = record.file_digests(set(named_files(stage.sections, scene.path.parent)))
    inputs = record.file_digests(_matches(record.directory, stage.inputs))
    code = record.file_digests(_matches(ROOT, (f"{stage.name}/*.py", *SHARED_CODE)))
    return sections | named | inputs | {f"code of {stage.name}": digest_of(list(code.values()))}


def _matches(directory: Path, patterns: Sequence[str]) -> list[Path]:
    return sorted({path for pattern in patterns for path in directory.glob(pattern)})


def _execute(command: Sequence[str], name: str) -> float:
    """Run a program to its end; seconds it took. Ctrl-C and TERM reach it before they end us."""
    print("$", shlex.join(command), flush=True)
    start = time.perf_counter()
    try:
        process = subprocess.Popen(command, env=environment())
    except FileNotFoundError:
        raise StageFailed(name, 127, f"needs {command[0]}, which was not found; "
                          "fix: bash runs/setup.sh") from None

    def pass_on(number: int, _: FrameType | None) -> None:
        process.send_signal(number)

    before = {number: signal.signal(number, pass_on)
              for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2)}
    before[signal.SIGINT] = signal.signal(signal.SIGINT, signal.SIG_IGN)
    code = process.wait()
    for number, handler in before.items():
        signal.signal(number, handler)
    if code != 0:
        raise StageFailed(name, code if code > 0 else 128 - code)
    return time.perf_counter() - start


def _say(stage: Stage, text: str) -> None:
    print(f"{stage.name:<10} {text}", flush=True)

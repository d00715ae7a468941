"""Every animation of the gallery, from nothing: `python -m runs gallery [NAME…]`.

Each is a scene of `runs/scenes`: cut, run and filmed by `chain`, which does only what is out of
date; then a strip of its frames, the claims that `watch` checks in the stored numbers, and a row of
the table: what a frame costs here, beside what it cost in the thesis.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from runs import chain, strip, watch
from runs.record import Record
from solver import scene as scenes
from solver.files import snapshot_frames
from solver.scene import Scene

SCENES = Path(__file__).parent / "scenes"
Shrink = Callable[[Scene], Iterable[str]]   # what to change in a scene
WINDOW, COW = (892.0, 1680.0), (1.0, 125.0)   # the thesis' seconds per simulated, rendered frame


@dataclass(frozen=True)
class Film:
    """One animation.

    name     of its scene, its folder in OUT and its strip
    figure   of the thesis
    minutes  that it takes on two idle cores, from nothing, by the processor's seconds
    thesis   seconds that the thesis gives per simulated and per rendered frame; or not known
    claims   what must be seen in it
    """

    name: str
    figure: str
    minutes: float
    thesis: tuple[float, float] | None
    claims: tuple[Callable[[watch.Run], watch.Finding], ...] = ()


PANE = (watch.centre_first, watch.small_fly_faster)
FILMS = (
    Film("stirred", "5.1", 0.1, None, (watch.goes_round_outwards,)),
    Film("glass", "5.2", 0.7, None, (watch.centre_first, watch.comes_to_rest)),
    Film("window", "5.4", 1.5, WINDOW, (*PANE, watch.comes_to_rest, watch.red_to_yellow)),
    Film("window_thesis", "5.4", 0.5, WINDOW),
    Film("closeup", "5.5", 0.8, WINDOW, (*PANE, watch.red_to_yellow)),
    Film("closeup_thesis", "5.5", 0.6, WINDOW),
    Film("cow_head", "5.6", 0.5, COW, (watch.head_alone_breaks, watch.comes_to_rest)),
    Film("cow_head_thesis", "5.6", 0.4, COW, (watch.head_alone_breaks,)),
    Film("cow_balloon", "5.7", 0.5, COW, (watch.swells_before_it_bursts, watch.comes_to_rest)),
    Film("cow_balloon_thesis", "5.7", 0.4, COW, (watch.swells_before_it_bursts,)))
NAMES = tuple(film.name for film in FILMS)


def make(names: Sequence[str], out: Path, pictures: Path, ranks: int,
         shrink: Shrink | None = None) -> bool:
    """Make the named films (none: all) in OUT/NAME; returns whether all their claims hold.

    Raises `chain.StageFailed` and `SceneError`."""
    chosen = [film for film in FILMS if not names or film.name in names]
    out.mkdir(parents=True, exist_ok=True)
    announce(chosen, out, ranks, shrink)
    if not names or "diagrams" in names:
        subprocess.run((sys.executable, "-m", "partition.figures", "-o", str(pictures)), check=True)
    rows, good = [], True
    for film in chosen:
        print(f"\n{film.name}: figure {film.figure} of the thesis", flush=True)
        scene, changes = loaded(film, shrink)
        chain.run(scene, out / film.name, ranks, changes)
        run = watch.Run.read(out / film.name, scene)
        print(f"strip: {strip.make(run, pictures / f'{film.name}.jpg')}")
        for claim in film.claims:
            finding = claim(run)
            good &= finding.holds
            print(f"{'holds' if finding.holds else 'FAILS'}: {finding.text}")
        rows.append(row(film, run))
    if rows:
        table = "\n".join([HEAD, RULE, *rows]) + "\n"
        (out / "gallery.md").write_text(table, encoding="utf-8")
        print(f"\n{table}\nThe thesis' seconds are those of a 3 GHz Pentium 4 with 1 GB, 2005.")
    return good


def loaded(film: Film, shrink: Shrink | None) -> tuple[Scene, list[str]]:
    """The scene of a film, and how it is changed."""
    path = SCENES / f"{film.name}.toml"
    changes = list(shrink(scenes.load(path))) if shrink else []
    return scenes.load(path, changes), changes


def announce(chosen: Sequence[Film], out: Path, ranks: int,
             shrink: Shrink | None) -> None:
    """Say what is to be done, and how long that takes, before it begins."""
    due = []
    for film in chosen:
        scene, changes = loaded(film, shrink)
        if chain.is_outdated(scene, out / film.name, ranks, changes):
            due.append(film)
    kept = len(chosen) - len(due)
    minutes = sum(film.minutes for film in due)
    print(f"{len(due)} films to make, {kept} up to date; about {minutes:.0f} minutes on two cores "
          "at the scenes' own size", flush=True)


HEAD = ("| film | figure | pieces | cells | frames | steps | simulated, s/frame | thesis | times "
        "faster | rendered, s/frame | thesis | times faster | snapshots, MB |")
RULE = "| --- " * 13 + "|"


def row(film: Film, run: watch.Run) -> str:
    """What a film cost, as a row of the table."""
    scene = run.scene
    frames = len(snapshot_frames(run.path))
    status = json.loads((run.path / "status.json").read_text(encoding="utf-8"))
    cost = [status["seconds"] / frames, Record(run.path).seconds.get("render", 0.0) / frames]
    thesis = film.thesis or (0.0, 0.0)
    cells = " × ".join(str(n) for n in scene.domain.cells)
    stored = sum(path.stat().st_size for path in (run.path / "snapshots").glob("*.h5")) / 1e6
    columns = [film.name, film.figure, str(len(run.mass)), cells, str(frames), str(status["step"])]
    for mine, theirs in zip(cost, thesis, strict=True):
        columns += [f"{mine:.3f}" if mine else "–", f"{theirs:g}" if theirs else "–",
                    f"{theirs / mine:.0f}" if theirs and mine else "–"]
    return "| " + " | ".join([*columns, f"{stored:.1f}"]) + " |"

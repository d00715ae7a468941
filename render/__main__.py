"""Pictures and a film of a run: [mpirun -n N] python -m render OUT"""

import argparse
import os
import sys
import traceback
from pathlib import Path

# One thread per rank: set before numpy, BLAS and Embree read them.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from mpi4py import MPI  # noqa: E402

from render import plots, sequence  # noqa: E402
from solver import files, scene  # noqa: E402
from solver.scene_render import Render  # noqa: E402

COMM = MPI.COMM_WORLD


def main(arguments: list[str] | None = None) -> int:
    """Exit code 0, or 2 after one line about bad input; a rank that fails later ends all ranks."""
    options = _parser().parse_args(arguments)
    problem = ""
    try:
        found, frames = _chosen(options)
    except (scene.SceneError, files.FileError) as error:
        problem = str(error)
    problem = next(filter(None, COMM.allgather(problem)), "")
    if problem:
        if COMM.rank == 0:
            print(f"error: {problem}", file=sys.stderr)
        return 2
    try:
        (_plot if options.plots else _render)(options, found, frames)
    except files.FileError as error:
        return _fail(str(error), 2)
    except OSError as error:
        return _fail(f"{error.filename or options.output or options.run}: {error.strerror}; fix: "
                     "give another path", 2)
    except Exception:
        traceback.print_exc()
        return _fail("the renderer failed; the reason is above", 1)
    return 0


def _fail(problem: str, code: int) -> int:
    """End the other ranks, which may be waiting for this one."""
    print(f"error: {problem}", file=sys.stderr, flush=True)
    if COMM.size > 1:
        COMM.Abort(code)
    return code


def _chosen(options: argparse.Namespace) -> tuple[scene.Scene, list[int]]:
    """The scene and the frames to render."""
    if options.plots and (options.video or options.contact or options.preview):
        raise files.FileError("--plots: draws diagnostics instead of pictures; fix: --video, "
                              "--contact or --preview without it")
    found = scene.load(options.scene or options.run / "scene.toml", options.set)
    return found, files.chosen_frames(options.run, options.frames)


def _render(options: argparse.Namespace, found: scene.Scene, frames: list[int]) -> None:
    render = found.render or Render()
    output = options.output or options.run / ("preview" if options.preview else "frames")
    if options.preview:
        render = sequence.preview(render)
    works = COMM.gather(
        sequence.shoot(options.run, found, render, frames, output, COMM, _progress))
    if works is not None:
        if options.video is not None:
            sequence.write_video(options.video, output, frames, render.fps)
        if options.contact is not None:
            sequence.write_contact_sheet(options.contact, output, frames)
        print(_report(works, options.video or output))


def _plot(options: argparse.Namespace, found: scene.Scene, frames: list[int]) -> None:
    """Diagnostics, on one rank; without --frames of four frames evenly spread."""
    if COMM.rank > 0:
        return
    if options.frames is None:
        frames = [frames[i * (len(frames) - 1) // 3] for i in range(4)]
    output = options.output or options.run / "plots"
    drawn = plots.draw(options.run, sorted(set(frames)), output)
    print(f"render: {len(drawn)} plots of {found.title or options.run}: {output}")


def _progress(done: int, due: int) -> None:
    """A line that rewrites itself on a terminal, for the share of rank 0."""
    if COMM.rank == 0 and sys.stderr.isatty():
        end = "\n" if done == due else ""
        print(f"\rrender: {done} of {due} frames", end=end, file=sys.stderr, flush=True)


def _report(works: list[sequence.Work], result: Path) -> str:
    """One line: how many frames, how fast."""
    made, kept = sum(work.made for work in works), sum(work.kept for work in works)
    if not made:
        return f"render: all {kept} frames are up to date: {result}"
    seconds = sum(work.seconds for work in works)
    rays = sum(work.rays for work in works)
    return (f"render: {made} frames ({kept} kept), {seconds / made:.2f} s per frame and rank, "
            f"{rays / seconds / 1e6:.2f} million rays per second and rank, "
            f"set-up {max(work.setup for work in works):.1f} s: {result}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m render", description=__doc__)
    parser.add_argument("run", type=Path, metavar="OUT", help="the folder of a run")
    parser.add_argument("-o", "--output", type=Path,
                        help="folder for the frames (default: OUT/frames)")
    parser.add_argument("--video", type=Path, metavar="FILE",
                        help="join the frames to a film, .mp4 or .gif")
    parser.add_argument("--contact", type=Path, metavar="FILE",
                        help="up to 20 frames side by side, .png or .jpg")
    parser.add_argument("--preview", action="store_true", help="small, rough and fast, to "
                        "OUT/preview")
    parser.add_argument("--plots", action="store_true", help="diagnostics instead of pictures, to "
                        "OUT/plots: slices, history, paths")
    parser.add_argument("--frames", metavar="A:B:C", help="only these frames, as in a slice")
    parser.add_argument("--scene", type=Path,
                        help="take [render] from this scene (default: OUT/scene.toml)")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE",
                        help="override a parameter of the scene (repeatable)")
    return parser


if __name__ == "__main__":
    sys.exit(main())

"""Break bodies before anything explodes: SCENE or MESH in, fragments.h5 out."""

import argparse
import sys
import time
from pathlib import Path

from mpi4py import MPI

from partition import fragments
from partition.build import BuildError, build, build_mesh
from partition.fragments import Fragments
from solver import scene
from solver.scene_body import Fracture

MAX_ROWS = 64
COMM = MPI.COMM_WORLD


def main(arguments: list[str] | None = None) -> int:
    """Exit code 0, or 2 after one line about bad input.

    All ranks find the same pieces; rank 0 reports and writes.
    """
    options = _parser().parse_args(arguments)
    began = time.perf_counter()
    try:
        pieces, title = _from_scene(options) if options.source.suffix == ".toml" else \
            _from_mesh(options)
        seconds = time.perf_counter() - began
        problem = _write(options, pieces, title, seconds) if COMM.rank == 0 else ""
    except (scene.SceneError, BuildError) as error:
        problem = str(error)
    problem = COMM.bcast(problem)
    if problem and COMM.rank == 0:
        print(f"error: {problem}", file=sys.stderr)
    return 2 if problem else 0


def _write(options: argparse.Namespace, pieces: Fragments, title: str, seconds: float) -> str:
    """Files and table; returns what went wrong, or an empty string."""
    try:
        fragments.write(options.output, pieces, {"source": str(options.source)})
        print(_table(pieces))
        print(f"{pieces.count} pieces in {seconds:.2f} s: {options.output}")
        if options.picture is not None:
            _draw(options.picture, pieces, title)
    except OSError as error:
        return f"{error.filename or options.output}: cannot be written ({error.strerror or error})"\
            "; fix: give another path"
    except ValueError as error:
        return f"{options.picture}: not a picture ({error}); fix: give a .png file"
    return ""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m partition", description=__doc__)
    parser.add_argument("source", type=Path, help="a scene (.toml), or a triangle mesh")
    parser.add_argument("--pieces", type=_positive, help="exactly this many pieces of every body "
                        "that breaks (default: as the scene says; of a mesh: 16)")
    parser.add_argument("--balance", choices=["area", "count"], default="area",
                        help="of a mesh: pieces of equal area or triangle count")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE",
                        help="override a parameter of the scene (repeatable)")
    parser.add_argument("-o", "--output", type=Path, default=Path("fragments.h5"))
    parser.add_argument("--picture", type=Path, help="write an exploded view of the pieces (PNG)")
    return parser


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of pieces; give 1 or more")
    return int(text)


def _from_scene(options: argparse.Namespace) -> tuple[Fragments, str]:
    found = scene.load(options.source, options.set)
    if options.pieces is not None:
        breaking = [index for index, body in enumerate(found.body) if body.fracture is not None]
        if not breaking:
            raise BuildError(f"{options.source}: --pieces {options.pieces}: no body breaks; fix: "
                             "give one a [body.fracture] table")
        changes = [f"body.{index}.fracture.pieces={options.pieces}" for index in breaking]
        found = scene.load(options.source, [*options.set, *changes])
    return build(found), found.title or options.source.stem


def _from_mesh(options: argparse.Namespace) -> tuple[Fragments, str]:
    if options.set:
        raise BuildError(f"--set {options.set[0]}: {options.source} is not a scene; fix: give a "
                         ".toml file")
    wanted = Fracture(pieces=options.pieces or 16, balance=options.balance)
    return build_mesh(options.source, wanted), options.source.stem


def _table(pieces: Fragments) -> str:
    """Pieces, their triangles, area and volume; the middle of a long table is left out."""
    rows = fragments.table(pieces)
    lines = [f"{'piece':>5}  {'body':<16} {'triangles':>9} {'area':>11} {'volume':>11}"]
    for index, row in enumerate(rows):
        if len(rows) > MAX_ROWS and MAX_ROWS // 2 <= index < len(rows) - MAX_ROWS // 2:
            if index == MAX_ROWS // 2:
                lines.append(f"{'...':>5}")
            continue
        volume = f"{row['volume']:11.4g}" if pieces.closed[index] else f"{'open':>11}"
        lines.append(f"{index:5d}  {row['body'].decode():<16.16} {row['triangles']:9d} "
                     f"{row['area']:11.4g} {volume}")
    lines.append(f"{'all':>5}  {'':<16} {rows['triangles'].sum():9d} {rows['area'].sum():11.4g} "
                 f"{rows['volume'].sum():11.4g}")
    return "\n".join(lines)


def _draw(path: Path, pieces: Fragments, title: str) -> None:
    from partition import picture

    picture.save(path, pieces, f"{title}: {pieces.count} pieces")
    print(f"picture: {path}")


if __name__ == "__main__":
    sys.exit(main())

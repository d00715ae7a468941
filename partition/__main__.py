"""Break bodies before anything explodes: SCENE or MESH in, fragments.h5 out."""

import argparse
import logging
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")   # one thread per rank; read when the libraries load

import pydantic  # noqa: E402
from mpi4py import MPI  # noqa: E402

from partition import fragments, table  # noqa: E402
from partition.build import Broken, BuildError, assemble, break_all, break_mesh  # noqa: E402
from partition.export import FORMATS, export  # noqa: E402
from partition.fragments import Fragments  # noqa: E402
from partition.generated import NAMES  # noqa: E402
from solver import scene  # noqa: E402
from solver.files import FileError  # noqa: E402
from solver.scene_body import Body, Fracture  # noqa: E402

COMM = MPI.COMM_WORLD
PICTURES = (".png", ".pdf", ".svg")


def main(arguments: list[str] | None = None) -> int:
    """Exit code 0, or 2 after one line about bad input.

    All ranks find the same pieces, sharing the eigenproblems; rank 0 reports and writes.
    """
    options = _parser().parse_args(arguments)
    if COMM.rank == 0:
        logging.basicConfig(level=logging.INFO, format="%(message)s")
    began = time.perf_counter()
    try:
        broken, title = _from_scene(options) if options.source.suffix == ".toml" else \
            _from_mesh(options)
        pieces = assemble(broken)
        problem = _write(options, pieces) if COMM.rank == 0 else ""
        report = _report(broken, pieces)
        if COMM.rank == 0 and not problem:
            seconds = time.perf_counter() - began
            print(f"{report}\n{pieces.count} pieces in {seconds:.2f} s: {options.output}")
            problem = _write_more(options, pieces, title)
    except (scene.SceneError, BuildError) as error:
        problem = str(error)
    problem = COMM.bcast(problem)
    if problem and COMM.rank == 0:
        print(f"error: {problem}", file=sys.stderr)
    return 2 if problem else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m partition", description=__doc__,
        epilog="Methods of a scene stand under [body.fracture]; an option given here goes before.")
    parser.add_argument("source", type=Path, help="a scene (.toml), a triangle mesh, or "
                        "one of " + ", ".join(NAMES))
    parser.add_argument("--pieces", type=_positive, help="exactly this many pieces of every body "
                        "that breaks (of a mesh: 16 if not given)")
    parser.add_argument("--method", choices=["spectral", "bfs", "spectral+bfs"], help="along weak "
                        "lines, in equal blocks, or cut in two first and one side in blocks")
    parser.add_argument("--weights", choices=["dihedral", "thesis"], help="what makes a line weak")
    parser.add_argument("--mass", choices=["area", "count"], help="what the size of a piece is")
    parser.add_argument("--cut", choices=["sweep", "sign", "median"], help="along an eigenvector")
    parser.add_argument("--order", choices=["connected", "half_list"], help="of the search")
    parser.add_argument("--interior", choices=["open", "shell", "solid"], default="open",
                        help="of the pieces of a mesh")
    parser.add_argument("--skin", type=float, default=0.01, help="thickness of a shell")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE",
                        help="override a parameter of the scene (repeatable)")
    parser.add_argument("-o", "--output", type=Path, default=Path("fragments.h5"))
    parser.add_argument("--picture", type=_picture, help="an exploded view of the pieces (PNG)")
    parser.add_argument("--export", type=Path, metavar="DIR", help="one mesh file per piece")
    parser.add_argument("--format", choices=FORMATS, default="obj", help="of --export")
    return parser


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of pieces; give 1 or more")
    return int(text)


def _picture(text: str) -> Path:
    if Path(text).suffix not in PICTURES:
        raise argparse.ArgumentTypeError(f"{text!r} is none of {', '.join(PICTURES)}")
    return Path(text)


def _wanted(options: argparse.Namespace) -> dict[str, Any]:
    """The keys of [fracture] that the command line gives."""
    keys = {name: getattr(options, name) for name in
            ("pieces", "method", "weights", "mass", "cut", "order")}
    keys = {name: value for name, value in keys.items() if value is not None}
    if options.method == "spectral+bfs":
        first = {name: keys[name] for name in ("weights", "mass", "cut") if name in keys}
        keys |= {"method": "bfs", "first": first | {"method": "spectral"}}
    return keys


def _from_scene(options: argparse.Namespace) -> tuple[list[Broken], str]:
    found = scene.load(options.source, options.set)
    wanted = _wanted(options)
    if wanted:
        breaking = [index for index, body in enumerate(found.body) if body.fracture is not None]
        if not breaking:
            raise BuildError(f"{options.source}: --{next(iter(wanted))}: no body breaks; fix: give "
                             "one a [body.fracture] table")
        changes = [f"body.{index}.fracture.{key}={_toml(value)}" for index in breaking
                   for key, value in wanted.items()]
        found = scene.load(options.source, [*options.set, *changes])
    return break_all(found, COMM), found.title or options.source.stem


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + "}"
    return f'"{value}"' if isinstance(value, str) else str(value)


def _from_mesh(options: argparse.Namespace) -> tuple[list[Broken], str]:
    if options.set:
        raise BuildError(f"--set {options.set[0]}: {options.source} is not a scene; fix: give a "
                         ".toml file")
    name = options.source.stem
    try:
        body = Body(name=name, shape="mesh", interior=options.interior, skin=options.skin,
                    fracture=Fracture(**_wanted(options)))
    except pydantic.ValidationError as error:
        raise BuildError(f"--{error.errors()[0]['loc'][-1]}: {error.errors()[0]['msg']}; fix: see "
                         "--help") from None
    return [break_mesh(options.source, body, COMM)], name


def _report(broken: list[Broken], pieces: Fragments) -> str:
    """Bodies, cuts and pieces, told by the last rank while the first still writes the file."""
    last = COMM.size - 1
    lines = []
    if COMM.rank == last:
        for body in broken:
            if body.mesh is not None:
                lines.append(f"{body.name}: {body.mesh.report()}")
            lines += [body.filling] if body.filling else []
            lines += [table.of_cuts(body.cuts)] if body.cuts else []
        lines.append(table.of_pieces(pieces))
    report: str = COMM.bcast("\n".join(lines), last)
    return report


def _write(options: argparse.Namespace, pieces: Fragments) -> str:
    """The file of fragments; returns what went wrong, or an empty string."""
    return _problem(options, lambda: fragments.write(options.output, pieces,
                                                     {"source": str(options.source)}))


def _write_more(options: argparse.Namespace, pieces: Fragments, title: str) -> str:
    """What else is asked for; returns what went wrong, or an empty string."""
    def write() -> None:
        if options.picture is not None:
            from partition import picture

            picture.save(options.picture, pieces, f"{title}: {pieces.count} pieces")
            print(f"picture: {options.picture}")
        if options.export is not None:
            export(options.export, options.format, pieces)
            print(f"one .{options.format} file per piece: {options.export}")
    return _problem(options, write)


def _problem(options: argparse.Namespace, write: Callable[[], None]) -> str:
    try:
        write()
    except FileError as error:
        return str(error)
    except OSError as error:
        return f"{error.filename or options.output}: cannot be written ({error.strerror or error})"\
            "; fix: give another path"
    return ""


if __name__ == "__main__":
    sys.exit(main())

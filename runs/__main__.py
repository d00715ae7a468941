"""`python -m runs NAME`: fragments, snapshots and video of a scene; only what is out of date.

`python -m runs bench NAME` measures speed and accuracy instead: one module of `runs/bench` each.
`python -m runs gallery [NAME…]` makes the animations of the gallery, with strips and claims.
`python -m runs sweep TABLE` runs a table of variants, each in its folder.
`python -m runs stress [PART…]` tries to break the solver and tells what held.
"""

import argparse
import difflib
import importlib
import os
import sys
from pathlib import Path

from runs import chain, films, tiny
from solver import scene as scenes

SCENES = Path(__file__).parent / "scenes"
BENCHMARKS = Path(__file__).parent / "bench"


def main() -> int:
    if sys.argv[1:2] == ["bench"]:
        return bench(sys.argv[2:])
    if sys.argv[1:2] in (["sweep"], ["stress"]):
        return int(importlib.import_module(f"runs.{sys.argv[1]}.__main__").main(sys.argv[2:]))
    if sys.argv[1:2] == ["gallery"]:
        return gallery(sys.argv[2:])
    known = sorted(path.stem for path in SCENES.glob("*.toml"))
    parser = argparse.ArgumentParser(
        prog="python -m runs", description="Partition, simulate and film a scene; what is up to "
        "date is not done again.", epilog=f"scenes: {', '.join(known)}")
    parser.add_argument("scene", metavar="NAME", help="a scene below, or the path of a .toml file")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR",
                        help="where everything goes (default: out/NAME)")
    parser.add_argument("--ranks", type=_count, default=chain.default_ranks(), metavar="N",
                        help="MPI ranks of solver and render (default here: %(default)s)")
    parser.add_argument("--tiny", action="store_true", help="at smoke-test size, in out/NAME-tiny")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
                        help="override a value of the scene, as in --set time.end=0.1")
    parser.add_argument("--force", action="store_true", help="redo all of it")
    options = parser.parse_args()
    if "OMPI_COMM_WORLD_SIZE" in os.environ:
        return _refuse("runs under mpirun, but starts it itself; fix: use --ranks N instead", 2)
    try:
        path = find(options.scene, known)
        scene = scenes.load(path, options.overrides)
        if options.tiny:
            options.overrides += tiny.overrides(scene)
            scene = scenes.load(path, options.overrides)
    except scenes.SceneError as error:
        return _refuse(str(error), 2)
    out = options.output or Path("out") / (path.stem + ("-tiny" if options.tiny else ""))
    if out.exists() and not out.is_dir():
        return _refuse(f"-o {out}: is a file; fix: give a folder", 2)
    try:
        video = chain.run(scene, out, options.ranks, options.overrides, options.force)
    except chain.StageFailed as error:
        return _refuse(str(error), error.code)
    if video is not None:
        print(f"video: {video}")
    return 0


def bench(arguments: list[str]) -> int:
    """Run one benchmark with the rest of the command line."""
    known = sorted(path.stem for path in BENCHMARKS.glob("*.py")
                   if "\ndef main(" in path.read_text(encoding="utf-8"))
    if not arguments or arguments[0] not in known:
        return _refuse(f"bench {' '.join(arguments[:1])}: no such benchmark; fix: one of "
                       f"{', '.join(known)}", 2)
    return int(importlib.import_module(f"runs.bench.{arguments[0]}").main(arguments[1:]) or 0)


def gallery(arguments: list[str]) -> int:
    """Make the films of the gallery; exit code 1 if one does not show what it should."""
    parser = argparse.ArgumentParser(
        prog="python -m runs gallery", description="Make the animations of the gallery, from "
        "nothing; what is up to date is not done again.",
        epilog=f"names: {', '.join(films.NAMES)}, and diagrams")
    parser.add_argument("name", nargs="*", metavar="NAME", help="which; all, if none is given")
    parser.add_argument("-o", "--output", type=Path, default=Path("out"), metavar="DIR",
                        help="everything goes to DIR/NAME (default: out)")
    parser.add_argument("--pictures", type=Path, metavar="DIR",
                        help="where the strips and diagrams go (default: out/gallery)")
    parser.add_argument("--ranks", type=_count, default=chain.default_ranks(), metavar="N",
                        help="MPI ranks of solver and render (default here: %(default)s)")
    parser.add_argument("--tiny", action="store_true", help="at smoke-test size, too small to show "
                        "anything: claims may fail")
    options = parser.parse_args(arguments)
    unknown = set(options.name) - {*films.NAMES, "diagrams"}
    if unknown:
        return _refuse(f"gallery {min(unknown)}: no such film; fix: one of "
                       f"{', '.join(films.NAMES)}, diagrams", 2)
    out = options.output / "tiny" if options.tiny else options.output
    if "OMPI_COMM_WORLD_SIZE" in os.environ:
        return _refuse("runs under mpirun, but starts it itself; fix: use --ranks N instead", 2)
    if options.output.exists() and not options.output.is_dir():
        return _refuse(f"-o {options.output}: is a file; fix: give a folder", 2)
    try:
        good = films.make(options.name, out, options.pictures or out / "gallery", options.ranks,
                          tiny.overrides if options.tiny else None)
    except scenes.SceneError as error:
        return _refuse(str(error), 2)
    except chain.StageFailed as error:
        return _refuse(str(error), error.code)
    return 0 if good or options.tiny else 1


def find(name: str, known: list[str]) -> Path:
    """The file of a scene given by name or by path; raises `SceneError`."""
    if name in known:
        return SCENES / f"{name}.toml"
    if name.endswith(".toml"):
        return Path(name)
    near = difflib.get_close_matches(name, known, 1)
    raise scenes.SceneError(f"{name}: no such scene; fix: " + (
        f"did you mean {near[0]}?" if near else f"one of {', '.join(known)}, or a .toml file"))


def _count(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number} is not a number of ranks, 1 or more")
    return number


def _refuse(message: str, code: int) -> int:
    print(f"python -m runs: {message}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())

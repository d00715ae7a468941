"""`mpirun -n N python -m solver SCENE -o OUT`: simulate a scene."""

import os
import sys
import time

STARTED = time.perf_counter()
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS",
                 "NUMEXPR_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")   # one thread per rank; read when the libraries load

import argparse  # noqa: E402
import errno  # noqa: E402
import signal  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

from mpi4py import MPI  # noqa: E402


DISK_ERRORS = errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO


def abort_all(kind: type[BaseException], error: BaseException, trace: Any) -> None:
    """One rank's failure must not leave the others waiting."""
    sys.__excepthook__(kind, error, trace)
    sys.stderr.flush()
    MPI.COMM_WORLD.Abort(1)


if __name__ == "__main__":
    sys.excepthook = abort_all   # an import that fails on one rank

from solver import plan, scene as scenes, session  # noqa: E402

if MPI.COMM_WORLD.size > 1:
    os.environ.setdefault("H5PY_ALWAYS_USE_MPI", "1")

from solver.files import FileError, WriteError  # noqa: E402
from solver.lock import hold  # noqa: E402
from solver.session import BAD_INPUT, DISK, Session, seconds_of  # noqa: E402


def main() -> int:
    """Parse, check everything, then run; returns the exit code."""
    comm = MPI.COMM_WORLD
    arguments, code = None, 0
    if comm.rank == 0:
        try:
            own, petsc = split(sys.argv[1:])
            arguments = parser().parse_args(own)
            arguments.petsc = " ".join([arguments.petsc, *petsc])
        except SystemExit as stop:
            code = int(stop.code or 0)
    arguments, code = comm.bcast((arguments, code))
    if arguments is None:
        return code
    if arguments.parameters:
        if comm.rank == 0:
            signal.signal(signal.SIGPIPE, signal.SIG_DFL)   # `... | head` has seen enough
            print(parameter_table())
        return 0
    try:
        return simulate(arguments, comm)
    except (scenes.SceneError, FileError) as error:   # the same on every rank
        if comm.rank == 0:
            print(f"error: {error}", file=sys.stderr, flush=True)
        return DISK if isinstance(error, WriteError) else BAD_INPUT


def simulate(arguments: argparse.Namespace, comm: MPI.Comm) -> int:
    """Load the scene and run it, or only show the plan."""
    scene = scenes.load(arguments.scene, arguments.set)
    if comm.rank == 0:
        print(f"{scene.title or arguments.scene}: {' × '.join(map(str, scene.domain.cells))} "
              f"cells, {comm.size} rank{'s' if comm.size > 1 else ''}, until t = "
              f"{scene.time.end:g}\n{plan.describe(scene)}", flush=True)
    out = Path(arguments.output or Path("out") / Path(arguments.scene).stem)
    check_machine(scene, comm, out)
    if arguments.plan:
        return 0
    import solver.grid  # noqa: F401  (starts PETSc, which all ranks must do together)
    if comm.rank == 0:   # compile the kernels once; the other ranks then find them on disk
        _import_solver(scene)
    comm.Barrier()
    _import_solver(scene)
    from solver.grid import process_grid
    from solver.pressure import set_options
    from solver.run import RunFailed, prepare_folder, run
    process_grid(scene.domain.cells, comm.size)
    set_options(arguments.petsc)
    fragments, source = load_fragments(scene, arguments, out)
    simulation = build(scene, comm, fragments)   # may refuse the scene: before OUT is touched
    lock = None
    try:
        problem, checkpoint = None, None
        if comm.rank == 0:
            try:
                lock = hold(out)
                checkpoint = prepare_folder(out, scene, source, arguments.overwrite,
                                            arguments.restart)
            except FileError as error:
                problem = error
            except OSError as error:
                kind = WriteError if error.errno in DISK_ERRORS else FileError
                problem = kind(f"{out}: cannot be written ({error.strerror})")
        problem, checkpoint = comm.bcast((problem, checkpoint))
        if problem is not None:
            raise problem
        limits = Session(STARTED, arguments.restart, arguments.until, arguments.walltime,
                         arguments.walltime_margin)
        return run(simulation, out, limits, checkpoint, arguments.steps)
    except RunFailed as error:
        if comm.rank == 0:
            print(f"error: {error}", file=sys.stderr, flush=True)
        return error.code
    finally:
        simulation.destroy()
        if lock is not None:
            lock.close()


def build(scene: scenes.Scene, comm: MPI.Comm, fragments: Any) -> Any:
    """The simulation at its start; raises `SceneError` where the scene does not start, or ends all
    ranks where only some of them find that."""
    from solver.run import in_common
    from solver.step import Simulation
    alarm = comm.Dup()
    try:
        return Simulation(scene, comm, fragments)
    except (ArithmeticError, RuntimeError, ValueError) as error:
        together, message = in_common(str(error), alarm)
        if together:
            raise scenes.SceneError(f"{scene.path}: {message}") from None
        print(f"error: {scene.path}: {message}", file=sys.stderr, flush=True)
        comm.Abort(BAD_INPUT)
    finally:
        alarm.Free()


def check_machine(scene: scenes.Scene, comm: MPI.Comm, out: Path) -> None:
    """Print what the run will need; raises `SceneError` where the memory will not do."""
    from solver import estimate
    here = comm.Split_type(MPI.COMM_TYPE_SHARED)
    text, problem = estimate.describe(scene, comm.size, here.size, out)
    here.Free()
    if comm.rank == 0:
        print(text, flush=True)
    problems = [found for found in comm.allgather(problem) if found]
    if problems:
        raise scenes.SceneError(f"{scene.path}: {problems[0]}")


def _import_solver(scene: scenes.Scene) -> None:
    """Import (and so compile) what this scene needs and nothing else."""
    import solver.run  # noqa: F401
    for stage in plan.wanted(scene):
        stage.load()


def load_fragments(scene: scenes.Scene, arguments: argparse.Namespace,
                   out: Path) -> tuple[Any, Path | None]:
    """The pieces of the scene's bodies, checked against it, and the file they are from."""
    if not scene.body:
        return None, None
    from partition import fragments
    from solver.snapshot import check_fragments
    path = Path(arguments.fragments or out / "fragments.h5")
    if not path.is_file():
        raise FileError(f"{path}: no such file, and the scene has bodies; fix: python -m partition "
                        f"{arguments.scene} -o {path}")
    pieces = fragments.read(path)
    problem = check_fragments(scene, pieces, path)
    if problem:
        raise FileError(problem)
    return pieces, path


def split(words: list[str]) -> tuple[list[str], list[str]]:
    """Our own part of a command line, and PETSc's: what follows a lone `--`."""
    at = words.index("--") if "--" in words else len(words)
    return words[:at], words[at + 1:]


def parser() -> argparse.ArgumentParser:
    """The command line; --help ends with every parameter of a scene."""
    result = argparse.ArgumentParser(
        prog="python -m solver", description=f"{__doc__}\n\n{session.__doc__}",
        epilog=parameter_table(),
        formatter_class=argparse.RawDescriptionHelpFormatter)
    result.add_argument("scene", nargs="?", help="scene file (TOML)")
    result.add_argument("-o", "--output", help="folder of the run (default: out/NAME)")
    result.add_argument("--fragments", help="pieces from python -m partition "
                        "(default: OUT/fragments.h5)")
    result.add_argument("--set", action="append", default=[], metavar="KEY=VALUE",
                        help="override a parameter, as in time.end=0.1; may be repeated")
    result.add_argument("--plan", action="store_true", help="print what would run, and stop")
    result.add_argument("--steps", action="store_true", help="print every step, not every frame")
    result.add_argument("--overwrite", action="store_true", help="replace the run that OUT holds")
    result.add_argument("--restart", action="store_true", help="continue the run that OUT holds "
                        "from its newest good checkpoint, if there is one")
    result.add_argument("--until", type=float, metavar="TIME",
                        help="stop at a checkpoint at this simulated time")
    result.add_argument("--walltime", type=duration, metavar="3h50m",
                        help="stop at a checkpoint in time for this limit of the job")
    result.add_argument("--walltime-margin", type=duration, metavar="2m",
                        help="how long before it (default: 60 s, or twice the longest checkpoint)")
    result.add_argument("--petsc", default="", metavar='"OPTIONS"', help="PETSc options of the "
                        'pressure solve, as in --petsc "-pressure_pc_type gamg '
                        '-pressure_ksp_monitor"; or write them last, after --')
    result.add_argument("--parameters", action="store_true", help="print the parameters of a scene")
    return result


def duration(text: str) -> float:
    """An argument that is a time of the clock."""
    try:
        return seconds_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def parameter_table() -> str:
    """Every parameter with default, unit, range and meaning."""
    lines = ["parameters of a scene (section.key = default [unit] range: meaning)"]
    previous = None
    for section, key, default, unit, legal, meaning in scenes.table():
        if section != previous:
            lines.append(f"\n[{section}]" if section else "")
            previous = section
        parts = [f"{key} = {default}", f"[{unit}]" if unit else "", legal]
        lines.append("  " + " ".join(part for part in parts if part) + f": {meaning}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.excepthook = sys.__excepthook__   # it would also get what h5py only reports
    try:
        status = main()
    except (Exception, KeyboardInterrupt) as failure:
        abort_all(type(failure), failure, failure.__traceback__)
    sys.exit(status)

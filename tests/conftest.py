"""How the tests run, on one process or as `mpirun -n N python -m pytest tests`.

With several ranks every rank runs the same tests in the same order, and a test may use collective
operations. So that this cannot end in a hang, the first failure on any rank is printed and aborts
all of them; a rank that waits for ever is ended by `faulthandler_timeout` (setup.cfg).
"""

import os
import time

# One thread per rank: set before numpy, BLAS and numba read them.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import subprocess  # noqa: E402
import sys  # noqa: E402
from collections.abc import Callable, Iterator  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import hypothesis  # noqa: E402
import pytest  # noqa: E402
from mpi4py import MPI  # noqa: E402

COMM = MPI.COMM_WORLD
if COMM.size > 1:
    os.environ.setdefault("H5PY_ALWAYS_USE_MPI", "1")  # Debian has two builds of h5py

# The same examples on every rank and in every run.
hypothesis.settings.register_profile("brisance", derandomize=True, database=None, deadline=None)
hypothesis.settings.load_profile("brisance")


def pytest_report_header() -> str:
    return f"MPI ranks: {COMM.size}"


# --- several ranks: one voice, and no hang -------------------------------------------------------

@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Only rank 0 reports; the others speak when they fail."""
    if COMM.size > 1 and config.option.color == "auto":
        config.option.color = "no"  # mpirun's ranks believe in a terminal even when there is a file
    if COMM.rank > 0:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")


def pytest_collection_finish(session: pytest.Session) -> None:
    """Ranks that run different tests would wait for each other."""
    mine = [item.nodeid for item in session.items]
    for rank, theirs in enumerate(COMM.allgather(mine)):
        if theirs != mine:
            different = sorted(set(mine) ^ set(theirs)) or "the order"
            _abort_all_ranks("collecting", f"rank {rank} collected different tests: {different}")


def pytest_runtest_setup(item: pytest.Item) -> None:
    if COMM.size > 1 and item.get_closest_marker("serial"):
        pytest.skip("needs no ranks")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.failed:
        _abort_all_ranks(f"{report.nodeid} ({report.when})", report.longreprtext)


def pytest_collectreport(report: pytest.CollectReport) -> None:
    if report.failed:
        _abort_all_ranks(f"collecting {report.nodeid}", report.longreprtext)


def pytest_internalerror(excrepr: Any) -> None:
    _abort_all_ranks("pytest itself", str(excrepr))


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(exitstatus: int) -> None:
    """A rank that stops early (pytest.exit, an interrupt, --maxfail) takes the others along."""
    if exitstatus not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        _abort_all_ranks("the session", f"exit status {int(exitstatus)}")


def _abort_all_ranks(where: str, text: str) -> None:
    if COMM.size > 1:
        print(f"\n==== rank {COMM.rank} of {COMM.size} failed: {where}\n{text}\n"
              "==== all ranks stop here", file=sys.__stderr__, flush=True)
        time.sleep(0.5)  # for mpirun to pass the text on, and for other ranks to fail as well
        COMM.Abort(1)


# --- fixtures ------------------------------------------------------------------------------------

@pytest.fixture
def shared_path(tmp_path: Path) -> Iterator[Path]:
    """A folder of all ranks, for what they write together; `tmp_path` is one of this rank alone.

    No rank leaves a test before all of them have read what they want of it.
    """
    path: Path = COMM.bcast(tmp_path)   # rank 0's
    yield path
    COMM.Barrier()


Launcher = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def mpirun() -> Iterator[Launcher]:
    """`mpirun(ranks, *arguments, timeout=120, cwd=None)` runs `python arguments` on so many ranks.

    Returns the finished process with its output (stdout and stderr in one); past the timeout, in
    seconds, the ranks are ended and the test fails. It is for tests that need other rank counts
    than their own; inside a parallel run it skips.
    """
    if COMM.size > 1:
        pytest.skip("starts mpirun itself")

    def launch(ranks: int, *arguments: str | Path, timeout: float = 120,
               cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
        command = ["mpirun", "--oversubscribe", "-n", str(ranks), sys.executable,
                   *map(str, arguments)]
        process = subprocess.Popen(command, env=_environment_outside_mpi(), cwd=cwd, text=True,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT)
        try:
            output, _ = process.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            process.terminate()  # mpirun ends its ranks, by force after two seconds
            output, _ = process.communicate()
            pytest.fail(f"{' '.join(command)} was still running after {timeout} s:\n{output}")
        return subprocess.CompletedProcess(command, process.returncode, output)

    yield launch


def _environment_outside_mpi() -> dict[str, str]:
    """Without the variables by which MPI tells a process that it is a rank already."""
    kept = {name: value for name, value in os.environ.items()
            if not name.startswith(("OMPI_", "PMIX_", "ORTE_"))}
    return kept | {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}

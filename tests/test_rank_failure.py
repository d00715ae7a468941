"""A failure on one rank of a parallel test run ends all ranks, with its report; it never hangs.

Each case is a small test file, run by a real `mpirun -n 2 python -m pytest` with our conftest.py.
In every failing case the healthy rank is waiting in a barrier that its partner never reaches.
"""

from pathlib import Path

import pytest

pytestmark = pytest.mark.serial

PREAMBLE = """
import os, sys
import pytest
from mpi4py import MPI
comm = MPI.COMM_WORLD
"""

BARRIER = """
def test_waits():
    comm.Barrier()
"""

FAILURES = {
    "a test fails": ("""
def test_one_fails():
    assert comm.rank != 1, "the reason is shown"
    comm.Barrier()
""", "the reason is shown"),
    "a fixture fails": ("""
@pytest.fixture
def broken():
    if comm.rank == 0:
        raise RuntimeError("in the fixture")

def test_uses_it(broken):
    comm.Barrier()
""", "in the fixture"),
    "the module does not load": ("""
if comm.rank == 1:
    raise ImportError("only here")
""" + BARRIER, "only here"),
    "other tests are collected": ("""
if comm.rank == 1:
    def test_extra():
        pass
""" + BARRIER, "collected different tests"),
    "pytest is left": ("""
def test_leaves():
    if comm.rank == 1:
        pytest.exit("enough")
    comm.Barrier()
""", "the session"),
    "the process dies": ("""
def test_dies():
    if comm.rank == 1:
        os._exit(3)
    comm.Barrier()
""", "exit code"),
}


@pytest.fixture
def run_tests(tmp_path, mpirun):
    conftest = Path(__file__).with_name("conftest.py").read_text(encoding="utf-8")
    (tmp_path / "conftest.py").write_text(conftest, encoding="utf-8")

    def run(text, *options):
        (tmp_path / "test_case.py").write_text(PREAMBLE + text, encoding="utf-8")
        return mpirun(2, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options, tmp_path,
                      cwd=tmp_path, timeout=60)
    return run


@pytest.mark.parametrize("text, shown", FAILURES.values(), ids=FAILURES.keys())
def test_failure_on_one_rank_ends_the_run(run_tests, text, shown):
    result = run_tests(text)
    assert result.returncode != 0
    assert shown in result.stdout


def test_ranks_that_wait_for_ever_are_ended(run_tests, pytestconfig):
    result = run_tests("def test_waits():\n    comm.recv()\n", "-o", "faulthandler_timeout=2",
                       "-o", "faulthandler_exit_on_timeout=true")
    assert result.returncode != 0
    assert "in test_waits" in result.stdout
    assert pytestconfig.getini("faulthandler_exit_on_timeout")
    assert float(pytestconfig.getini("faulthandler_timeout")) > 0


def test_passing_run_ends_well_and_reports_once(run_tests):
    result = run_tests("def test_two():\n    assert comm.size == 2\n" + BARRIER)
    assert result.returncode == 0, result.stdout
    assert result.stdout.count("2 passed") == 1


def test_each_rank_has_a_folder_of_its_own_and_one_with_the_others(run_tests):
    result = run_tests("""
def test_folders(tmp_path, tmp_path_factory, shared_path):
    assert len(set(comm.allgather(tmp_path))) == 2
    assert len(set(comm.allgather(tmp_path_factory.mktemp("more")))) == 2
    assert len(set(comm.allgather(shared_path))) == 1
    (shared_path / str(comm.rank)).touch()
    comm.Barrier()
    assert sorted(path.name for path in shared_path.iterdir()) == ["0", "1"]
""")
    assert result.returncode == 0, result.stdout


def test_launcher_ends_ranks_that_hang(mpirun):
    program = "from mpi4py import MPI; MPI.COMM_WORLD.rank or MPI.COMM_WORLD.recv()"
    with pytest.raises(pytest.fail.Exception, match="still running after 3 s"):
        mpirun(2, "-c", program, timeout=3)

"""How is a program started on several ranks, from a program that may be a rank itself?"""

import os

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


def mpirun(ranks: int) -> tuple[str, ...]:
    """What to write before a command."""
    return "mpirun", "--oversubscribe", "-n", str(ranks)


def environment() -> dict[str, str]:
    """Ours, without what tells a process that it is a rank already, and with one thread per rank
    unless ours says otherwise. In a container we may be root, whom mpirun asks to say so twice."""
    kept = {name: value for name, value in os.environ.items()
            if not name.startswith(("OMPI_", "PMIX_", "ORTE_"))}
    return dict.fromkeys(THREADS, "1") | kept | {"OMPI_ALLOW_RUN_AS_ROOT": "1",
                                                 "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}

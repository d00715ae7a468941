"""Compile every kernel once, so that no run has to: `python -m runs.warm` (set-up calls it).

Kernels are kept on disk beside their module. The solver's are compiled when it is imported, others
at their first call, which the demo at tiny size makes and the cutting of a body along its weak
lines. One process must do it first: several ranks that compile the same kernel at the same time can
damage numba's cache.
"""

import importlib
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("solver", "partition", "render")


def modules() -> list[str]:
    """Every module of the three programs, but for the programs themselves."""
    return [f"{package}.{path.stem}" for package in PACKAGES
            for path in sorted((ROOT / package).glob("*.py")) if not path.stem.startswith("__")]


def main() -> int:
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        # before the imports: they start MPI in this process, and mpirun cannot start inside it
        demo = subprocess.run([sys.executable, "-m", "runs", "window", "--tiny", "--ranks", "1",
                               "-o", folder], capture_output=True, text=True, cwd=ROOT)
        cut = subprocess.run([sys.executable, "-m", "partition", "bear", "--method", "spectral",
                              "--pieces", "3", "--interior", "solid", "-o", f"{folder}/bear.h5"],
                             capture_output=True, text=True, cwd=ROOT)
    for program in (demo, cut):
        if program.returncode != 0:
            print(program.stdout, program.stderr, sep="\n", file=sys.stderr)
            return program.returncode
    for name in modules():
        importlib.import_module(name)
    print(f"kernels compiled in {time.perf_counter() - start:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())

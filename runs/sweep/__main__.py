"""`python -m runs sweep TABLE`: one run per line of a table of scene overrides, each in its folder.

    python -m runs sweep TABLE -o OUT              all runs, one after the other; what is done stays
    python -m runs sweep TABLE -o OUT --only 3     run 3 alone, as an array job does (runs/jobs)
    python -m runs sweep TABLE -o OUT --list       what there is and what is left; starts nothing
What follows `--` goes to the solver, as in `-- --walltime 3h50m`. Interrupt it and start it again:
a run goes on from its newest checkpoint. OUT/summary.csv and .png tell what came out. Exit code 85:
a run was stopped early; 1: one has failed (the others have run).
"""

import argparse
import sys
from pathlib import Path

from runs import chain
from runs.sweep import run, summary, table
from runs.sweep.table import Case, TableError
from solver.session import STOPPED


def main(arguments: list[str]) -> int:
    """Parse, check every scene, run what is left."""
    own, rest = arguments, []
    if "--" in arguments:
        cut = arguments.index("--")
        own, rest = arguments[:cut], arguments[cut + 1:]
    options = parser().parse_args(own)
    out = options.output or Path("out") / options.table.stem
    try:
        cases = table.read(options.table)
        if options.only is not None and not 0 <= options.only < len(cases):
            raise TableError(f"--only {options.only}: fix: 0 to {len(cases) - 1}")
    except TableError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if options.count:
        print(len(cases))
        return 0
    chosen = cases if options.only is None else [cases[options.only]]
    code = 0 if options.list else run_all(chosen, out, options.ranks, rest)
    if options.list or options.only is None:
        print(f"{summary.write(cases, out)}")
    if options.list:
        for number, case in enumerate(cases):
            print(f"{number:4d}  {case.name:<16} {state(case, out):<12} "
                  f"{'  '.join(case.overrides)}")
    return code


def run_all(cases: list[Case], out: Path, ranks: int, options: list[str]) -> int:
    """One after the other; the exit code of all."""
    failed = False
    for case in cases:
        folder = out / case.name
        if run.is_done(case, folder):
            print(f"{case.name}: done already", flush=True)
            continue
        print(f"{case.name}: {'  '.join(case.overrides)}", flush=True)
        code = run.bring_up(case, folder, ranks, options)
        if code == STOPPED:
            print(f"{case.name}: stopped early; the same command goes on", flush=True)
            return code
        if code:
            why = run.last_error(folder) or folder / "sweep.log"
            print(f"{case.name}: exit code {code}: {why}", file=sys.stderr, flush=True)
            failed = True
    return int(failed)


def state(case: Case, out: Path) -> str:
    """One word or two."""
    return str(summary.row(case, out / case.name)["state"])


def parser() -> argparse.ArgumentParser:
    """The command line."""
    result = argparse.ArgumentParser(prog="python -m runs sweep",
                                     description=f"{__doc__}\n{table.__doc__}",
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    result.add_argument("table", type=Path, metavar="TABLE", help=".toml or .csv")
    result.add_argument("-o", "--output", type=Path, metavar="DIR", help="default: out/TABLE")
    result.add_argument("--ranks", type=int, default=chain.default_ranks(), metavar="N",
                        help="of each run (default here: %(default)s)")
    result.add_argument("--only", type=int, metavar="NUMBER", help="one run, counted from 0")
    result.add_argument("--list", action="store_true", help="tell the states, run nothing")
    result.add_argument("--count", action="store_true", help="print how many runs there are")
    return result


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""`python -m runs stress`: scenes, damage and kills meant to break the solver, and what then held.

Writes a table, one line per claim, into OUT/stress.md; with all parts in full (half an hour on two
cores) and --write also into runs/stress/README.md.
"""

import argparse
import shutil
import sys
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path

from runs.stress import breaking, disk, kills, malformed, signals, soak, valid
from runs.stress.result import Result

PARTS: dict[str, Callable[[Path, float], list[Result]]] = {
    "breaking": breaking.main, "valid": valid.main, "signals": signals.main, "kills": kills.main,
    "disk": disk.main, "malformed": malformed.main, "soak": soak.main}
README = Path(__file__).with_name("README.md")
HEAD = "| tried | what has to hold | held | found |\n|---|---|---|---|\n"
BEGIN, END = "<!-- table: python -m runs stress --write -->\n", "<!-- end of table -->\n"


def main(arguments: list[str]) -> int:
    """Run the parts that are asked for; exit code 1 where something did not hold."""
    options = parser().parse_args(arguments)
    results: list[Result] = []
    for name in options.parts or PARTS:
        out = options.output / name
        shutil.rmtree(out, ignore_errors=True)
        start = time.perf_counter()
        found = PARTS[name](out.resolve(), options.share)
        print(f"{name}: {time.perf_counter() - start:.0f} s")
        for result in found:
            print(result.row(), *result.failures, sep="\n  ", flush=True)
        results += found
    table = HEAD + "".join(result.row() + "\n" for result in results)
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "stress.md").write_text(table, encoding="utf-8")
    if options.write:
        write_table(table)
    return int(any(result.failures for result in results))


def write_table(table: str) -> None:
    """Put the table between its marks."""
    text = README.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    README.write_text(f"{before}{BEGIN}{table}\n({date.today()}){chr(10)}{END}{after}",
                      encoding="utf-8")


def parser() -> argparse.ArgumentParser:
    """The command line."""
    result = argparse.ArgumentParser(prog="python -m runs stress", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    result.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(PARTS)} "
                        "(default: all)")
    result.add_argument("-o", "--output", type=Path, default=Path("out/stress"), metavar="DIR")
    result.add_argument("--share", type=float, default=1.0, metavar="X", help="of the number of "
                        "attempts; a small one for a quick look")
    result.add_argument("--write", action="store_true", help="put the table into "
                        "runs/stress/README.md")
    return result


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

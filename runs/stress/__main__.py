"""`python -m runs stress`: scenes, damage and kills meant to break the solver, and what then held.

What each part found is kept in OUT/PART.json, so that the parts can be run one by one; the table of
all that have been run, one line per claim, goes into OUT/stress.md, with --write also into
runs/stress/README.md.
"""

import argparse
import json
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from datetime import date
from pathlib import Path

from runs.stress import breaking, disk, kills, malformed, signals, soak, valid
from runs.stress.result import Result

PARTS: dict[str, Callable[[Path, float], list[Result]]] = {
    "breaking": breaking.main, "valid": valid.main, "signals": signals.main, "kills": kills.main,
    "disk": disk.main, "malformed": malformed.main, "soak": soak.main}
README = Path(__file__).with_name("README.md")
HEAD = "| part | tried | what has to hold | held | found | on |\n|---|---|---|---|---|---|\n"
BEGIN, END = "<!-- table: python -m runs stress --write -->\n", "<!-- end of table -->\n"


def main(arguments: list[str]) -> int:
    """Run the parts that are asked for; exit code 1 where something did not hold."""
    options = parser().parse_args(arguments)
    failed = False
    for name in options.parts or PARTS:
        out = options.output / name
        shutil.rmtree(out, ignore_errors=True)
        start = time.perf_counter()
        found = PARTS[name](out.resolve(), options.share)
        print(f"{name}: {time.perf_counter() - start:.0f} s")
        for result in found:
            print(result.row(), *result.failures, sep="\n  ", flush=True)
        kept = {"date": str(date.today()), "results": [asdict(result) for result in found]}
        (options.output / f"{name}.json").write_text(json.dumps(kept, indent=1), encoding="utf-8")
        failed = failed or any(result.failures for result in found)
    table = table_of(options.output)
    (options.output / "stress.md").write_text(table, encoding="utf-8")
    if options.write:
        write_table(table)
    return int(failed)


def table_of(out: Path) -> str:
    """The table of all parts that have been run into this folder."""
    lines = [HEAD]
    for name in PARTS:
        try:
            kept = json.loads((out / f"{name}.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        lines += [f"| `{name}` {Result(**one).row()} {kept['date']} |\n"
                  for one in kept["results"]]
    return "".join(lines)


def write_table(table: str) -> None:
    """Put the table between its marks."""
    before, rest = README.read_text(encoding="utf-8").split(BEGIN)
    README.write_text(f"{before}{BEGIN}{table}{END}{rest.split(END)[1]}", encoding="utf-8")


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

"""What is in a run, is it whole, and how do other programs get it?

    python -m solver.results list OUT                    the files, with sizes and what they hold
    python -m solver.results verify OUT                  every file against its checksum
    python -m solver.results summary OUT                 the run in numbers
    python -m solver.results index OUT                   run.xdmf anew, for ParaView
    python -m solver.results convert OUT --to usd -o DIR [--frames A:B:C]
"""

import argparse
import signal
import sys
from pathlib import Path

from solver.files import FileError, chosen_frames
from solver.results import convert, look
from solver.xdmf import NAME, Index


def main(arguments: list[str] | None = None) -> int:
    """Exit code 0, 1 where `verify` finds something wrong, 2 after one line about bad input."""
    options = parser().parse_args(arguments)
    try:
        if options.command == "convert":
            convert.check_target(options.run, options.output)
            made = convert.FORMATS[options.to](options.run, options.output,
                                               chosen_frames(options.run, options.frames))
            print(f"{len(made)} file{'s' * (len(made) != 1)}: {', '.join(map(str, made[:3]))}"
                  + (" ..." if len(made) > 3 else ""))
            return 0
        if options.command == "index":
            look.refuse_no_run(options.run)
            print(f"{options.run / NAME}: {Index(options.run).rebuild()} frames")
            return 0
        lines, bad = {"list": look.listing, "verify": look.verified,
                      "summary": look.summary}[options.command](options.run)
        print("\n".join(lines))
        return 1 if bad else 0
    except FileError as error:
        print(f"error: {error}", file=sys.stderr)
    except OSError as error:
        place = error.filename or getattr(options, "output", options.run)
        print(f"error: {place}: {error.strerror}; fix: give another path", file=sys.stderr)
    except ModuleNotFoundError as error:
        print(f"error: {options.command} needs {error.name}, which is not installed; "
              "fix: bash runs/setup_ecosystem.sh, then .venv-ecosystem/bin/python -m "
              "solver.results ...", file=sys.stderr)
    return 2


def parser() -> argparse.ArgumentParser:
    """The command line."""
    result = argparse.ArgumentParser(prog="python -m solver.results", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = result.add_subparsers(dest="command", required=True)
    for name, meaning in (("list", "the files of a run"), ("verify", "compare with checksums"),
                          ("summary", "the run in numbers"), ("index", "write run.xdmf anew"),
                          ("convert", "write a run for another program")):
        command = commands.add_parser(name, help=meaning)
        command.add_argument("run", type=Path, metavar="OUT", help="the folder of a run")
        if name == "convert":
            command.add_argument("--to", required=True, choices=sorted(convert.FORMATS))
            command.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
            command.add_argument("--frames", metavar="A:B:C", help="only these, as in a slice")
    return result


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)   # `... | head` has seen enough
    sys.exit(main())

"""The thesis' diagrams of chapters 3 to 5, drawn from the code as it is, with their numbers."""

import argparse
import sys
from pathlib import Path

from partition.figures import fold, levels, octahedron, string, triangulations, weak_lines

FIGURES = {
    "triangulations": "3.4 - 3.6: trisection, Voronoi regions and Delaunay triangles of 200 points",
    "levels": "4.1, 4.2: the first two cuts of a breadth-first search",
    "string": "4.3: a vibrating string, as the eigenvectors of a path",
    "fold": "4.4, 4.5: a curved surface breaks where it is curved most",
    "octahedron": "4.6, 4.7: the worked example, with its right eigenvalues",
    "weak_lines": "5.3 and Table 5.2: an animal, a bear, a pumpkin and a statue break in two",
}

DRAW = {"triangulations": triangulations.draw, "levels": levels.draw, "string": string.draw,
        "fold": fold.draw, "octahedron": octahedron.draw, "weak_lines": weak_lines.draw}


def main(arguments: list[str] | None = None) -> int:
    """Exit code 0, or 2 after one line about bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m partition.figures", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="\n".join(f"{name:15} {text}" for name, text in FIGURES.items()))
    parser.add_argument("name", nargs="*", choices=[*FIGURES, []], metavar="NAME",
                        help="which; all, if none is given")
    parser.add_argument("-o", "--output", type=Path, default=Path(), metavar="DIR",
                        help="where NAME.png goes (default: here)")
    options = parser.parse_args(arguments)
    try:
        options.output.mkdir(parents=True, exist_ok=True)
        for name in options.name or FIGURES:
            path = options.output / f"{name}.png"
            numbers = DRAW[name](path)
            print(f"{path}: figure {FIGURES[name]}")
            print("\n".join(f"  {line}" for line in numbers))
    except OSError as error:
        print(f"error: {error.filename or options.output}: cannot be written "
              f"({error.strerror or error}); fix: give another folder", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

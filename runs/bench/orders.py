"""Is the flow as accurate as it should be? Observed orders of the default on every exact case.

    python -m runs bench orders [case ...]       (a few minutes; default: all with an order)

For each field the error on the finest grid of the case's ladder, in L2 and L∞, and the order at
which it has fallen from the grid before. Writes results/orders.csv, prints a table, and ends with
exit code 1 where an order is below the one that the case expects.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from runs.bench import chart
from runs.exact import case

RESULTS = Path(__file__).parent / "results"
Row = tuple[Any, ...]


def main(argv: list[str]) -> int:
    """Run the ladders of the named cases."""
    names = argv or [name for name in case.names() if "order" in case.answer(name)]
    rows = [row for name in names for row in measure(name)]
    RESULTS.mkdir(exist_ok=True)
    chart.write_csv(RESULTS / "orders.csv", "case,temperature,field,before,cells,l2,max,order_l2,"
                    "order_max,expected_l2,expected_max", rows,
                    f"python -m runs bench orders {' '.join(argv)}".rstrip())
    show(rows)
    low = [row for row in rows if not good(row)]
    for row in low:
        print(f"{row[0]} {row[1]}: {row[2]} falls with {row[7]:.2f}, {row[8]:.2f} (L2, L∞), not "
              f"with {row[9]:g}, {row[10]:g}")
    print(f"{len(rows) - len(low)} of {len(rows)} orders as expected")
    return 1 if low else 0


def show(rows: list[Row]) -> None:
    """Orders in L2 and L∞, a line per case and scheme of the temperature, a column per field."""
    print("| case | cells | u | v | w | p | T |\n|---|---|---|---|---|---|---|")
    for case_ in dict.fromkeys((row[0], row[1], row[3], row[4]) for row in rows):
        found = {row[2]: f"{row[7]:.2f}, {row[8]:.2f}" for row in rows
                 if (row[0], row[1]) == case_[:2]}
        print(f"| {case_[0]} {case_[1]} | {case_[2]}, {case_[3]} | "
              + " | ".join(found.get(field, "") for field in "uvwpT") + " |")


def measure(name: str) -> Iterator[Row]:
    """A row for each field, and for each temperature scheme of which an order is expected."""
    cells = case.answer(name)["ladder"]
    for scheme in case.temperature_schemes(name):
        overrides = [f'fluid.temperature_advection="{scheme}"'] if scheme else []
        coarse, fine = (case.run(name, n, overrides) for n in cells[-2:])
        for field in fine.l2:
            errors = fine.l2[field], fine.most[field]
            before = coarse.l2[field], coarse.most[field]
            if before[1] > 1e-12 and not (scheme and field != "T"):
                orders = np.log(np.array(before) / errors) / np.log(cells[-1] / cells[-2])
                yield (name, scheme, field, *cells[-2:], *errors, *map(float, orders),
                       *case.expected(name, field, scheme))


def good(row: Row) -> bool:
    """Whether both orders are at least those that are expected."""
    return bool(row[7] >= row[9] and row[8] >= row[10])

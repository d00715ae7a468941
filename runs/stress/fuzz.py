"""Scenes that somebody has damaged: a valid one with one to three random mistakes in it."""

import copy
import math
from collections.abc import Callable, Iterator
from datetime import date
from typing import Any

import numpy as np
import tomli_w

Tree = dict[str, Any]
TRAP = "trap-was-executed"      # a file that only executed scene text could make

JUNK: tuple[Any, ...] = (
    0, -1, 1, 2**31, 2**63, -2**63 - 1, 10**40, 0.0, -0.0, 1e-300, 1e300, math.nan, math.inf,
    -math.inf, True, "", " ", "\n", "\x00", "ü×→\U0001f4a5", "x" * 300, "y" * 100_000, "nan",
    "open", "wall", [], {}, [[]], [1], [1, 2, 3, 4], [math.nan] * 3, [[[[1]]]], ["a", 1, 2.0],
    {"x": {"y": {"z": 1}}}, {"wall": [1, 2, 3]}, date(2005, 1, 1), "../../escape", "/etc/passwd",
    "/dev/zero", "/proc/self/mem", "~/x", "$(touch " + TRAP + ")", "`touch " + TRAP + "`", "%s%n",
    "; touch " + TRAP,
    f"__import__ ('os').system('touch {TRAP}')", f"open('{TRAP}','w')", "x.__class__",
    f"().__class__.__base__.__subclasses__()[0]('{TRAP}')", "9**9**9**9", "x**9**9**9", "1/0",
    "(" * 5000 + "x" + ")" * 5000, "x+" * 3000 + "x", "lambda: 1", "x if x else y", "x[0]",
    "exec('1')", "f(x)", "x;y", "import os", "1e999", "sqrt(-x)", "1/(x-x)", "where(x)", "x.real")


def damaged(text: str, tree: Tree, random: np.random.Generator) -> bytes:
    """A damaged copy of a scene: of its text, or of what the text says."""
    if random.random() < 0.3:
        data = bytearray(text.encode())
        for _ in range(random.integers(1, 4)):
            pick(random, BYTES)(data, random)
        return bytes(data)
    tree = copy.deepcopy(tree)
    for _ in range(random.integers(1, 4)):
        pick(random, CHANGES)(tree, random)
    return tomli_w.dumps(tree).encode("utf-8", "surrogatepass")


def pick(random: np.random.Generator, things: Any) -> Any:
    """One of several things, as it is."""
    return things[int(random.integers(len(things)))]


# --- mistakes in the text ------------------------------------------------------------------------

def _cut(data: bytearray, random: np.random.Generator) -> None:
    del data[int(random.integers(len(data) + 1)):]


def _drop(data: bytearray, random: np.random.Generator) -> None:
    start = int(random.integers(len(data) + 1))
    del data[start:start + int(random.integers(1, 40))]


def _repeat(data: bytearray, random: np.random.Generator) -> None:
    start = int(random.integers(len(data) + 1))
    data[start:start] = data[start:start + int(random.integers(1, 200))]


def _garble(data: bytearray, random: np.random.Generator) -> None:
    start = int(random.integers(len(data) + 1))
    data[start:start] = random.integers(0, 256, int(random.integers(1, 9))).astype("u1").tobytes()


def _insert(data: bytearray, random: np.random.Generator) -> None:
    start = int(random.integers(len(data) + 1))
    data[start:start] = pick(random, (b"\n[", b"]]", b'"', b"=", b"\n[[body]]\n", b"#", b"\r",
                                      b"\xef\xbb\xbf", b"\xff\xfe", b"[" * 4000, b"9" * 6000,
                                      b"{a={" * 2000, b"\n[time]\nend = 1\n", b"'''"))


BYTES: tuple[Callable[[bytearray, np.random.Generator], None], ...] = (
    _cut, _drop, _repeat, _garble, _insert)


# --- mistakes in what it says --------------------------------------------------------------------

def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    """Every entry of every table and list, as (container, key)."""
    entries = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in list(entries):
        yield tree, key
        if isinstance(value, dict | list):
            yield from _places(value)


def _replace(tree: Tree, random: np.random.Generator) -> None:
    places = list(_places(tree))
    if places:
        container, key = pick(random, places)
        container[key] = copy.deepcopy(pick(random, JUNK))


def _rename(tree: Tree, random: np.random.Generator) -> None:
    places = [(c, k) for c, k in _places(tree) if isinstance(c, dict)]
    if places:
        container, key = pick(random, places)
        container[pick(random, (key + "s", key.upper(), "", "é", "__class__", "a.b"))] = (
            container.pop(key))


def _remove(tree: Tree, random: np.random.Generator) -> None:
    places = list(_places(tree))
    if places:
        container, key = pick(random, places)
        del container[key]


def _move(tree: Tree, random: np.random.Generator) -> None:
    tables = [value for value in tree.values() if isinstance(value, dict) and value]
    if len(tables) > 1:
        source, target = pick(random, tables), pick(random, tables)
        target.setdefault(*pick(random, list(source.items())))


def _scale(tree: Tree, random: np.random.Generator) -> None:
    numbers = [(c, k) for c, k in _places(tree)
               if isinstance(c[k], int | float) and not isinstance(c[k], bool)]
    if numbers:
        container, key = pick(random, numbers)
        container[key] = container[key] * float(pick(random, (-1.0, 0.0, 1e-12, 0.5, 7.0, 1e6)))


def _set_formula(tree: Tree, random: np.random.Generator) -> None:
    texts = [value for value in JUNK if isinstance(value, str)]
    tree.setdefault("initial", {})
    if isinstance(tree["initial"], dict):
        tree["initial"][pick(random, ("u", "v", "w", "T"))] = pick(random, texts)


CHANGES: tuple[Callable[[Tree, np.random.Generator], None], ...] = (
    _replace, _replace, _replace, _rename, _remove, _move, _scale, _set_formula)

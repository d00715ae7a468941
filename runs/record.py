"""Is a result still what its sources would give? Answered by content, as `make` does it by date.

OUT/made.json keeps, for every finished stage, a digest of each source (a section of the scene, an
input file, the code) and of each file it made. A stage is up to date while all of them stay.
Reading a file twice is avoided as git avoids it: while size and date stay, the digest stays.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from solver.files_whole import replacing

Digests = dict[str, str]


def digest_of(value: Any) -> str:
    """Digest of anything that JSON can hold."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


class Record:
    """The contents of OUT/made.json, saved after every change."""

    def __init__(self, directory: Path):
        self.directory = directory
        self.path = directory / "made.json"
        self._stages: dict[str, dict[str, Digests]] = {}
        self._files: dict[str, tuple[int, int, str]] = {}  # path: size, date in ns, digest
        self.seconds: dict[str, float] = {}   # that each stage took when it ran last
        try:
            stored = json.loads(self.path.read_text(encoding="utf-8"))
            self._stages, self._files = stored["stages"], stored["files"]
            self.seconds = stored.get("seconds", {})
        except (OSError, ValueError, KeyError, TypeError):
            pass  # none yet, or damaged: everything is redone, which is always right

    def file_digest(self, path: Path) -> str:
        """Digest of the contents of a file."""
        path = path.absolute()
        status = path.stat()
        size, date, digest = self._files.get(str(path), (-1, -1, ""))
        if (size, date) != (status.st_size, status.st_mtime_ns):
            with open(path, "rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            self._files[str(path)] = (status.st_size, status.st_mtime_ns, digest)
        return digest

    def file_digests(self, paths: Iterable[Path]) -> Digests:
        """Digests of files under their names, relative to OUT where they are in it."""
        return {self._name(path): self.file_digest(path) for path in paths}

    def why_outdated(self, stage: str, sources: Mapping[str, str]) -> str:
        """Why the stage has to run again, in a few words; empty if it is up to date."""
        if not self._stages.get(stage):
            return "interrupted last time" if self.knows(stage) else "not made yet"
        before = self._stages[stage]["sources"]
        changed = [name for name in (before | dict(sources))
                   if before.get(name) != sources.get(name)]
        if changed:
            return f"{_some(changed)} changed"
        damaged = [name for name, digest in self._stages[stage]["products"].items()
                   if not (self.directory / name).is_file()
                   or self.file_digest(self.directory / name) != digest]
        return f"{_some(damaged)} missing or altered" if damaged else ""

    def knows(self, stage: str) -> bool:
        """Whether the stage was ever begun here, so that what is there is ours to replace."""
        return stage in self._stages

    def forget(self, stage: str, reusable: frozenset[str] = frozenset()) -> None:
        """Delete what a stage made, except for the files named in `reusable`."""
        for name in self._stages.pop(stage, {}).get("products", {}).keys() - reusable:
            (self.directory / name).unlink(missing_ok=True)

    def begin(self, stage: str, reusable: frozenset[str] = frozenset()) -> None:
        """Before a stage runs; nothing old stays among the new but what it may reuse."""
        self.forget(stage, reusable)
        self._stages[stage] = {}
        self._save()

    def remember(self, stage: str, sources: Mapping[str, str], products: Iterable[Path],
                 seconds: float) -> None:
        """After a stage has finished."""
        self.seconds[stage] = seconds
        self._stages[stage] = {"sources": dict(sources), "products": self.file_digests(products)}
        self._save()

    def _name(self, path: Path) -> str:
        path = path.absolute()
        root = self.directory.absolute()
        return str(path.relative_to(root) if path.is_relative_to(root) else path)

    def _save(self) -> None:
        self._files = {path: entry for path, entry in self._files.items() if os.path.exists(path)}
        with replacing(self.path) as temporary:
            temporary.write_text(json.dumps({"stages": self._stages, "files": self._files,
                                             "seconds": self.seconds}, indent=1), encoding="utf-8")


def _some(names: list[str]) -> str:
    rest = f" and {len(names) - 2} more" if len(names) > 2 else ""
    return ", ".join(names[:2]) + rest

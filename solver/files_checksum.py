"""Is a file still what was written? SHA-256 of a run's files, beside them in SHA256SUMS.

By `check`, or by `sha256sum -c SHA256SUMS` in the folder of the file.
"""

import hashlib
import os
from pathlib import Path

from solver.files import FileError, WriteError, open_file

CHECKSUMS = "SHA256SUMS"


def checksum(path: Path) -> str:
    """SHA-256 of a file's content."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def checksums(directory: Path) -> dict[str, str]:
    """Name and checksum of the files of a folder, as far as they were recorded."""
    try:
        lines = (directory / CHECKSUMS).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return {}
    pairs = [line.split("  ", 1) for line in lines]
    return {pair[1]: pair[0] for pair in pairs if len(pair) == 2}


def record_checksum(path: Path, known: str | None = None) -> None:
    """Note the checksum of a file (computed here unless given); one line more, or where the name
    has one already a new table, which forgets files that are gone."""
    table, digest = path.with_name(CHECKSUMS), known or checksum(path)
    lines = checksums(path.parent)
    try:
        if path.name not in lines:
            with open(table, "a", encoding="utf-8") as file:
                file.write(_line(path.name, digest))
            return
        lines[path.name] = digest
        temporary = path.with_name(CHECKSUMS + ".tmp")
        temporary.write_text("".join(_line(name, lines[name]) for name in sorted(lines)
                                     if path.with_name(name).exists()), encoding="utf-8")
        os.replace(temporary, table)
    except OSError as error:
        raise WriteError(f"{table}: cannot be written ({error.strerror}); fix: make room or choose "
                         "another disk; finished files are intact") from None


def _line(name: str, digest: str) -> str:
    return f"{digest}  {name}\n"


def check(path: Path, form: str) -> str:
    """What is wrong with a file, or ""; its bytes are compared with its recorded checksum."""
    try:
        with open_file(path, form):
            pass
    except FileError as error:
        return str(error)
    recorded = checksums(path.parent).get(path.name)
    if recorded is not None and recorded != checksum(path):
        return f"{path}: damaged, its checksum is not the one in {CHECKSUMS}; fix: make it again"
    return ""

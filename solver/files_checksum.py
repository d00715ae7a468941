"""Is a file still what was written? SHA-256 of a run's files, beside them in SHA256SUMS.

By `check`, or by `sha256sum -c SHA256SUMS` in the folder of the file.
"""

from pathlib import Path

from solver.files import CHECKSUMS, FileError, WriteError, checksum, checksums, open_file
from solver.files_whole import replacing


def record_checksum(path: Path, known: str | None = None) -> None:
    """Note the checksum of a file (computed here unless given); a name that has one already gets
    the new one."""
    digest = known or checksum(path)
    forget_checksum(path)
    table = path.with_name(CHECKSUMS)
    try:
        with open(table, "a", encoding="utf-8") as file:
            file.write(_line(path.name, digest))
    except OSError as error:
        raise _unwritable(table, error) from None


def forget_checksum(path: Path) -> None:
    """Before a file is replaced: its old checksum must not outlive it. Files that are gone are
    forgotten with it."""
    table = path.with_name(CHECKSUMS)
    try:
        if f"  {path.name}\n".encode() not in table.read_bytes():
            return
    except OSError:
        return
    lines = checksums(path.parent)
    lines.pop(path.name, None)
    try:
        with replacing(table) as temporary:
            temporary.write_text("".join(_line(name, lines[name]) for name in sorted(lines)
                                         if path.with_name(name).exists()), encoding="utf-8")
    except OSError as error:
        raise _unwritable(table, error) from None


def _unwritable(table: Path, error: OSError) -> WriteError:
    return WriteError(f"{table}: cannot be written ({error.strerror}); fix: make room or choose "
                      "another disk; finished files are intact")


def _line(name: str, digest: str) -> str:
    return f"{digest}  {name}\n"


def check(path: Path, form: str) -> str:
    """What is wrong with a file, or ""; its bytes are compared with its recorded checksum."""
    try:
        with open_file(path, form):
            return ""
    except FileError as error:
        return str(error)

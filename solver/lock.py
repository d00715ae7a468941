"""Is another run writing into this folder? Two at once would mix their files.

A lock of the system (flock) on OUT/.lock, held by rank 0's process and gone with it, however it
ends. The ranks of a run whose mpirun was killed need a moment to end: a new one waits for them.
"""

import fcntl
import time
from pathlib import Path
from typing import IO

from solver.files import FileError

PATIENCE = 10.0   # s


def hold(out: Path, patience: float = PATIENCE) -> IO[str] | None:
    """The lock of a folder (which is made), until it is closed; None where the disk knows no locks.
    Raises `FileError` where another process keeps it."""
    out.mkdir(parents=True, exist_ok=True)
    file = open(out / ".lock", "a", encoding="utf-8")
    stop = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return file
        except BlockingIOError:
            if time.monotonic() > stop:
                file.close()
                raise FileError(f"{out}: another run is writing here; fix: wait for it, stop it "
                                f"(touch {out / 'stop'}), or choose another folder") from None
            time.sleep(0.1)
        except OSError:
            file.close()
            return None

"""A program of the project, and a note of everything it does to the world outside its folder.

    python -m runs.stress.watched LOG OUT MODULE ARGUMENTS...

Python's audit events tell each file opened for writing, each path made, moved or removed, each
program started. What lies in OUT, in a __pycache__ (compiled kernels) or is a device is no harm.
"""

import os
import runpy
import sys
from pathlib import Path
from typing import Any

PATHS = {"os.mkdir": 1, "os.remove": 1, "os.rmdir": 1, "os.rename": 2, "os.link": 2,
         "os.symlink": 2, "os.truncate": 1, "os.chmod": 1}
PROGRAMS = ("os.system", "subprocess.Popen", "os.exec", "os.posix_spawn", "pty.spawn")
HARMLESS = ("/dev/", "/proc/self/")
LAUNCHER = ("lscpu", "uname", "ldconfig", "orted")    # that libraries ask about the machine


def watch(log: Path, out: Path) -> None:
    """From now on, write to `log` what reaches outside `out`."""
    ours = str(out.resolve())
    report = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def harmless(path: Any) -> bool:
        if isinstance(path, int) or path is None:
            return True
        text = os.path.abspath(os.fsdecode(path))
        return (text == ours or text.startswith((ours + os.sep, *HARMLESS))
                or "__pycache__" in text)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, mode, flags = arguments
            writes = flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) if flags else (
                mode is not None and set(str(mode)) & set("wax+"))
            if writes and not harmless(path):
                os.write(report, f"open {path!r}\n".encode())
        elif event in PATHS:
            for path in arguments[:PATHS[event]]:
                if not harmless(path):
                    os.write(report, f"{event} {path!r}\n".encode())
        elif event in PROGRAMS and not any(name in repr(arguments) for name in LAUNCHER):
            os.write(report, f"{event} {arguments[:2]!r}\n".encode())

    sys.addaudithook(hook)


if __name__ == "__main__":
    _, log_path, out_path, module, *rest = sys.argv
    sys.argv = [module, *rest]
    watch(Path(log_path), Path(out_path))
    runpy.run_module(module, run_name="__main__", alter_sys=True)

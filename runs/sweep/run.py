"""One run of a sweep in its folder, begun, continued or left alone: as often as it is asked for.

A folder is done when status.json says so and the table still says what it ran with; a run that was
killed or stopped is continued; where its values have changed it is made anew.
"""

import json
import signal
import subprocess
import sys
from pathlib import Path
from types import FrameType
from typing import Any

from runs.ranks import environment, mpirun
from runs.sweep.table import Case

VALUES = "sweep.json"


def status(folder: Path) -> dict[str, Any]:
    """What status.json of a run says, or nothing."""
    try:
        found = json.loads((folder / "status.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def made_with(folder: Path) -> Any:
    """The values and the scene that a folder was begun with."""
    try:
        return json.loads((folder / VALUES).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def wanted(case: Case) -> Any:
    """What a folder of this case has to have been begun with."""
    data = case.scene.model_dump(mode="json", exclude={"render"})
    return json.loads(json.dumps({"values": case.values, "scene": data}, default=str))


def is_done(case: Case, folder: Path) -> bool:
    """Whether nothing is left to do."""
    return status(folder).get("state") == "done" and made_with(folder) == wanted(case)


def bring_up(case: Case, folder: Path, ranks: int, options: list[str]) -> int:
    """Begin or continue the run; its exit code."""
    continued = made_with(folder) == wanted(case)
    folder.mkdir(parents=True, exist_ok=True)
    scene = str(case.scene.path)
    overrides = [part for override in case.overrides for part in ("--set", override)]
    fragments = folder / "fragments.h5"
    if case.scene.body and not (continued and fragments.is_file()):
        code = execute([sys.executable, "-m", "partition", scene, *overrides, "-o",
                        str(fragments)], folder)
        if code:
            return code
    (folder / VALUES).write_text(json.dumps(wanted(case), indent=1) + "\n", encoding="utf-8")
    return execute([*mpirun(ranks), sys.executable, "-m", "solver", scene, *overrides, "-o",
                    str(folder), "--restart" if continued else "--overwrite", *options], folder)


def execute(command: list[str], folder: Path) -> int:
    """Run a program, its output in sweep.log; signals that ask to stop or save reach it."""
    with open(folder / "sweep.log", "ab") as log:
        process = subprocess.Popen(command, env=environment(), stdin=subprocess.DEVNULL, stdout=log,
                                   stderr=subprocess.STDOUT)

        def pass_on(number: int, _: FrameType | None) -> None:
            process.send_signal(signal.SIGUSR1 if number == signal.SIGTERM else number)

        before = {number: signal.signal(number, pass_on)
                  for number in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGTERM)}
        try:
            code = process.wait()
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
    return code if code >= 0 else 128 - code


def last_error(folder: Path) -> str:
    """The line in which a run said why it failed."""
    try:
        lines = (folder / "sweep.log").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    errors = [line for line in lines if "error:" in line]
    return errors[-1] if errors else ""

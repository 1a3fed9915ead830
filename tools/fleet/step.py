"""One step of a night: runs a command and notes how it ended.

    step.py [--after BEFORE.json] RESULT.json COMMAND...

RESULT.json has the command, its exit code, its seconds, and its last line on standard error. Exit codes 0, 2 (refused)
and 3 (lost) are results: the step is done. With another code, or killed, the step has failed, and no RESULT.json is
written, so that the workflow does it again. With --after, a step is left out if the one before was refused.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

RESULTS = (0, 2, 3)
RESUME = "--resume"


def run(command: list) -> subprocess.CompletedProcess:
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def write(path: Path, note: dict) -> None:
    partial = path.with_suffix(".part")
    partial.write_text(json.dumps(note, indent=1) + "\n")
    os.replace(partial, path)


def main(arguments: list) -> int:
    before = None
    if arguments[0] == "--after":
        before = json.loads(Path(arguments[1]).read_text())
        arguments = arguments[2:]
    result, command = Path(arguments[0]), arguments[1:]
    result.parent.mkdir(parents=True, exist_ok=True)
    if before is not None and before["code"] == 2:
        write(result, {"command": command, "code": 2, "seconds": 0.0, "message": before["message"]})
        return 0
    start = time.monotonic()
    try:
        done = run(command)
        if done.returncode == 2 and RESUME in command and "cannot be resumed" in done.stderr:
            done = run([word for word in command if word != RESUME])  # what is there is of other inputs
    except OSError as error:
        print(f"{command[0]}: {error.strerror}; set 'lodestone' in the configuration", file=sys.stderr)
        return 1
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    message = lines[-1] if lines else ""
    if done.returncode not in RESULTS:
        print(done.stderr, end="", file=sys.stderr)
        return 1
    write(result, {"command": command, "code": done.returncode, "seconds": round(time.monotonic() - start, 1),
                   "message": message})
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""One step of an experiment: experiment_step.py FOLDER, in the folder of results (tools/fleet/experiment.smk).

Runs the commands of the step of logs/steps.json that makes FOLDER, one after the other, with their output in the
step's log. FOLDER is emptied before. Then removes intermediate files, and writes step.json last: a step without it is
not done. Ends with 1 if a command failed; the last line of the log says why.
"""

import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

TRACK_LOST = 3  # a valid result of `lodestone run`


def run(command: list, log) -> int:
    """Returns the exit code, negative for a signal. An interruption reaches the command itself: it is waited for."""
    child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)
    while True:
        try:
            return child.wait()
        except KeyboardInterrupt:
            pass


def main(name: str) -> int:
    plan = json.loads(Path("logs/steps.json").read_text())
    step = next(step for step in plan["steps"] if step["folder"] == name)
    results = (0, TRACK_LOST) if step["kind"] == "run" else (0,)
    start = time.monotonic()
    folder = Path(step["folder"])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    with open(step["log"], "w") as log:
        for words in step["commands"]:
            if step["kind"] != "difference":
                words = words + ["--threads", str(plan["threads"])]
            print("$ lodestone", *words, file=log, flush=True)
            code = run([plan["program"], *words], log)
            if code not in results:
                reason = f"ended by signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
                print(reason, file=log)
                return 1
    for file in step["intermediate"]:
        Path(file).unlink(missing_ok=True)
    seconds = round(time.monotonic() - start, 1)
    partial = folder / "step.part"
    partial.write_text(json.dumps({**json.loads(step["stamp"]), "seconds": seconds}, indent=2) + "\n")
    partial.replace(folder / "step.json")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))

"""One line for each step of an experiment that ends, on descriptor 3: Snakemake's --log-handler-script."""

import json
import os
import time
from pathlib import Path

try:
    out = os.fdopen(3, "w")
except OSError:  # a job on a cluster's node
    out = open(os.devnull, "w")
start = time.monotonic()
steps = {step["folder"]: step for step in json.loads(Path("logs/steps.json").read_text())["steps"]}
running = {}  # job → step
ended = 0


def clock(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"


def tell(text: str) -> None:
    global ended
    ended += 1
    left = len(steps) - ended
    if left:
        text += f"; about {clock((time.monotonic() - start) / ended * left)} left"
    print(f"[{ended}/{len(steps)}] {text}", file=out, flush=True)


def reason(log: str) -> str:
    """The program's last words, with how it ended."""
    try:
        lines = [line for line in Path(log).read_text(errors="replace").splitlines() if line.strip()]
    except OSError:
        lines = []
    words = [line.removeprefix("lodestone: ") for line in lines[-2:] if not line.startswith("$ ")]
    return ": ".join(reversed(words)) or "did not start"


def log_handler(message: dict) -> None:
    if message["level"] == "job_info":
        for output in message["output"]:
            running[message["jobid"]] = steps[str(output).removesuffix("/step.json")]
    elif message["level"] == "job_finished" and running.get(message["jobid"]):
        step = running.pop(message["jobid"])
        seconds = json.loads((Path(step["folder"]) / "step.json").read_text())["seconds"]
        tell(f"{step['name']}: done in {seconds:.0f} s")
    elif message["level"] == "job_error" and running.get(message["jobid"]):
        step = running.pop(message["jobid"])
        tell(f"{step['name']}: {reason(step['log'])} (see {step['log']})")

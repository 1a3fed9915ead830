"""One line for each step of an experiment that ends, on descriptor 3: Snakemake's --log-handler-script."""

import json
import os
import time
from pathlib import Path

out = os.fdopen(3, "w")
start = time.monotonic()
steps = {step["folder"]: step for step in json.loads(Path("logs/steps.json").read_text())["steps"]}
running = {}  # job → step and its start
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


def note(message: dict) -> None:
    if message["level"] == "job_info":
        for output in message["output"]:
            running[message["jobid"]] = steps[str(output).removesuffix("/step.json")], time.monotonic()
    elif message["level"] in ("job_finished", "job_error") and message["jobid"] in running:
        step, begin = running.pop(message["jobid"])
        if message["level"] == "job_finished":
            tell(f"{step['name']}: done in {time.monotonic() - begin:.0f} s")
        elif not reason(step["log"]).startswith("exit code 130"):  # interrupted
            tell(f"{step['name']}: {reason(step['log'])} (see {Path(step['log']).resolve()})")


def log_handler(message: dict) -> None:
    """Called within Snakemake's scheduler, which an exception would stop."""
    try:
        note(message)
    except (OSError, ValueError, KeyError):
        pass

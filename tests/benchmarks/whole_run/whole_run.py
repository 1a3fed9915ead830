#!/usr/bin/env python3
"""Time of whole runs, divided into their work: ms a scan as the main thread waits for it, and times real time.

    tests/benchmarks/whole_run/whole_run.py DIR [PROGRAM ...] [--reality GRADE] [--estimator NAME] [--repeats N]

DIR: the drive of docs/results/speed.md is made there if it is missing; this takes minutes. Programs are run in turn, on
one thread and on two, so that the machine's slower hours are the same for all; default: that of build/release. The
median of the repeats counts. The last row is the ratio to the first program on one thread.
"""

import argparse
import json
import os
import statistics
import subprocess
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = ROOT / "build/release/bin/lodestone"
WORKS = "read sample associate weigh solve covariance marginalize estimate health write".split()


def call(*words):
    """Calls a program. Returns its wall time, s."""
    begin = time.perf_counter()
    done = subprocess.run([str(word) for word in words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, words))}\n{done.stderr}")
    return time.perf_counter() - begin


def make_drive(program, drive, reality):
    simulate_s = call(program, "simulate", ROOT / "config/worlds/warehouse.yaml", "--sequence", 1, "--reality", reality,
                      "--seed", 13, "--duration", 60, "--out", drive)
    map_s = call(program, "map", "magnetic", drive / "survey.bag", "--trajectory", drive / "survey.tum", "--platform",
                 drive / "platform.yaml", "--out", drive / "field.yaml")
    print(f"`simulate` {simulate_s:.1f} s, `map magnetic` {map_s:.1f} s, on all threads\n")


def run(program, drive, estimator, threads):
    """One run. Returns ms a scan of each work, the rest, times real time, and the peak memory, MB."""
    out = drive / "whole_run"
    call(program, "run", drive / "log.bag", "--platform", drive / "platform.yaml", "--cloud", drive / "cloud.pcd",
         "--magnetic", drive / "field.yaml", "--initial-pose-from", drive / "truth.tum", "--max-range", 100,
         "--estimator", estimator, "--threads", threads, "--out", out)
    summary = json.loads((out / estimator / "summary.json").read_text())
    result = {work: 1e3 * summary["work_s"].get(work, 0.0) / summary["scans"] for work in WORKS}
    result["whole run"] = 1e3 * summary["wall_s"] / summary["scans"]
    result["times real time"] = summary["duration_s"] / summary["wall_s"]
    result["peak MB"] = summary["peak_rss_mb"]
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dir", type=Path)
    parser.add_argument("programs", nargs="*", type=Path, default=[PROGRAM])
    parser.add_argument("--reality", default="field")
    parser.add_argument("--estimator", default="smoother")
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    os.environ["LC_ALL"] = "C"
    drive = options.dir / options.reality
    if not (drive / "field.yaml").exists():
        make_drive(options.programs[0], drive, options.reality)
    cases = [(program, threads) for program in options.programs for threads in (1, 2)]
    results = {case: [] for case in cases}
    for _ in range(options.repeats):
        for case in cases:
            results[case].append(run(case[0], drive, options.estimator, case[1]))
    medians = [{row: statistics.median(one[row] for one in runs) for row in runs[0]} for runs in results.values()]
    for one in medians:
        one["speed, ratio"] = one["times real time"] / medians[0]["times real time"]
    print("| |", " | ".join(f"{program}, {threads} thread{'s' * (threads > 1)}" for program, threads in cases), "|")
    print("|---" * (len(cases) + 1) + "|")
    for row in medians[0]:
        if any(one[row] > 0.0 for one in medians):
            print(f"| {row} |", " | ".join(f"{one[row]:.3g}" for one in medians), "|")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""How often an estimate is `good` although it is wrong, and `lost` although it is right.

    tests/benchmarks/health/wrong_starts.py FOLDER... [--starts N] [--seed S] [--max-range M] [--out DIR]

Each FOLDER has the files of `lodestone simulate` and a magnetic map field.yaml of `lodestone map magnetic`. The log
runs from its true initial pose, and from N wrong ones: in turn the place of another pose of the drive with any heading,
and a place 1.2 to 5 m beside the true one. One row of a table for each folder, Markdown.

Wrong: the newest position of a scan is more than 0.5 m off. Only the standard library is used.
"""
import argparse
import bisect
import csv
import math
import random
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent.parent
WRONG_M = 0.5
LONG_S = 5.0


def parser_of(description, out):
    """The arguments that the benchmarks of health share."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--max-range", type=float)
    parser.add_argument("--program", type=Path, default=ROOT / "build/release/bin/lodestone")
    parser.add_argument("--out", type=Path, default=Path(out))
    return parser


def row_of(folder, call):
    """Name of a folder's row, and the folder for its runs."""
    name = folder.name + (f", {call.max_range:g} m" if call.max_range else "")
    return name, call.out / name.replace(", ", "_").replace(" ", "_")


def read_tum(path):
    rows = [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]
    return [tuple(float(value) for value in row) for row in rows]


def yaw(pose):
    x, y, z, w = pose[4:8]
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def wrong_starts(truth, count, seed):
    """Poses (x, y, z, yaw) far from the true start and near it, in turn."""
    drawn = random.Random(seed)
    start = truth[0]
    result = []
    for i in range(count):
        if i % 2 == 0:
            pose = drawn.choice([p for p in truth if math.dist(p[1:3], start[1:3]) > 4.0] or truth)
            result.append((*pose[1:4], drawn.uniform(-math.pi, math.pi)))
        else:
            bearing, distance = drawn.uniform(-math.pi, math.pi), drawn.uniform(1.2, 5.0)
            x, y = start[1] + distance * math.cos(bearing), start[2] + distance * math.sin(bearing)
            result.append((x, y, start[3], yaw(start) + drawn.uniform(-0.6, 0.6)))
    return result


def run(program, folder, arguments, out, max_range):
    if (out / "summary.json").exists():
        return
    command = [program, "run", folder / "log.bag", "--platform", folder / "platform.yaml",
               "--cloud", folder / "cloud.pcd", "--magnetic", folder / "field.yaml", "--truth", folder / "truth.tum",
               "--out", out, "--quiet", *arguments]
    if max_range:
        command += ["--max-range", str(max_range)]
    code = subprocess.run([str(part) for part in command], stdout=subprocess.DEVNULL).returncode
    if code not in (0, 3):
        sys.exit(f"wrong_starts: {out}: exit code {code}")


def scans(folder, out):
    """Of each scan: time, health, error of the newest position (none: no pose was written)."""
    truth = read_tum(folder / "truth.tum")
    times = [pose[0] for pose in truth]
    errors = {}
    for pose in read_tum(out / "smoother" / "causal.tum"):
        after = min(max(bisect.bisect(times, pose[0]), 1), len(truth) - 1)
        a, b = truth[after - 1], truth[after]
        share = (pose[0] - a[0]) / (b[0] - a[0])
        there = [p + share * (q - p) for p, q in zip(a[1:4], b[1:4])]
        errors[round(pose[0], 5)] = math.dist(there, pose[1:4])
    with open(out / "smoother" / "diagnostics.csv", newline="") as file:
        return [(float(row["t_s"]), row["health"], errors.get(round(float(row["t_s"]), 5)))
                for row in csv.DictReader(file)]


def is_right(scan):
    return scan[2] is not None and scan[2] <= WRONG_M


def is_good_and_wrong(scan):
    return scan[1] == "good" and scan[2] is not None and scan[2] > WRONG_M


class Figures:
    """Sums over the runs of one kind."""

    def __init__(self):
        self.runs = self.scans = self.good_wrong = self.lost = 0
        self.good_wrong_long = self.found = self.said = self.wrong_at_end = 0
        self.seconds_to_lost, self.seconds_to_right = [], []

    def add(self, rows):
        begin, end = rows[0][0], rows[-1][0]
        right = [row for row in rows if is_right(row)]
        lost = [row for row in rows if row[1] == "lost"]
        self.runs += 1
        self.scans += len(rows)
        self.good_wrong += sum(is_good_and_wrong(row) for row in rows)
        self.lost += len(lost)
        longest, since = 0.0, None
        for row in rows:
            if is_good_and_wrong(row):
                since = row[0] if since is None else since
                longest = max(longest, row[0] - since)
            else:
                since = None
        self.good_wrong_long += longest > LONG_S
        self.said += bool(lost) and lost[0][0] - begin <= LONG_S or bool(right) and right[0][0] - begin <= LONG_S
        last = [row for row in rows if row[0] > end - 1.0]
        self.found += all(is_right(row) for row in last)
        self.wrong_at_end += any(is_good_and_wrong(row) for row in last)
        if lost:
            self.seconds_to_lost.append(lost[0][0] - begin)
        if right:
            self.seconds_to_right.append(right[0][0] - begin)


def median(values):
    return f"{sorted(values)[len(values) // 2]:.1f}" if values else "–"


def main():
    parser = parser_of(__doc__, "wrong_starts")
    parser.add_argument("--starts", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    call = parser.parse_args()

    print("| log | scans, true start | good, wrong | lost | wrong starts | lost or right within 5 s "
          "| right at the end | good and wrong for over 5 s | good and wrong at the end "
          "| s to lost, median | s to right, median |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for folder in call.folders:
        name, out = row_of(folder, call)
        right, wrong = Figures(), Figures()
        run(call.program, folder, ["--initial-pose-from", folder / "truth.tum"], out / "true", call.max_range)
        right.add(scans(folder, out / "true"))
        for i, (x, y, z, heading) in enumerate(wrong_starts(read_tum(folder / "truth.tum"), call.starts, call.seed)):
            pose = f"{x:.3f} {y:.3f} {z:.3f} 0 0 {math.sin(heading / 2):.6f} {math.cos(heading / 2):.6f}"
            run(call.program, folder, ["--initial-pose", pose], out / f"wrong_{i}", call.max_range)
            wrong.add(scans(folder, out / f"wrong_{i}"))
        print(f"| {name} | {right.scans} | {right.good_wrong} | {right.lost} | {wrong.runs} | {wrong.said} "
              f"| {wrong.found} | {wrong.good_wrong_long} | {wrong.wrong_at_end} "
              f"| {median(wrong.seconds_to_lost)} | {median(wrong.seconds_to_right)} |", flush=True)


if __name__ == "__main__":
    main()

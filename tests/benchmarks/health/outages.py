#!/usr/bin/env python3
"""How soon a robot is found after an outage of all its sensors, during which it drives on.

    tests/benchmarks/health/outages.py FOLDER... [--max-range M] [--out DIR]

Each FOLDER has the files of `lodestone simulate` and a magnetic map field.yaml of `lodestone map magnetic`. The log
runs from its true initial pose. A case is a gap of more than 10 s between its scans. One row of a table for each
folder, Markdown.

Found: from a scan within 10 s of the gap's end on, the newest positions are right for as long as 1 s. Right, wrong: as
in wrong_starts.py.
"""
import argparse
from pathlib import Path

from wrong_starts import ROOT, is_good_and_wrong, is_right, median, run, scans

GAP_S = 10.0
FOUND_S = 10.0
HELD_S = 1.0


def cases(rows):
    """The scans from one gap to the next, without those before the first gap."""
    ends = [i for i, (a, b) in enumerate(zip(rows, rows[1:]), 1) if b[0] - a[0] > GAP_S]
    return [rows[i:j] for i, j in zip(ends, ends[1:] + [len(rows)])]


def seconds_to_right(rows):
    """From the first scan to the first from which on positions are right for HELD_S; none if there is no such scan."""
    for i, first in enumerate(rows):
        held = [row for row in rows[i:] if row[0] <= first[0] + HELD_S]
        if rows[-1][0] >= first[0] + HELD_S and all(is_right(row) for row in held):
            return first[0] - rows[0][0]
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--max-range", type=float)
    parser.add_argument("--program", type=Path, default=ROOT / "build/release/bin/lodestone")
    parser.add_argument("--out", type=Path, default=Path("outages"))
    call = parser.parse_args()

    print("| log | cases | found within 10 s | found later | s to right, median | scans after outages | good and wrong | lost |")
    print("|---|---|---|---|---|---|---|---|")
    for folder in call.folders:
        name = folder.name + (f", {call.max_range:g} m" if call.max_range else "")
        out = call.out / name.replace(", ", "_").replace(" ", "_")
        run(call.program, folder, ["--initial-pose-from", folder / "truth.tum"], out,
            call.max_range)
        after = cases(scans(folder, out))
        seconds = [value for value in map(seconds_to_right, after) if value is not None]
        soon = sum(value <= FOUND_S for value in seconds)
        rows = [row for case in after for row in case]
        print(f"| {name} | {len(after)} | {soon} | {len(seconds) - soon} | {median(seconds)} | {len(rows)} "
              f"| {sum(is_good_and_wrong(row) for row in rows)} | {sum(row[1] == 'lost' for row in rows)} |", flush=True)


if __name__ == "__main__":
    main()

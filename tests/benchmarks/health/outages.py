#!/usr/bin/env python3
"""How soon a robot is found after an outage of all its sensors, during which it drives on.

    tests/benchmarks/health/outages.py FOLDER... [--begin S...] [--length S] [--max-range M] [--out DIR]

Each FOLDER has the files of `lodestone simulate` with these outages as faults, and a magnetic map field.yaml of
`lodestone map magnetic`. The log runs from its true initial pose. One row of a table for each folder, Markdown.

Found: from a scan on, the newest positions are right for as long as 1 s. Right, wrong: as in wrong_starts.py.
"""
from wrong_starts import is_good_and_wrong, is_right, median, parser_of, row_of, run, scans

FOUND_S = 10.0
HELD_S = 1.0


def cases(rows, begins_s, length_s):
    """The scans during each outage, and those from its end to the next one. Outages at the log's end are no case."""
    log_begin = rows[0][0]
    bounds = [log_begin + begin_s for begin_s in begins_s] + [float("inf")]
    result = []
    for begin, until in zip(bounds, bounds[1:]):
        during = [row for row in rows if begin <= row[0] <= begin + length_s]
        after = [row for row in rows if begin + length_s < row[0] < until]
        if after and after[-1][0] - after[0][0] >= FOUND_S:
            result.append((during, after))
    return result


def seconds_to_right(rows):
    """From the first scan to the first from which on positions are right for HELD_S; none if there is no such scan."""
    for i, first in enumerate(rows):
        held = [row for row in rows[i:] if row[0] <= first[0] + HELD_S]
        if rows[-1][0] >= first[0] + HELD_S and all(is_right(row) for row in held):
            return first[0] - rows[0][0]
    return None


def main():
    parser = parser_of(__doc__, "outages")
    parser.add_argument("--begin", type=float, nargs="+", default=[20.0, 65.0, 110.0, 155.0])
    parser.add_argument("--length", type=float, default=30.0)
    call = parser.parse_args()

    print("| log | outages | found within 10 s | later | s to right, median | scans after outages | good and wrong "
          "| lost | scans in outages | good and wrong |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for folder in call.folders:
        name, out = row_of(folder, call)
        run(call.program, folder, ["--initial-pose-from", folder / "truth.tum"], out,
            call.max_range)
        found = cases(scans(folder, out), call.begin, call.length)
        during = [row for case, _ in found for row in case]
        seconds = [value for value in (seconds_to_right(case) for _, case in found) if value is not None]
        soon = sum(value <= FOUND_S for value in seconds)
        rows = [row for _, case in found for row in case]
        print(f"| {name} | {len(found)} | {soon} | {len(seconds) - soon} | {median(seconds)} | {len(rows)} "
              f"| {sum(map(is_good_and_wrong, rows))} | {sum(row[1] == 'lost' for row in rows)} | {len(during)} "
              f"| {sum(map(is_good_and_wrong, during))} |", flush=True)


if __name__ == "__main__":
    main()

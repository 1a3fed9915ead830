#!/usr/bin/env python3
"""What a linear interpolation over a gap of the IMU is worth, in real motions.

    tests/benchmarks/imu_gaps/gaps.py FILE.csv...

Each FILE has the columns time (ns, or s), angular velocity x y z (rad/s) and specific force x y z (m/s^2). For each
length of a gap: the rms error of the integral over the gap, divided by the square root of its length. That is the
density of the white noise with this effect. One row of a table for each file and length, Markdown; the last rows have
the densities of core/imu/gap_noise.cpp.
"""
import sys
from pathlib import Path

import numpy as np

GAPS_S = [0.1, 0.25, 0.5, 1.0, 2.0, 5.0]


def densities(time, values, gap_s):
    """Of three axes; the gap begins at every quarter of its length."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, None]
    integral = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    samples = max(1, round(gap_s / float(np.median(np.diff(time)))))
    begin = np.arange(0, len(time) - samples, max(1, samples // 4))
    length = time[begin + samples] - time[begin]
    begin = begin[np.abs(length - gap_s) < 0.1 * gap_s]
    end = begin + samples
    interpolated = 0.5 * (values[begin] + values[end]) * (time[end] - time[begin])[:, None]
    error = integral[end] - integral[begin] - interpolated
    return np.sqrt((error**2).mean(axis=0) / gap_s)


def row(name, gap_s, turn, force):
    print(f"| {name} | {gap_s:g} | {' '.join(f'{v:.3f}' for v in turn)} | {' '.join(f'{v:.2f}' for v in force)} |")


def main():
    print("| log | gap s | gyroscope rad/s/√Hz (x y z) | accelerometer m/s²/√Hz (x y z) |")
    print("|---|---|---|---|")
    for path in map(Path, sys.argv[1:]):
        data = np.genfromtxt(path, delimiter=",", skip_header=1)
        time = (data[:, 0] - data[0, 0]) * (1e-9 if data[0, 0] > 1e15 else 1.0)
        for gap_s in GAPS_S:
            row("/".join(path.parts[-2:]), gap_s, densities(time, data[:, 1:4], gap_s),
                densities(time, data[:, 4:7], gap_s))
    for x in GAPS_S:
        e = np.exp(-min(x, 2.0))
        length = min(x, 2.0)
        root = np.sqrt((2 * (length - 1 + e) + 0.5 * length**2 * (1 + e) - 2 * length * (1 - e)) / length)
        row("gap_noise.cpp", x, [0.5 * root], [1.0 * root])


if __name__ == "__main__":
    main()

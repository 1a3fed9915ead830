#!/usr/bin/env python3
"""A log with the IMU of EuRoC's V1_01, a drone, and scans that are made from its ground truth.

    tests/benchmarks/real/euroc_logs.py DATA OUT room|corridor [--seed N] [--duration S]

DATA has euroc_V1_01_imu.csv and euroc_V1_01_truth.csv. OUT gets the log `log`, the cloud map map.pcd, the ground truth
truth.tum, and mounting.txt: T_imu_lidar of the platform file (x y z, m; qx qy qz qw), wrong by 0.2 degrees and 5 mm an
axis. The LiDAR's clock is late by 2 ms (one sigma). Requires numpy and scipy.
"""
import argparse
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, RotationSpline

from csv_log import COLUMNS, write

BEGIN_S = 1.7e9
SCAN_S = 0.1
RINGS_RAD = np.radians(np.linspace(-22, 22, 32))
COLUMNS_OF_SCAN = 900
MIN_RANGE_M, MAX_RANGE_M = 0.5, 40.0
RANGE_NOISE_M, MAP_NOISE_M = 0.015, 0.008
POINTS_PER_M2 = 600


class Surroundings:
    """A room with three boxes, or a corridor of 120 m along y, around the positions `low` to `high`."""

    def __init__(self, world, low, high):
        if world == "room":
            self.low = np.array([low[0] - 2.5, low[1] - 2.5, -0.02])
            self.high = np.array([high[0] + 2.5, high[1] + 2.5, 4.0])
            left, right, back, front = self.low[0], self.high[0], self.low[1], self.high[1]
            boxes = [([left + 0.3, back + 0.5, 0], [left + 1.2, back + 1.5, 1.8]),
                     ([right - 1.3, front - 1.6, 0], [right - 0.4, front - 0.4, 2.4]),
                     ([left, front - 1.0, 0], [left + 0.8, front, 3.0])]
            self.boxes = [(np.array(a), np.array(b)) for a, b in boxes]
        else:
            self.low = np.array([low[0] - 1.5, low[1] - 60, -0.02])
            self.high = np.array([high[0] + 1.5, high[1] + 60, 3.5])
            self.boxes = []

    def ranges(self, origins, directions):
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / directions
            walls = np.where(directions > 0, (self.high - origins) * inverse, (self.low - origins) * inverse)
            ranges = np.where(np.isnan(walls), np.inf, walls).min(1)
            for low, high in self.boxes:
                one, other = (low - origins) * inverse, (high - origins) * inverse
                near, far = np.minimum(one, other).max(1), np.maximum(one, other).min(1)
                ranges = np.where((near < far) & (near > 0) & (near < ranges), near, ranges)
        return ranges

    def cloud(self, random):
        parts = []
        for box, (low, high) in enumerate([(self.low, self.high), *self.boxes]):
            for axis in range(3):
                for side in (low, high):
                    first, last = low.copy(), high.copy()
                    first[axis] = last[axis] = side[axis]
                    area_m2 = np.prod(np.delete(last - first, axis))
                    count = int(min(area_m2, 3000) * POINTS_PER_M2) if box == 0 else int(area_m2 * POINTS_PER_M2)
                    parts.append(first + (last - first) * random.random((count, 3)))
        points = np.concatenate(parts)
        return points + MAP_NOISE_M * random.standard_normal(points.shape)


def write_pcd(path, names, columns):
    path.parent.mkdir(parents=True, exist_ok=True)
    size, count = len(columns[0]), len(names)
    table = np.zeros(size, dtype=[(name, "<f4") for name in names])
    for name, column in zip(names, columns):
        table[name] = column
    header = (f"VERSION 0.7\nFIELDS {' '.join(names)}\nSIZE{' 4' * count}\nTYPE{' F' * count}\nCOUNT{' 1' * count}\n"
              f"WIDTH {size}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {size}\nDATA binary\n")
    path.write_bytes(header.encode() + table.tobytes())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("world", choices=["room", "corridor"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--duration", type=float, default=60.0, help="seconds")
    call = parser.parse_args()
    random = np.random.default_rng(call.seed)
    truth = np.loadtxt(call.data / "euroc_V1_01_truth.csv", delimiter=",")
    imu = np.loadtxt(call.data / "euroc_V1_01_imu.csv", delimiter=",")
    truth_s, imu_s = ((table[:, 0] - truth[0, 0]) / 1e9 for table in (truth, imu))
    rotations = Rotation.from_quat(truth[:, [5, 6, 7, 4]])
    position, rotation = CubicHermiteSpline(truth_s, truth[:, 1:4], truth[:, 8:11]), RotationSpline(truth_s, rotations)
    world = Surroundings(call.world, truth[:, 1:4].min(0), truth[:, 1:4].max(0))

    level = rotations[0].inv() * Rotation.from_euler("z", 0.4)
    arm_m = np.array([0.05, -0.03, 0.08])
    turn_error = Rotation.from_rotvec(np.radians(0.2) * random.standard_normal(3))
    arm_error_m, late_s = 0.005 * random.standard_normal(3), 0.002 * random.standard_normal()
    around, up = np.meshgrid(np.linspace(0, 2 * np.pi, COLUMNS_OF_SCAN, endpoint=False), RINGS_RAD, indexing="ij")
    beams = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], -1).reshape(-1, 3)
    offsets_s = (around / (2 * np.pi) * SCAN_S).ravel()
    for scan in range(int(call.duration / SCAN_S)):
        start_s = 1.0 + scan * SCAN_S
        turned = rotation(start_s + offsets_s)
        origins = position(start_s + offsets_s) + turned.apply(arm_m)
        ranges = world.ranges(origins, turned.apply(level.apply(beams)))
        ranges = ranges + RANGE_NOISE_M * random.standard_normal(len(ranges))
        seen = (ranges > MIN_RANGE_M) & (ranges < MAX_RANGE_M)
        points = (beams * ranges[:, None])[seen]
        write_pcd(call.out / f"log/points/{BEGIN_S + start_s + late_s:.9f}.pcd", ["x", "y", "z", "time"],
                  [*points.T, offsets_s[seen]])
    used = (imu_s > 0.5) & (imu_s < call.duration + 2)
    write(call.out / "log/imu.csv", COLUMNS["imu"], BEGIN_S + imu_s[used], imu[used, 1:])
    at_s = np.arange(0.6, call.duration + 1.5, 0.02)
    poses = np.column_stack([BEGIN_S + at_s, position(at_s), rotation(at_s).as_quat()])
    np.savetxt(call.out / "truth.tum", poses, fmt="%.9f")
    write_pcd(call.out / "map.pcd", ["x", "y", "z"], world.cloud(random).T)
    np.savetxt(call.out / "mounting.txt", [[*(arm_m + arm_error_m), *(level * turn_error).as_quat()]], fmt="%.9f")


if __name__ == "__main__":
    main()

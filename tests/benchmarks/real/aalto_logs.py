#!/usr/bin/env python3
"""Logs of AaltoML's robot for `lodestone run`, from the measurements that its authors publish.

    tests/benchmarks/real/aalto_logs.py DATA OUT [RUN...]        RUN: 1 to 9, all by default

DATA is the folder `data` of https://github.com/AaltoML/magnetic-data (Solin et al., IEEE T-RO 2018). For each run, OUT
gets the log run_N, readable as CSV, and the ground truth run_N.tum. Requires numpy and scipy.

Magnetometers: the published readings, turned from the room's axes to those of the robot; trivisio scaled by 45 to µT.
Ground truth: the published positions of invensense, smoothed; the heading is the direction from invensense to nexus.
IMU: none is published. It is made from the smoothed motion, with the noise of the platform file of aalto_logs.
"""
import argparse
from pathlib import Path

import numpy as np
from scipy.interpolate import make_lsq_spline

from csv_log import COLUMNS, write

SCALES = {"invensense": 1.0, "nexus": 1.0, "trivisio": 45.0}
KNOTS_S = 0.5  # of the splines, quintic
IMU_STEP_S = 0.005
TRUTH_STEP_S = 0.02
TRIM_S = 1.0  # at both ends, where splines are poor
GRAVITY_M_S2 = 9.80665
GYROSCOPE_NOISE, GYROSCOPE_WALK = 1e-3, 2e-5  # rad/s/√Hz, rad/s²/√Hz
ACCELEROMETER_NOISE, ACCELEROMETER_WALK = 2e-2, 5e-4  # m/s²/√Hz, m/s³/√Hz
BEGIN_S = 1.7e9  # stamps are not published


def measurements(data, name, run):
    """Times (s), positions (m) and readings (µT, axes of the room) of a magnetometer, without repeated times."""
    time_s, positions_m, readings = (np.loadtxt(data / name / f"{run}-{what}.csv", delimiter=",")
                                     for what in ("time", "loc", "mag"))
    size = min(map(len, (time_s, positions_m, readings)))
    new = np.concatenate([[True], np.diff(time_s[:size]) > 0])
    return time_s[:size][new], positions_m[:size][new], SCALES[name] * readings[:size][new]


def spline(time_s, values):
    inner = np.arange(time_s[0] + KNOTS_S, time_s[-1] - KNOTS_S, KNOTS_S)
    return make_lsq_spline(time_s, values, np.concatenate([[time_s[0]] * 6, inner, [time_s[-1]] * 6]), 5)


def turned_to_robot(vectors, heading_rad):
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    return np.column_stack([c * vectors[:, 0] + s * vectors[:, 1], c * vectors[:, 1] - s * vectors[:, 0],
                            vectors[:, 2]])


def noisy(values, white, walk, random):
    """Samples with white noise and a random walk of the bias, densities as in a platform file."""
    steps = random.normal(0.0, walk * np.sqrt(IMU_STEP_S), values.shape)
    return values + np.cumsum(steps, axis=0) + random.normal(0.0, white / np.sqrt(IMU_STEP_S), values.shape)


def make_log(data, out, run):
    sensors = {name: measurements(data, name, run) for name in SCALES}
    begin_s = max(time_s[0] for time_s, _, _ in sensors.values())
    end_s = min(time_s[-1] for time_s, _, _ in sensors.values())
    time_s, positions_m, _ = sensors["invensense"]
    inside = (time_s >= begin_s) & (time_s <= end_s)
    time_s, positions_m = time_s[inside], positions_m[inside]
    front_s, front_m, _ = sensors["nexus"]
    ahead = np.column_stack([np.interp(time_s, front_s, front_m[:, k]) for k in (0, 1)]) - positions_m
    x, y = spline(time_s, positions_m[:, 0]), spline(time_s, positions_m[:, 1])
    heading = spline(time_s, np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0])))

    begin_s, end_s = time_s[0] + TRIM_S, time_s[-1] - TRIM_S
    random = np.random.default_rng(run)
    at_s = np.arange(begin_s, end_s, IMU_STEP_S)
    still = np.zeros(len(at_s))
    rates = np.column_stack([still, still, heading.derivative()(at_s)])
    forces = np.column_stack([x.derivative(2)(at_s), y.derivative(2)(at_s), still + GRAVITY_M_S2])
    write(out / f"run_{run}/imu.csv", COLUMNS["imu"], at_s + BEGIN_S, np.column_stack(
        [noisy(rates, GYROSCOPE_NOISE, GYROSCOPE_WALK, random),
         noisy(turned_to_robot(forces, heading(at_s)), ACCELEROMETER_NOISE, ACCELEROMETER_WALK, random)]))
    for name, (sensor_s, _, readings_ut) in sensors.items():
        inside = (sensor_s >= begin_s) & (sensor_s <= end_s)
        sensor_s, readings_ut = sensor_s[inside], readings_ut[inside]
        write(out / f"run_{run}/mag/{name}.csv", COLUMNS["mag"], sensor_s + BEGIN_S,
              turned_to_robot(readings_ut, heading(sensor_s)))
    at_s = np.arange(begin_s, end_s, TRUTH_STEP_S)
    still, half = np.zeros(len(at_s)), 0.5 * heading(at_s)
    poses = np.column_stack([at_s + BEGIN_S, x(at_s), y(at_s), still, still, still, np.sin(half), np.cos(half)])
    np.savetxt(out / f"run_{run}.tum", poses, fmt="%.6f")
    print(f"run_{run}: {end_s - begin_s:.1f} s")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("runs", nargs="*", type=int, default=range(1, 10), metavar="RUN")
    call = parser.parse_args()
    for run in call.runs:
        make_log(call.data, call.out, run)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Logs of two recordings by hand for `lodestone run`, from the measurements that their authors publish.

    tests/benchmarks/real/osman_logs.py REPOSITORY OUT

REPOSITORY is a clone of https://github.com/MostafaOsman144/magnetic_mapping_rrgp_3d. OUT gets the logs `simple` and
`complicated`, readable as CSV, and the ground truth simple.tum and complicated.tum. Requires numpy and scipy.

IMU and magnetometer are real, one Xsens of 200 Hz, its field in units of nT. The ground truth is the published motion
capture. The two recordings have frames of their own. The room's markers, which are in both, give the transform of the
second to the first.
"""
import argparse
from pathlib import Path

import numpy as np
import scipy.io
from scipy.spatial.transform import Rotation

from csv_log import COLUMNS, write

STEP_S = 0.005
BEGIN_S = {"simple": 1.7e9, "complicated": 1.70001e9}  # stamps are not published
MAGNETOMETER_EVERY = 2  # many readings repeat the one before


def rigid(points, others):
    """Rotation and translation that move `points` (n, 3) onto `others`."""
    centre, other_centre = points.mean(0), others.mean(0)
    u, _, vt = np.linalg.svd((points - centre).T @ (others - other_centre))
    turn = vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    return turn, other_centre - turn @ centre


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", type=Path)
    parser.add_argument("out", type=Path)
    call = parser.parse_args()
    sets = {name: scipy.io.loadmat(call.repository / f"measurements_aligned_{name}_trajectory.mat") for name in BEGIN_S}
    # The first marker was moved between the recordings.
    turn, shift = rigid(sets["complicated"]["dipoles"][1:], sets["simple"]["dipoles"][1:])
    for name, data in sets.items():
        samples, positions_m = data["u"].T, data["p_opti"].T
        attitudes = Rotation.from_quat(data["q_opti"].T[:, [1, 2, 3, 0]])
        if name == "complicated":
            positions_m, attitudes = positions_m @ turn.T + shift, Rotation.from_matrix(turn) * attitudes
        time_s = BEGIN_S[name] + STEP_S * np.arange(len(samples))
        write(call.out / name / "imu.csv", COLUMNS["imu"], time_s, np.column_stack([samples[:, 3:6], samples[:, :3]]))
        write(call.out / name / "mag/xsens.csv", COLUMNS["mag"],
              time_s[::MAGNETOMETER_EVERY], 1e-3 * samples[::MAGNETOMETER_EVERY, 6:])
        np.savetxt(call.out / f"{name}.tum", np.column_stack([time_s, positions_m, attitudes.as_quat()]), fmt="%.9f")
        print(f"{name}: {STEP_S * len(samples):.1f} s")


if __name__ == "__main__":
    main()

"""The time of a run whose measurements are numpy arrays, over that of a run that reads the log.

    tests/benchmarks/python/feeding.py FOLDER [REPEATS]      FOLDER: of `lodestone simulate`, with field.yaml

Each repeat runs both, in alternating order. The arrays exist before: their time is that of adding and localizing them.
The medians count.
"""

import sys
import time
from pathlib import Path

import numpy as np

import lodestone


def now():
    """Wall time and CPU time of the process, s."""
    return np.array([time.perf_counter(), time.process_time()])


def feed(platform, imu, field, scans):
    measurements = lodestone.Measurements(platform)
    measurements.add_imu(*imu)
    for name, samples in field.items():
        measurements.add_field(name, *samples)
    for scan in scans:
        measurements.add_scan(scan.start_ns, scan.points_m, scan.offset_ns, intensity=scan.intensity, ring=scan.ring)
    return measurements


def main(folder, repeats):
    log = folder / "log.bag"
    site = lodestone.load_site(folder / "platform.yaml", folder / "cloud.pcd", folder / "field.yaml")
    truth = lodestone.read_trajectory(folder / "truth.tum")
    whole = lodestone.read_log(log, site.platform)
    arrays = whole.imu(), {name: whole.field(name) for name in site.platform.magnetometers}, list(whole.scans())
    del whole
    costs = {"reading": [], "adding": [], "log": [], "arrays": []}
    for repeat in range(repeats):
        begin = now()
        lodestone.read_log(log, site.platform)
        read = now()
        measurements = feed(site.platform, *arrays)
        costs["reading"].append(read - begin)
        costs["adding"].append(now() - read)
        inputs = [("log", log), ("arrays", measurements)]
        results = []
        for name, one in inputs if repeat % 2 else reversed(inputs):
            begin = now()
            results.append(lodestone.localize(one, site, initial_pose=truth).best.position_m)
            costs[name].append(now() - begin)
        assert np.array_equal(*results)
    scans = arrays[2]
    print(f"{len(scans)} scans of {np.mean([len(scan.points_m) for scan in scans]):.0f} points, {repeats} repeats")
    for column, kind in enumerate(("wall time", "CPU time")):
        reading_s, adding_s, log_s, arrays_s = (np.median(np.array(values)[:, column]) for values in costs.values())
        print(f"{kind}: run over the log {log_s:.3f} s, over arrays {arrays_s:.3f} s, adding them {adding_s:.3f} s, "
              f"ratio {(arrays_s + adding_s) / log_s:.4f}; reading the log alone {reading_s:.3f} s")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 5)

"""A run from Python gives the bytes of the command, whether it reads the log or gets arrays."""

import csv
import dataclasses
import math
import os
import signal
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np
import pandas as pd

import drive
import lodestone


def assert_same_bits(test, one, other):
    for name in ("stamp_ns", "position_m", "quaternion_xyzw", "velocity_m_s", "covariance", "health"):
        test.assertTrue(np.array_equal(getattr(one, name), getattr(other, name)), name)


def fed(measurements):
    """The same measurements, added as arrays, the scans first."""
    copy = lodestone.Measurements(measurements.platform)
    for scan in measurements.scans():
        copy.add_scan(scan.start_ns, scan.points_m, scan.offset_ns, intensity=scan.intensity, ring=scan.ring)
    copy.add_imu(*measurements.imu())
    wheels = measurements.wheels()
    copy.add_wheels(wheels.stamp_ns, wheels.forward_velocity_m_s, wheels.yaw_rate_rad_s, wheels.lateral_velocity_m_s)
    for name in measurements.platform.magnetometers:
        copy.add_field(name, *measurements.field(name))
    return copy


class LocalizationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.truth = lodestone.read_trajectory(drive.TRUTH)
        cls.site = lodestone.load_site(drive.PLATFORM, drive.CLOUD, drive.FIELD)
        cls.result = lodestone.localize(drive.LOG, cls.site, initial_pose=cls.truth)

    def test_a_log_gives_the_bytes_of_the_command(self):
        with tempfile.TemporaryDirectory() as folder:
            for estimates, name in ((self.result.best, "trajectory.tum"), (self.result.causal, "causal.tum")):
                estimates.write_tum(Path(folder) / name)
                self.assertEqual((Path(folder) / name).read_bytes(), (drive.RUN / name).read_bytes())
        self.assertEqual(self.result.scans, len(self.result.best))
        self.assertIn("ceres", self.result.solver)
        self.assertIsNone(self.result.failure)

    def test_georeferenced_maps_give_the_poses_at_the_site(self):
        origin_m = (432000.0, 4583000.0, 100.0)
        option = f"--origin={','.join(map(str, origin_m))}"
        with tempfile.TemporaryDirectory() as folder:
            cloud, field = Path(folder) / "cloud.ply", Path(folder) / "field.yaml"
            drive.lodestone("shift", drive.CLOUD, option, "--back", "--out", cloud)
            drive.lodestone("shift", drive.FIELD, option, "--back", "--out", field)
            site = lodestone.load_site(drive.PLATFORM, cloud, field, origin_m=np.array(origin_m))
            found = lodestone.localize(drive.LOG, site, initial_pose=self.truth)
        self.assertLess(np.abs(found.best.position_m - self.result.best.position_m).max(), 1e-3)

    def test_covariances_and_diagnostics_are_those_of_the_command(self):
        upper = np.triu_indices(6)
        with open(drive.RUN / "covariance.csv", newline="") as file:
            rows = list(csv.reader(file))[1:]
        self.assertEqual(len(rows), len(self.result.best))
        for row, covariance in zip(rows, self.result.best.covariance):
            self.assertEqual(row[1:], [f"{value:.9g}" for value in covariance[upper]])
        table = pd.read_csv(drive.RUN / "diagnostics.csv", keep_default_na=False, na_values=["nan"],
                            float_precision="round_trip")
        diagnostics = self.result.diagnostics
        self.assertEqual(list(table.columns[1:]), list(diagnostics.columns))
        for name in table.columns[1:-1]:  # not step_ms, a wall time
            for written, value in zip(table[name], diagnostics[name]):
                text = value if isinstance(value, str) else float(f"{value:.6g}")
                same = written == text or (math.isnan(written) and math.isnan(text))
                self.assertTrue(same, f"{name}: {written} {text}")

    def test_arrays_give_the_same_bits_as_the_log(self):
        measurements = lodestone.read_log(drive.LOG, self.site.platform)
        for one in (measurements, fed(measurements)):
            assert_same_bits(self, self.result.best, lodestone.localize(one, self.site, initial_pose=self.truth).best)

    def test_options_choose_magnetometers_of_arrays_too(self):
        names = self.site.platform.magnetometers[1] + "," + self.site.platform.magnetometers[6]
        site = lodestone.load_site(drive.PLATFORM, None, drive.FIELD, options={"magnetic.magnetometers": names})
        self.assertEqual(site.platform.magnetometers, names.split(","))
        measurements = lodestone.read_log(drive.LOG, self.site.platform)
        runs = [lodestone.localize(log, site, "magnetic-stochastic", self.truth) for log in (drive.LOG, measurements)]
        assert_same_bits(self, *(run.best for run in runs))

    def run_both(self, log, folder):
        """The poses in trajectory.tum of the command, those of Python, the command's exit code, Python's result."""
        call = [drive.PROGRAM, "run", log, "--platform", drive.PLATFORM, "--cloud", drive.CLOUD, "--magnetic",
                drive.FIELD, "--initial-pose-from", drive.TRUTH, "--out", folder / "run", "--check-seconds", "0"]
        code = subprocess.run(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE).returncode
        result = lodestone.localize(log, self.site, initial_pose=self.truth)
        result.best.write_tum(folder / "python.tum")
        texts = [path.read_text() for path in (folder / "run" / "smoother" / "trajectory.tum", folder / "python.tum")]
        return (*([line for line in text.splitlines() if line[0] != "#"] for text in texts), code, result)

    def test_warnings_of_the_reader_are_in_the_result(self):
        with tempfile.TemporaryDirectory() as name:
            cut = Path(name) / "cut.bag"
            whole = drive.LOG.read_bytes()
            cut.write_bytes(whole[:len(whole) // 2])
            expected, poses, code, result = self.run_both(cut, Path(name))
            self.assertEqual((poses, code), (expected, 0))
            self.assertEqual([one.kind for one in result.warnings], ["log.cut_off"])
            self.assertEqual(pd.DataFrame(result.warnings)["count"][0], 1)

    def test_a_log_that_breaks_off_keeps_its_estimates(self):
        with tempfile.TemporaryDirectory() as name:
            damaged = Path(name) / "damaged.bag"
            drive.lodestone("convert", drive.LOG, "--compression", "none", "--out", damaged)
            content = bytearray(damaged.read_bytes())
            frame = (5).to_bytes(4, "little") + b"lidar"  # the frame id of a scan: its length becomes impossible
            at = 0
            for _ in range(content.count(frame) * 4 // 5):
                at = content.index(frame, at + 1)
            content[at:at + 4] = b"\xff\xff\xff\x7f"
            damaged.write_bytes(content)
            expected, poses, code, result = self.run_both(damaged, Path(name))
            self.assertEqual((poses, code), (expected, 2))
            self.assertIsInstance(result.failure, lodestone.InputError)
            self.assertIn("the message ends", str(result.failure))
            self.assertGreater(result.scans, 10)

    def test_lost_estimates_are_left_out_of_files(self):
        best = dataclasses.replace(self.result.best, health=self.result.best.health.copy())
        best.health[[3, 4, 10]] = "lost"
        stamps = [int(best.stamp_ns[index]) for index in (3, 4, 10, 10)]
        self.assertEqual(best.lost_intervals_ns, [(stamps[0], stamps[1]), (stamps[2], stamps[3])])
        self.assertEqual(len(best.trajectory), len(best) - 3)
        with tempfile.TemporaryDirectory() as folder:
            best.write_tum(Path(folder) / "best.tum")
            lines = (Path(folder) / "best.tum").read_text().splitlines()
        seconds = [f"{stamp // 10**9}.{stamp % 10**9:09}" for stamp in stamps]
        self.assertEqual(lines[-2:], [f"# lost from {seconds[0]} to {seconds[1]}",
                                      f"# lost from {seconds[2]} to {seconds[3]}"])
        self.assertEqual(len(lines), 1 + len(best) - 3 + 2)

    def test_every_form_of_an_initial_pose(self):
        first = self.truth.interpolate([self.result.begin_ns])
        pose = np.hstack([first.position_m[0], first.quaternion_xyzw[0]])
        runs = [lodestone.localize(drive.LOG, self.site, initial_pose=one, progress=lambda share, stamp: share < 0.2)
                for one in (self.truth, pose, " ".join(repr(value) for value in pose))]
        self.assertTrue(runs[0].stopped)
        self.assertLess(runs[0].scans, self.result.scans)
        assert_same_bits(self, runs[0].best, runs[1].best)
        assert_same_bits(self, runs[0].best, runs[2].best)
        with self.assertRaisesRegex(lodestone.InputError, "no plane within the LiDAR's range"):
            lodestone.localize(drive.LOG, self.site, initial_pose=[1e4, 0, 0, 0, 0, 0, 1])

    def test_progress_rises_to_the_end_of_the_log(self):
        shares = []
        lodestone.localize(drive.LOG, self.site, "ieskf", self.truth,
                           progress=lambda share, stamp: shares.append(share))
        self.assertEqual(len(shares), self.result.scans)
        self.assertEqual(shares, sorted(shares))
        self.assertGreater(shares[-1], 0.9)
        for result, scans in ((np.False_, 1), (0, self.result.scans)):
            self.assertEqual(lodestone.localize(drive.LOG, self.site, "ieskf", self.truth,
                                                progress=lambda share, stamp: result).scans, scans)

    def test_a_batch_reports_its_progress_and_can_be_stopped(self):
        site = lodestone.load_site(drive.PLATFORM, drive.CLOUD, drive.FIELD, options={"smoother.refine": "batch"})
        shares = []
        result = lodestone.localize(drive.LOG, site, initial_pose=self.truth, refining=shares.append)
        self.assertGreater(len(shares), 0)
        self.assertEqual(len(result.smoothed), len(result.best))

        def fail(share):
            raise LookupError("of the callback")

        with self.assertRaisesRegex(LookupError, "of the callback"):
            lodestone.localize(drive.LOG, site, initial_pose=self.truth, refining=fail)

    def test_an_exception_of_the_callback_comes_out(self):
        def fail(share, stamp):
            raise LookupError("of the callback")

        with self.assertRaisesRegex(LookupError, "of the callback"):
            lodestone.localize(drive.LOG, self.site, initial_pose=self.truth, progress=fail)

    def test_control_c_stops_the_run(self):
        timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            for _ in range(20):
                lodestone.localize(drive.LOG, self.site, initial_pose=self.truth)

    def test_other_threads_run_meanwhile(self):
        ticks, done = [], threading.Event()

        def tick():
            while not done.wait(0.005):
                ticks.append(time.monotonic())

        thread = threading.Thread(target=tick)
        thread.start()
        begin = time.monotonic()
        lodestone.localize(drive.LOG, self.site, initial_pose=self.truth)
        end = time.monotonic()
        done.set()
        thread.join()
        # If the lock were held, the other thread would wait until the end.
        gaps = np.diff([begin, *(one for one in ticks if begin < one < end), end])
        self.assertLess(max(gaps), 0.5 * (end - begin))

    def test_threads_share_a_site(self):
        results = {}

        def run(key):
            results[key] = lodestone.localize(drive.LOG, self.site, initial_pose=self.truth)

        threads = [threading.Thread(target=run, args=(key,)) for key in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for result in results.values():
            assert_same_bits(self, self.result.best, result.best)

    def test_frames_have_all_nanoseconds(self):
        frame = self.result.best.to_frame()
        self.assertTrue(np.array_equal(frame.index.asi8, self.result.best.stamp_ns))
        self.assertTrue((frame.health == "good").all())
        self.assertTrue(np.array_equal(frame[["x_m", "y_m", "z_m"]].to_numpy(), self.result.best.position_m))

    def test_a_magnetic_map_in_memory_is_as_good_as_a_file(self):
        site = lodestone.load_site(drive.PLATFORM, drive.CLOUD, lodestone.read_magnetic_map(drive.FIELD))
        assert_same_bits(self, self.result.best, lodestone.localize(drive.LOG, site, initial_pose=self.truth).best)


if __name__ == "__main__":
    unittest.main()

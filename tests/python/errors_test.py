"""Errors are exceptions with the line that the command prints."""

import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

import drive
import lodestone
from lodestone._settings import settings

BEGIN = 1_700_000_000_000_000_000


class ErrorsTest(unittest.TestCase):
    def setUp(self):
        self.platform = lodestone.load_platform(drive.PLATFORM)
        self.measurements = lodestone.Measurements(self.platform)

    def localize(self):
        site = lodestone.load_site(self.platform, drive.CLOUD)
        return lodestone.localize(self.measurements, site)

    def test_wrong_arguments_are_named(self):
        for origin in ((1, 2), (1, 2, float("nan"))):
            with self.assertRaisesRegex(ValueError, "origin_m: expected x, y, z"):
                lodestone.load_site(self.platform, drive.CLOUD, origin_m=origin)
        with self.assertRaisesRegex(TypeError, "expected the Site of load_site"):
            lodestone.localize(drive.LOG, None)

    def test_the_line_is_that_of_the_command(self):
        with tempfile.TemporaryDirectory() as folder:
            wrong = Path(folder) / "platform.yaml"
            wrong.write_text(drive.PLATFORM.read_text().replace("range_noise_m", "range_nois_m"))
            call = [drive.PROGRAM, "run", drive.LOG, "--platform", wrong, "--cloud", drive.CLOUD, "--out",
                    Path(folder) / "out"]
            printed = subprocess.run(call, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            self.assertEqual(printed.returncode, 2)
            with self.assertRaises(lodestone.InputError) as caught:
                lodestone.load_site(wrong, drive.CLOUD)
            self.assertIn(str(caught.exception), printed.stderr)
            self.assertNotIn("\n", str(caught.exception))

    def test_a_robot_without_lidar_needs_no_section_lidar(self):
        with tempfile.TemporaryDirectory() as folder:
            bare = Path(folder) / "platform.yaml"
            lines = drive.PLATFORM.read_text().split("\n")
            begin = lines.index("lidar:")
            end = next(i for i in range(begin + 1, len(lines)) if lines[i] and not lines[i].startswith(" "))
            bare.write_text("\n".join(lines[:begin] + lines[end:]))
            lodestone.load_site(bare, magnetic=drive.FIELD)
            with self.assertRaisesRegex(lodestone.InputError, "lidar"):
                lodestone.load_site(bare, drive.CLOUD)

    def test_input_errors_are_value_errors(self):
        self.assertTrue(issubclass(lodestone.InputError, ValueError))
        for wrong in (lambda: lodestone.read_trajectory("absent.tum"),
                      lambda: lodestone.load_site(drive.PLATFORM),
                      lambda: lodestone.load_site(drive.PLATFORM, drive.CLOUD, options={"smoother.windw_s": 1}),
                      lambda: lodestone.read_log("absent.bag", self.platform),
                      lambda: next(lodestone.read_scans("absent.bag", self.platform)),
                      lambda: lodestone.topics("absent.bag"),
                      lambda: lodestone.read_magnetic_map("absent.yaml"),
                      lambda: lodestone.read_point_cloud("absent.pcd"),
                      lambda: self.measurements.add_field("absent", [], np.zeros((0, 3)))):
            with self.assertRaises(lodestone.InputError):
                wrong()

    def test_options_of_numpy_are_those_of_python(self):
        for value, text in ((np.float32(0.1), "0.1"), (np.float64(2.5), "2.5"), (np.int64(3), "3"),
                            (np.bool_(True), "true"), (np.array([0.1, 2], dtype=np.float32), "[0.1, 2.0]"),
                            ([np.int32(1), 2], "[1, 2]"), (np.array(5), "5"), (True, "true"), ("batch", "batch")):
            self.assertEqual(settings({"a.b": value}), [f"a.b={text}"])
        lodestone.load_site(self.platform, drive.CLOUD, options={"smoother.window_s": np.float32(2.5)})

    def test_options_are_a_mapping(self):
        for wrong in ("magnetic.huber=true", ["magnetic.huber=true"], 5):
            with self.assertRaisesRegex(TypeError, "options: expected a mapping.*found"):
                lodestone.load_site(self.platform, drive.CLOUD, options=wrong)
        with self.assertRaisesRegex(TypeError, "options: smoother.window_s: expected .* found object"):
            lodestone.load_site(self.platform, drive.CLOUD, options={"smoother.window_s": object()})

    def test_an_unknown_estimator(self):
        site = lodestone.load_site(drive.PLATFORM, drive.CLOUD)
        with self.assertRaisesRegex(lodestone.InputError, "smother.*smoother"):
            lodestone.localize(drive.LOG, site, "smother")

    def test_stamps_must_be_integers(self):
        with self.assertRaisesRegex(ValueError, "stamp_ns: expected integers, nanoseconds, found float64"):
            self.measurements.add_imu([1.7e9], np.zeros((1, 3)), np.zeros((1, 3)))
        with self.assertRaisesRegex(ValueError, "offset_ns: expected integers"):
            self.measurements.add_scan(BEGIN, np.zeros((2, 3)), np.array([0.0, 0.1]))

    def test_stamps_beyond_the_range_are_refused(self):
        zeros = np.zeros((2, 3))
        with self.assertRaisesRegex(ValueError, f"stamp_ns: value 1 is {2**63}; expected at most {2**63 - 1}"):
            self.measurements.add_imu(np.array([BEGIN, 2**63], dtype=np.uint64), zeros, zeros)
        self.measurements.add_imu(np.array([BEGIN, 2**63 - 1], dtype=np.uint64), zeros, zeros)
        self.assertEqual(list(self.measurements.imu().stamp_ns), [BEGIN, 2**63 - 1])

    def test_numbers_of_points_must_fit(self):
        for name, largest in (("ring", 65535), ("lidar", 255)):
            for value in (-1, largest + 1, 1.5, float("nan"), float("inf")):
                expected = f"{name}: point 1 has .*; expected a whole number, 0 to {largest}"
                with self.assertRaisesRegex(ValueError, expected):
                    self.measurements.add_scan(BEGIN, np.zeros((2, 3)), **{name: np.array([0, value])})
        self.assertEqual(len(self.measurements), 0)
        self.measurements.add_scan(BEGIN, np.zeros((3, 3)), ring=[0, 2.0, 65535])
        self.assertEqual(list(next(self.measurements.scans()).ring), [0, 2, 65535])

    def test_shapes(self):
        with self.assertRaisesRegex(ValueError, r"gyroscope_rad_s: expected shape \(N, 3\), found \(3,\)"):
            self.measurements.add_imu([BEGIN], np.zeros(3), np.zeros((1, 3)))
        with self.assertRaisesRegex(ValueError, "accelerometer_m_s2: expected 1 rows"):
            self.measurements.add_imu([BEGIN], np.zeros((1, 3)), np.zeros((2, 3)))
        with self.assertRaisesRegex(ValueError, r"points_m: expected shape \(N, 3\), found \(5, 4\)"):
            self.measurements.add_scan(BEGIN, np.zeros((5, 4)))
        with self.assertRaisesRegex(ValueError, "ring: expected 5 rows"):
            self.measurements.add_scan(BEGIN, np.zeros((5, 3)), ring=np.zeros(4))
        self.assertEqual(len(self.measurements), 0)

    def test_measurements_are_checked(self):
        with self.assertRaisesRegex(lodestone.InputError, "point 1 has offset_ns -5"):
            self.measurements.add_scan(BEGIN, np.zeros((2, 3)), np.array([0, -5]))
        self.measurements.add_imu([BEGIN, BEGIN], np.zeros((2, 3)), np.zeros((2, 3)))
        with self.assertRaisesRegex(lodestone.InputError, "imu at 1700000000.000000000 s: two samples have this stamp"):
            self.localize()

    def test_values_must_be_finite(self):
        points = np.ones((2, 3))
        points[1, 2] = np.nan
        self.measurements.add_scan(BEGIN, points)
        with self.assertRaisesRegex(lodestone.InputError, "a value is not finite"):
            self.localize()

    def test_without_scans(self):
        with self.assertRaisesRegex(lodestone.InputError, "the log has no scan"):
            self.localize()

    def test_a_wrong_quaternion(self):
        with self.assertRaisesRegex(lodestone.InputError, "the quaternion's length is 2; expected 1"):
            lodestone.Trajectory([1], [[0, 0, 0]], [[0, 0, 0, 2]]).interpolate([1])


if __name__ == "__main__":
    unittest.main()

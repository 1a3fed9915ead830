"""Logs are read as arrays."""

import unittest

import numpy as np

import drive
import lodestone


class LogsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.platform = lodestone.load_platform(drive.PLATFORM)
        cls.measurements = lodestone.read_log(drive.LOG, cls.platform)

    def test_topics(self):
        topics = lodestone.topics(drive.LOG)
        self.assertEqual(topics.type["/imu/data"], "sensor_msgs/Imu")
        self.assertEqual(topics.messages["/imu/data"], len(self.measurements.imu().stamp_ns))
        self.assertLess(topics.begin["/imu/data"], topics.end["/imu/data"])

    def test_arrays_have_shapes_and_units(self):
        imu = self.measurements.imu()
        self.assertEqual(imu.stamp_ns.dtype, np.int64)
        self.assertEqual(imu.accelerometer_m_s2.shape, (len(imu.stamp_ns), 3))
        self.assertAlmostEqual(np.linalg.norm(imu.accelerometer_m_s2, axis=1).mean(), 9.8, delta=0.5)
        field = self.measurements.field(self.platform.magnetometers[0])
        self.assertEqual(field.field_ut.shape, (len(field.stamp_ns), 3))
        self.assertEqual(self.measurements.wheels().yaw_rate_rad_s.shape, self.measurements.wheels().stamp_ns.shape)
        self.assertGreater(len(self.measurements.wheels().stamp_ns), 100)
        self.assertEqual(self.platform.T_imu_mag.shape, (len(self.platform.magnetometers), 7))

    def test_scans_are_streamed_as_they_are_read(self):
        scans = list(self.measurements.scans())
        streamed = list(lodestone.read_scans(drive.LOG, self.platform))
        self.assertEqual(len(scans), len(streamed))
        for one, other in zip(scans, streamed):
            self.assertEqual(one.start_ns, other.start_ns)
            self.assertTrue(np.array_equal(one.points_m, other.points_m))
            self.assertEqual(one.points_m.dtype, np.float32)
            self.assertEqual(one.end_ns, one.start_ns + one.offset_ns.max())

    def test_a_part_of_a_log(self):
        stamps = self.measurements.imu().stamp_ns
        part = lodestone.read_log(drive.LOG, self.platform, lidar=False, magnetometers=False, wheels=False,
                                  begin_ns=int(stamps[10]), end_ns=int(stamps[30]))
        self.assertEqual(len(part), 20)
        self.assertTrue(np.array_equal(part.imu().stamp_ns, stamps[10:30]))

    def test_trajectories_keep_nanoseconds(self):
        trajectory = lodestone.Trajectory([1_700_000_000_123_456_789, 1_700_000_001_000_000_001], np.zeros((2, 3)),
                                          [[0, 0, 0, 1], [0, 0, 1, 0]])
        middle = trajectory.interpolate([1_700_000_000_500_000_000, 5], max_gap_s=1.0)
        self.assertAlmostEqual(middle.quaternion_xyzw[0, 2], np.sin(0.25 * np.pi * 2 * 0.42955), places=3)
        self.assertTrue(np.isnan(middle.position_m[1]).all())
        self.assertEqual(trajectory.to_frame().index.asi8[0], 1_700_000_000_123_456_789)


if __name__ == "__main__":
    unittest.main()

"""Logs, and measurements in memory."""

import os
from dataclasses import dataclass
from typing import Iterator, NamedTuple, Optional

import numpy as np
import pandas as pd

from . import _lodestone
from .trajectory import time_index


@dataclass(frozen=True)
class LogWarning:
    """What a run or a reader survived. pandas.DataFrame(warnings) makes a table.

    kind: a short name, such as lidar.nan_points.
    count: how often.
    detail: text of the first warning of this kind.
    first_ns, last_ns: times of the first and the last.
    """

    kind: str
    count: int
    detail: str
    first_ns: int
    last_ns: int


class ImuSamples(NamedTuple):
    """Samples of the IMU, imu frame: stamp_ns (N,), gyroscope_rad_s (N, 3), accelerometer_m_s2 (N, 3)."""

    stamp_ns: np.ndarray
    gyroscope_rad_s: np.ndarray
    accelerometer_m_s2: np.ndarray


class FieldSamples(NamedTuple):
    """Readings of one magnetometer, in its frame: stamp_ns (N,), field_ut (N, 3)."""

    stamp_ns: np.ndarray
    field_ut: np.ndarray


class WheelSamples(NamedTuple):
    """Wheel odometry, wheel frame: stamp_ns, forward_velocity_m_s, lateral_velocity_m_s, yaw_rate_rad_s, each (N,)."""

    stamp_ns: np.ndarray
    forward_velocity_m_s: np.ndarray
    lateral_velocity_m_s: np.ndarray
    yaw_rate_rad_s: np.ndarray


class Scan(NamedTuple):
    """One scan, in the frame of the (first) LiDAR, not deskewed.

    points_m (N, 3) float32; offset_ns (N,) int32, the point's time minus start_ns; intensity, ring and lidar (N,).
    """

    start_ns: int
    end_ns: int
    points_m: np.ndarray
    offset_ns: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray
    lidar: np.ndarray


class Measurements(_lodestone.Measurements):
    """Measurements of one robot in memory.

        measurements = lodestone.Measurements(lodestone.load_platform("platform.yaml"))
        measurements.add_imu(stamp_ns, gyroscope_rad_s, accelerometer_m_s2)
        measurements.add_scan(start_ns, points_m, offset_ns)
        measurements.add_field("front", stamp_ns, field_ut)
        result = lodestone.localize(measurements, site)

    Measurements may be added in any order. Arrays are copied once. Calibrations and clock offsets of the platform file
    are not applied: apply them before. read_log applies them.
    """

    warnings: list[LogWarning] = []

    def imu(self) -> ImuSamples:
        """All samples of the IMU, in the order of addition."""
        return ImuSamples(*self.imu_arrays())

    def field(self, magnetometer: str) -> FieldSamples:
        """All readings of one magnetometer. Raises InputError for an unknown name."""
        return FieldSamples(*self.field_arrays(magnetometer))

    def wheels(self) -> WheelSamples:
        """All samples of the wheel odometry."""
        return WheelSamples(*self.wheel_arrays())

    def scans(self) -> Iterator[Scan]:
        """The scans, in the order of addition."""
        return (Scan(*self.scan_arrays(index)) for index in range(self.scan_count()))


def topics(log) -> pd.DataFrame:
    """The topics of a log of any format: type, messages, and the times of the first and last message, by name.

    Raises InputError if the log cannot be read.
    """
    rows = _lodestone.topics(os.fspath(log))
    frame = pd.DataFrame(rows, columns=["name", "type", "messages", "begin", "end"]).set_index("name")
    return frame.assign(begin=time_index(frame.begin), end=time_index(frame.end))


def read_log(log, platform, *, lidar: bool = True, imu: bool = True, magnetometers: bool = True, wheels: bool = True,
             begin_ns: Optional[int] = None, end_ns: Optional[int] = None) -> Measurements:
    """Reads a log of any format into memory, with the calibrations and clock offsets of the platform file applied.

    platform: a Platform.
    lidar, imu, magnetometers, wheels: which sensors are read. The log must have their topics.
    begin_ns, end_ns: only measurements of this time, the end excluded. A scan has the time of its end.

    `warnings` of the result lists what the reader discarded. Scans take 24 bytes a point. Raises InputError.
    """
    measurements = Measurements(platform)
    rows = _lodestone.read_log(measurements, os.fspath(log), lidar, imu, magnetometers, wheels, begin_ns, end_ns)
    measurements.warnings = [LogWarning(*row) for row in rows]
    return measurements


def read_scans(log, platform) -> Iterator[Scan]:
    """The scans of a log, one after the other; only one is in memory. Raises InputError."""
    return (Scan(*arrays) for arrays in _lodestone.ScanReader(os.fspath(log), platform))

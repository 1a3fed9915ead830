"""Trajectories and estimates as numpy arrays and pandas."""

import os
from dataclasses import dataclass

import numpy as np
import pandas as pd

from . import _lodestone

_POSE_COLUMNS = ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]
_TUM_HEADER = "t_s x_m y_m z_m qx qy qz qw: T_map_imu at scan ends"
_HEALTH = np.array(["good", "uncertain", "lost"])
_HEALTH_REASON = np.array(["none", "not_finite", "covariance", "unobserved", "scan_off_map", "field_off_map",
                           "motion", "searching"])


def time_index(stamp_ns: np.ndarray) -> pd.DatetimeIndex:
    """Stamps as pandas times. They keep all nanoseconds."""
    return pd.DatetimeIndex(np.asarray(stamp_ns, dtype=np.int64), name="time")


def _comment(text: str) -> str:
    return "".join(f"# {line}\n" for line in text.splitlines())


@dataclass(frozen=True)
class Trajectory:
    """Poses T_map_imu in order of time.

    stamp_ns: (N,) int64, nanoseconds.
    position_m: (N, 3) float64, map frame, m.
    quaternion_xyzw: (N, 4) float64.
    """

    stamp_ns: np.ndarray
    position_m: np.ndarray
    quaternion_xyzw: np.ndarray

    def __len__(self) -> int:
        return len(self.stamp_ns)

    @property
    def t_s(self) -> np.ndarray:
        """(N,) seconds, float64. For stamps since 1970, rounded to 0.2 µs."""
        return np.asarray(self.stamp_ns) * 1e-9

    def to_frame(self) -> pd.DataFrame:
        """A frame with the columns x_m, y_m, z_m, qx, qy, qz, qw, indexed by time."""
        values = np.hstack([self.position_m, self.quaternion_xyzw])
        return pd.DataFrame(values, index=time_index(self.stamp_ns), columns=_POSE_COLUMNS)

    def interpolate(self, stamp_ns, max_gap_s: float = 0.25) -> "Trajectory":
        """The poses at other times: positions linear, rotations along the geodesic.

        stamp_ns: (M,) integers, nanoseconds.
        Poses are NaN outside the trajectory, and where neighbouring poses are more than max_gap_s apart.
        """
        stamps = np.asarray(stamp_ns)
        return Trajectory(stamps, *_lodestone.interpolate(*self._arrays(), stamps, max_gap_s))

    def write_tum(self, path, comment: str = "") -> None:
        """Writes a TUM file: t_s x_m y_m z_m qx qy qz qw. `comment` becomes its first lines.

        Raises InputError if the file cannot be written.
        """
        _lodestone.write_text_file(os.fspath(path), _comment(comment) + _lodestone.tum_lines(*self._arrays()))

    def _arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.stamp_ns, self.position_m, self.quaternion_xyzw


def read_trajectory(path, times=None) -> Trajectory:
    """Reads a TUM file (t x y z qx qy qz qw), a EuRoC csv, or a KITTI file (12 numbers a line).

    times: path of the file with the stamps of a KITTI file, seconds, one in each line.

    Raises InputError with file and line.
    """
    return Trajectory(*_lodestone.read_trajectory(os.fspath(path), "" if times is None else os.fspath(times)))


@dataclass(frozen=True)
class Estimates:
    """States of the robot at the ends t_k of all scans, in order of time.

    stamp_ns: (N,) int64, nanoseconds.
    position_m: (N, 3) of imu in the map frame, m.
    quaternion_xyzw: (N, 4) from imu to map.
    velocity_m_s: (N, 3) of imu, map axes.
    gyroscope_bias_rad_s, accelerometer_bias_m_s2: (N, 3), imu axes.
    gravity_m_s2: (N, 3), map axes.
    covariance: (N, 6, 6) of the pose; order φ (right, body, rad), p (map, m).
    health: (N,) "good", "uncertain" or "lost". A lost estimate must not be used.
    health_reason: (N,) why the health is not good, or "none".
    """

    stamp_ns: np.ndarray
    position_m: np.ndarray
    quaternion_xyzw: np.ndarray
    velocity_m_s: np.ndarray
    gyroscope_bias_rad_s: np.ndarray
    accelerometer_bias_m_s2: np.ndarray
    gravity_m_s2: np.ndarray
    covariance: np.ndarray
    health: np.ndarray
    health_reason: np.ndarray

    @classmethod
    def _of(cls, arrays: dict) -> "Estimates":
        names = {"health": _HEALTH[arrays["health"]], "health_reason": _HEALTH_REASON[arrays["health_reason"]]}
        return cls(**{**arrays, **names})

    def __len__(self) -> int:
        return len(self.stamp_ns)

    @property
    def usable(self) -> np.ndarray:
        """(N,) bool: the estimate is not lost."""
        return self.health != "lost"

    @property
    def trajectory(self) -> Trajectory:
        """The usable poses."""
        usable = self.usable
        return Trajectory(self.stamp_ns[usable], self.position_m[usable], self.quaternion_xyzw[usable])

    @property
    def position_sigma_m(self) -> np.ndarray:
        """(N, 3) one sigma of each axis of the position."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2)[:, 3:])

    @property
    def lost_intervals_ns(self) -> list[tuple[int, int]]:
        """First and last stamp of each interval of lost estimates."""
        lost = np.concatenate([[False], ~self.usable, [False]]).astype(np.int8)
        begins, ends = np.flatnonzero(np.diff(lost) == 1), np.flatnonzero(np.diff(lost) == -1) - 1
        return [(int(self.stamp_ns[begin]), int(self.stamp_ns[end])) for begin, end in zip(begins, ends)]

    def to_frame(self) -> pd.DataFrame:
        """A frame of all estimates, indexed by time: pose, velocity, sigma of the position, health and its reason."""
        frame = Trajectory(self.stamp_ns, self.position_m, self.quaternion_xyzw).to_frame()
        for name, values in {"v{}_m_s": self.velocity_m_s, "sigma_{}_m": self.position_sigma_m}.items():
            frame[[name.format(axis) for axis in "xyz"]] = values
        return frame.assign(health=pd.Categorical(self.health, _HEALTH),
                            health_reason=pd.Categorical(self.health_reason, _HEALTH_REASON))

    def write_tum(self, path) -> None:
        """Writes the usable poses as a TUM file: the same bytes as trajectory.tum of `lodestone run`.

        `lodestone run` marks files of runs that did not reach the end of the log, or ended lost, by a last comment.

        Raises InputError if the file cannot be written.
        """
        text = _comment(_TUM_HEADER) + _lodestone.tum_lines(*self.trajectory._arrays())
        for begin, end in self.lost_intervals_ns:
            text += _comment(f"lost from {_lodestone.format_stamp(begin)} to {_lodestone.format_stamp(end)}")
        _lodestone.write_text_file(os.fspath(path), text)

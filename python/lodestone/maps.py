"""Construction of magnetic maps and cloud maps from survey drives."""

import os
from dataclasses import dataclass
from typing import Iterable, Mapping, Optional, Sequence, Union

import numpy as np

from . import _lodestone
from ._lodestone import InputError, MagneticMap, Platform
from ._settings import paths, settings
from .logs import LogWarning, Measurements
from .trajectory import Trajectory


@dataclass(frozen=True)
class FieldSurvey:
    """Readings of magnetometers with their positions, as input of build_magnetic_map.

    position_m: (N, 3) of the magnetometer, map frame, m.
    field_ut: (N, 3) along the map's axes, µT.
    noise_ut: (N,) white noise, one sigma of a component, µT.
    stamp_ns: (N,) integers, nanoseconds, not decreasing.
    without_pose: number of readings that were discarded, because the trajectory has no pose there.
    warnings: what the reader of the log discarded.
    magnetometer: (N,) integers, place of each reading's magnetometer in the platform file; None: unknown.
    quaternion_xyzw: (N, 4) rotation of the magnetometer to the map frame; None: unknown. If both are known, constant
        offsets of the magnetometers are found and subtracted.
    """

    position_m: np.ndarray
    field_ut: np.ndarray
    noise_ut: np.ndarray
    stamp_ns: np.ndarray
    without_pose: int = 0
    warnings: Sequence[LogWarning] = ()
    magnetometer: Optional[np.ndarray] = None
    quaternion_xyzw: Optional[np.ndarray] = None

    def __len__(self) -> int:
        return len(self.stamp_ns)


@dataclass(frozen=True)
class MagneticMapResult:
    """A map that was built.

    magnetic_map: the map.
    cells, nodes: number of averaged cells of the survey, and of nodes with field.
    median_sigma_ut, high_sigma_ut: half, and 95 %, of the nodes have a smaller sigma, µT.
    drive_sigma_ut, drive_position_sigma_m: error between drives beyond noise: (3,) µT, and m.
    offsets_ut: (M, 3), what was subtracted from the readings of each magnetometer, own axes, µT; (0, 3): nothing.
    clock_s: what the stamps of the magnetometers were corrected by, s; positive: they were late. 0: nothing.
    held_out: errors on parts of the survey that were predicted from the rest: cells, refused, rms_ut (3,),
        normalized_rms (3,), which is 1 if the map's sigma is right. None: the survey is too short, or not wanted.
    """

    magnetic_map: MagneticMap
    cells: int
    nodes: int
    median_sigma_ut: float
    high_sigma_ut: float
    drive_sigma_ut: np.ndarray
    drive_position_sigma_m: float
    offsets_ut: np.ndarray
    clock_s: float
    held_out: Optional[dict]


def read_survey(log, trajectory: Trajectory, platform: Platform, *, max_gap_s: float = 0.25) -> FieldSurvey:
    """The magnetometer readings of a survey drive, in the map frame.

    log: path of a log, or Measurements.
    trajectory: T_map_imu of the drive, in the clock of the log, accurate to a centimetre and a tenth of a degree.
    platform: the robot, with calibrated magnetometers.
    max_gap_s: readings between poses that are farther apart are discarded.

    Raises InputError if the log cannot be read, or if no reading has a pose.
    """
    poses = trajectory._arrays()
    if isinstance(log, Measurements):
        arrays, rows = _lodestone.survey_of_measurements(log, *poses, max_gap_s)
    else:
        arrays, rows = _lodestone.survey_of_log(os.fspath(log), platform, *poses, max_gap_s)
    survey = FieldSurvey(*arrays[:5], [LogWarning(*row) for row in rows], *arrays[5:])
    if len(survey) == 0:
        raise InputError(f"no magnetometer reading has a pose ({survey.without_pose} are outside of the trajectory); "
                         "use the trajectory of this drive, in the clock of the log")
    return survey


def build_magnetic_map(survey: Union[FieldSurvey, Iterable[FieldSurvey]], *,
                       options: Optional[Mapping[str, object]] = None,
                       config: Union[str, os.PathLike, Sequence] = (), threads: int = 0) -> MagneticMapResult:
    """Builds a magnetic map by Gaussian-process regression, as `lodestone map magnetic`.

    survey: one drive, or several that form one survey in one frame. One robot
        drove all of them: its magnetometers have the same offsets.
    options: for example {"resolution_m": 0.2, "method": "curl-free"}. list_map_options() has all.
    config: path or paths of configuration files. `options` override them.
    threads: 0: all of the machine. The map does not depend on it.

    Raises InputError if the survey is too short or an option is out of range, and if no node has a field.
    """
    surveys = [survey] if isinstance(survey, FieldSurvey) else list(survey)
    arrays = [(one.position_m, one.field_ut, one.noise_ut, one.stamp_ns, one.magnetometer, one.quaternion_xyzw)
              for one in surveys]
    values = _lodestone.build_magnetic_map(arrays, settings(options), paths(config), threads)
    result = MagneticMapResult(**values)
    if result.nodes == 0:
        raise InputError(f"no node of the map has a sigma below {result.magnetic_map.max_sigma_ut:.3f} uT; survey more "
                         "densely, or raise max_sigma_ut")
    return result


def build_cloud_map(drives, platform: Platform, *, voxel_m: float = 0.05, min_points: int = 2,
                    max_range_m: Optional[float] = None, max_gap_s: Optional[float] = None, keep_moving: bool = False,
                    threads: int = 0) -> np.ndarray:
    """Builds a cloud map from scans with known poses, as `lodestone map cloud`: (N, 3) float32, one point a voxel, m.

    drives: pairs of a log (path or Measurements) and its Trajectory T_map_imu.
    platform: the robot.
    voxel_m: edge of the voxels in which points are averaged.
    min_points: voxels with fewer points are no part of the map.
    max_range_m: largest range of points; None: that of the platform.
    max_gap_s: points between poses that are farther apart are discarded; None: 0.25 s, or 1.5 scan periods if longer.
    keep_moving: keep moving objects; the logs are then read once instead of twice.
    threads: 0: all of the machine. The map does not depend on it.

    Raises InputError.
    """
    gap_s = max(0.25, 1.5 * platform.scan_period_s) if max_gap_s is None else max_gap_s
    rows = [(log if isinstance(log, Measurements) else os.fspath(log), *trajectory._arrays())
            for log, trajectory in drives]
    return _lodestone.build_cloud_map(rows, platform, voxel_m, min_points, max_range_m, gap_s, keep_moving, threads)


def read_point_cloud(path) -> np.ndarray:
    """The points of a PCD, PLY or LAS file, (N, 3) float32, m. Raises InputError."""
    return _lodestone.read_point_cloud(os.fspath(path))


def write_point_cloud(path, points_m) -> None:
    """Writes (N, 3) points, m, as a binary PCD. Raises InputError if this fails."""
    _lodestone.write_point_cloud(os.fspath(path), points_m)

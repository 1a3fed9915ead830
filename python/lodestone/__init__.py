"""Localization of logged LiDAR, IMU and magnetometer data in prior maps.

    import lodestone

    site = lodestone.load_site("platform.yaml", cloud="cloud.pcd", magnetic="field.yaml")
    result = lodestone.localize("log.bag", site, initial_pose="auto")
    result.best.position_m        # (N, 3)
    result.best.to_frame()        # pandas

Conventions: poses are T_map_imu, p_map = T_map_imu p_imu. Quaternions are x, y, z, w. Units are SI, and µT for the
field. Stamps are int64 nanoseconds, because float64 seconds since 1970 have no nanoseconds. Covariances are of the
pose, in the order φ (rotation, right, body frame, rad), p (position, map frame, m).
"""

from ._lodestone import (InputError, MagneticMap, Platform, Site, __version__, estimator_names, list_map_options,
                         list_options, read_magnetic_map)
from .evaluation import Evaluation, evaluate
from .localization import LocalizationResult, load_platform, load_site, localize, parse_platform
from .logs import FieldSamples, ImuSamples, LogWarning, Measurements, Scan, WheelSamples, read_log, read_scans, topics
from .maps import (FieldSurvey, MagneticMapResult, build_cloud_map, build_magnetic_map, read_point_cloud, read_survey,
                   write_point_cloud)
from .trajectory import Estimates, Trajectory, read_trajectory

__all__ = [
    "Estimates", "Evaluation", "FieldSamples", "FieldSurvey", "ImuSamples", "InputError", "LocalizationResult",
    "LogWarning", "MagneticMap", "MagneticMapResult", "Measurements", "Platform", "Scan", "Site", "Trajectory",
    "WheelSamples", "build_cloud_map", "build_magnetic_map", "estimator_names", "evaluate", "list_map_options",
    "list_options", "load_platform", "load_site", "localize", "parse_platform", "read_log", "read_magnetic_map",
    "read_point_cloud", "read_scans", "read_survey", "read_trajectory", "topics", "write_point_cloud", "__version__",
]

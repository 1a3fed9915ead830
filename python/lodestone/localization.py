"""Localization of logs and arrays."""

import math
import os
from dataclasses import dataclass
from typing import Callable, Mapping, Optional, Sequence, Union

import numpy as np
import pandas as pd

from . import _lodestone
from ._lodestone import InputError, MagneticMap, Platform, Site
from ._settings import paths, settings
from .logs import LogWarning, Measurements
from .trajectory import Estimates, Trajectory, time_index


@dataclass(frozen=True)
class LocalizationResult:
    """The estimates of one run.

    best: the best estimate of each scan: of a smoother, that which left the window, or that of the batch.
    causal: the estimate of each scan from earlier measurements only.
    smoothed: the window's estimates if a batch followed; otherwise without rows.
    diagnostics: a row for each scan, with the columns of diagnostics.csv, indexed by time.
    scans: number of processed scans.
    begin_ns, end_ns: start of the first and end of the last scan.
    stopped: the callback `progress` ended the log.
    failure: the InputError at which the log broke off, or None. The estimates up to there are complete.
    solver: library and linear solver of the estimator, with its BLAS.
    calibration: changes of the platform's calibration with one sigma, as nested dicts, or None if not estimated.
    warnings: what the run survived; pandas.DataFrame(result.warnings) makes a table.
    """

    best: Estimates
    causal: Estimates
    smoothed: Estimates
    diagnostics: pd.DataFrame
    scans: int
    begin_ns: int
    end_ns: int
    stopped: bool
    failure: Optional[InputError]
    solver: str
    calibration: Optional[dict]
    warnings: list[LogWarning]


def load_platform(path, *, lidar: bool = True, imu: bool = True, magnetometers: bool = True) -> Platform:
    """Reads a platform file.

    lidar, imu, magnetometers: sensors whose keys must be in the file. Raises InputError with file and line.
    """
    return _lodestone.load_platform(os.fspath(path), lidar, imu, magnetometers)


def parse_platform(text: str, name: str = "the platform text") -> Platform:
    """The platform of a text in the format of platform files. `name` stands for the file in messages."""
    return _lodestone.parse_platform(text, name)


def load_site(platform, cloud=None, magnetic=None, *, options: Optional[Mapping[str, object]] = None,
              config: Union[str, os.PathLike, Sequence] = (), max_range_m: Optional[float] = None,
              origin_m: Sequence[float] = (0.0, 0.0, 0.0)) -> Site:
    """Loads the maps of a site for a robot. A site serves any number of logs and estimators.

    platform: path of a platform file, or a Platform.
    cloud: path of the cloud map: PCD, PLY or LAS. None: LiDAR is not used.
    magnetic: path of the magnetic map, YAML, or a MagneticMap. None: magnetometers are not used.
    options: of --set, for example {"smoother.refine": "batch"}. list_options() has all.
    config: path or paths of configuration files. `options` override them.
    max_range_m: replaces the largest range of every LiDAR.
    origin_m: x, y, z of the site's origin in the coordinates of georeferenced map files; subtracted from these files,
        not from a MagneticMap. All poses are from this origin.

    Raises InputError.
    """
    origin_m = tuple(float(value) for value in origin_m)
    if len(origin_m) != 3 or not all(math.isfinite(value) for value in origin_m):
        raise ValueError(f"origin_m: expected x, y, z in metres, finite, found {origin_m}")
    if not isinstance(platform, Platform):
        platform = load_platform(platform, lidar=cloud is not None)
    field = magnetic if isinstance(magnetic, MagneticMap) else None
    file = "" if magnetic is None or field is not None else os.fspath(magnetic)
    return _lodestone.load_site(platform, "" if cloud is None else os.fspath(cloud), file, field, settings(options),
                                paths(config), max_range_m, origin_m)


def localize(log, site: Site, estimator: str = "smoother", initial_pose=None, *, threads: int = 0,
             progress: Optional[Callable[[float, int], object]] = None,
             refining: Optional[Callable[[float], object]] = None) -> LocalizationResult:
    """Localizes a log, or measurements in memory, at a site.

    log: path of a log of any format, or Measurements.
    estimator: one of estimator_names().
    initial_pose: T_map_imu at the start of the first scan. One of
        an array (7,) or a text of x, y, z (m), qx, qy, qz, qw;
        a Trajectory or Estimates in the clock of the log;
        "auto": searched on the whole cloud map;
        None: the map's origin, with a warning.
    threads: 0: all of the machine. The result does not depend on it.
    progress: called with the finished share, 0 to 1, and the scan's end (ns) after each scan. False ends the log there.
    refining: called with the finished share of a batch refinement. False stops the refinement.

    The same input gives the same bits, and the same as `lodestone run`. The interpreter lock is released except in the
    callbacks. An exception of a callback ends the run and is raised. So does Ctrl-C, after the current scan. BLAS, and
    with it numpy, has one thread from then on.

    Raises InputError, before the first estimate, if the estimator is unknown or lacks a map, the log cannot be read or
    has no scan, or the initial pose is outside the map or not found. If the log breaks off later, `failure` of the
    result is the error.
    """
    if not isinstance(site, Site):
        raise TypeError(f"site: expected the Site of load_site, found {type(site).__name__}")
    if isinstance(initial_pose, Estimates):
        initial_pose = initial_pose.trajectory
    if isinstance(initial_pose, Trajectory):
        initial_pose = initial_pose._arrays()
    elif initial_pose is not None and not isinstance(initial_pose, str):
        initial_pose = np.asarray(initial_pose, dtype=float)
    arguments = (site, estimator, initial_pose, threads, progress, refining)
    if isinstance(log, _lodestone.Measurements):
        values = _lodestone.localize_measurements(log, *arguments)
    else:
        values = _lodestone.localize_log(os.fspath(log), *arguments)
    for name in ("best", "causal", "smoothed"):
        values[name] = Estimates._of(values[name])
    causal = values["causal"]
    values["diagnostics"] = pd.DataFrame({"health": causal.health, "health_reason": causal.health_reason,
                                          **values["diagnostics"]}).set_index(time_index(causal.stamp_ns))
    values["warnings"] = [LogWarning(*row) for row in values["warnings"]]
    if values["failure"] is not None:
        values["failure"] = InputError(values["failure"])
    return LocalizationResult(**values)

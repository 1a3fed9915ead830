"""Comparison of a trajectory with the ground truth."""

from dataclasses import dataclass
from typing import Optional, Sequence, Union

import numpy as np
import pandas as pd

from . import _lodestone
from ._lodestone import InputError
from .trajectory import Estimates, Trajectory, read_trajectory, time_index

RELATIONS = ("translation", "angle", "heading", "rpe", "rpe-angle")
_UNITS = {"translation": "m", "angle": "deg", "heading": "deg", "rpe": "m", "rpe-angle": "deg"}


@dataclass(frozen=True)
class Evaluation:
    """Errors of a trajectory.

    stamp_ns: (M,) stamps of the M compared poses.
    errors: arrays of errors by relation. "translation" (m), "angle" and "heading" (deg) have one for each compared
        pose; "rpe" (m) and "rpe-angle" (deg) have one for each segment. Heading errors have a sign.
    summary: count, rmse, mean, median, 95 %, max and std of the absolute errors, by relation. The rmse of
        "translation" is the ATE.
    alignment_scale: scale of the alignment; 1 without "sim3".
    alignment: (7,) x, y, z, qx, qy, qz, qw of the alignment that was applied to the estimate.
    nees: consistency of the covariances with the errors, or None: count, singular, and for each degree of freedom
        pose, rotation and position. 1 is consistent, above 1 is overconfident. low and high are the 95 % confidence
        interval of pose; share_within_95 is the share of poses within their 95 % bound.
    """

    stamp_ns: np.ndarray
    errors: dict[str, np.ndarray]
    summary: pd.DataFrame
    alignment_scale: float
    alignment: np.ndarray
    nees: Optional[dict]

    def to_frame(self) -> pd.DataFrame:
        """The errors of each compared pose, indexed by time."""
        of_poses = {f"{name}_{_UNITS[name]}": values for name, values in self.errors.items() if "rpe" not in name}
        return pd.DataFrame(of_poses, index=time_index(self.stamp_ns))


def _check(relations: Sequence[str], delta: float, delta_unit: str) -> None:
    for name in relations:
        if name not in RELATIONS:
            raise InputError(f"relations: expected names from {', '.join(RELATIONS)}, found '{name}'")
    if delta_unit not in ("frames", "metres"):
        raise InputError(f"delta_unit: expected frames or metres, found '{delta_unit}'")
    if not delta > 0 or (delta_unit == "frames" and delta != int(delta)):
        raise InputError(f"delta: expected a length above 0, or a whole number of frames above 0, found {delta}")


def evaluate(estimate: Union[Estimates, Trajectory, str], truth: Union[Trajectory, str], *, align: str = "none",
             relations: Optional[Sequence[str]] = None, delta: float = 1, delta_unit: str = "frames",
             all_pairs: bool = False, interpolate: bool = False, max_difference_s: float = 0.01,
             covariance: Optional[np.ndarray] = None) -> Evaluation:
    """Compares a trajectory with the ground truth, as `lodestone evaluate`.

    estimate: a Trajectory, the path of its file, or Estimates, of which the usable poses count.
    truth: a Trajectory or the path of its file, in the same clock.
    align: "none", "se3", "sim3" or "origin": how the estimate is aligned before.
    relations: names of errors; None: all that the trajectory has.
    delta, delta_unit: length of the segments of rpe, in "frames" or "metres".
    all_pairs: with frames: a segment begins at every pose.
    interpolate: interpolate the ground truth at the stamps of the estimate, instead of matching stamps.
    max_difference_s: largest difference of matched stamps.
    covariance: (N, 6, 6) of the N poses of the estimate, for NEES. Estimates have their own. Not used with alignment.

    Raises InputError if no stamps match, a name is unknown, or the alignment is undetermined.
    """
    _check(relations or (), delta, delta_unit)
    if isinstance(estimate, Estimates):
        covariance = estimate.covariance[estimate.usable] if covariance is None else covariance
        estimate = estimate.trajectory
    estimate, truth = (one if isinstance(one, Trajectory) else read_trajectory(one) for one in (estimate, truth))
    pairs = _lodestone.Pairs(estimate._arrays(), truth._arrays(), align, interpolate, max_difference_s)
    lengths, angles = pairs.relative(delta, delta_unit == "metres", all_pairs)
    errors = {"translation": pairs.translations(), "angle": np.rad2deg(pairs.angles()),
              "heading": np.rad2deg(pairs.headings()), "rpe": lengths, "rpe-angle": np.rad2deg(angles)}
    for name in relations or ():
        if len(errors[name]) == 0:
            raise InputError(f"{name}: no segment of {delta} {delta_unit} in {len(pairs)} matched poses; "
                             "decrease delta")
    errors = {name: values for name, values in errors.items() if len(values) and name in (relations or RELATIONS)}
    rows = {name: {"unit": _UNITS[name], **_lodestone.summary_of(np.abs(values))} for name, values in errors.items()}
    nees = pairs.consistency(covariance) if covariance is not None and align == "none" else None
    summary = pd.DataFrame.from_dict(rows, orient="index")
    return Evaluation(pairs.stamp_ns, errors, summary, pairs.scale, pairs.transform, nees)

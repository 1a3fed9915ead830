"""The evaluation is that of `lodestone evaluate`."""

import json
import tempfile
import unittest
from pathlib import Path

import numpy as np

import drive
import lodestone


class EvaluationTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.estimate = lodestone.read_trajectory(drive.RUN / "trajectory.tum")
        cls.truth = lodestone.read_trajectory(drive.TRUTH)

    def command(self, *options):
        return json.loads(drive.lodestone("evaluate", drive.RUN / "trajectory.tum", drive.TRUTH, "--json", *options))

    def assert_same(self, evaluation, expected):
        self.assertEqual(len(evaluation.stamp_ns), expected["pairs"])
        self.assertEqual(list(evaluation.summary.index), list(expected["relations"]))
        for name, relation in expected["relations"].items():
            for figure in ("count", "rmse", "mean", "median", "max", "std"):
                self.assertEqual(evaluation.summary[figure][name], relation[figure], f"{name} {figure}")
            self.assertEqual(evaluation.summary["95 %"][name], relation["quantiles"]["95"])

    def test_errors(self):
        self.assert_same(lodestone.evaluate(self.estimate, self.truth, interpolate=True), self.command("--interpolate"))

    def test_kitti_file(self):
        with tempfile.TemporaryDirectory() as folder:
            poses = Path(folder) / "poses.txt"
            drive.lodestone("export", drive.RUN.parent, "--to", "kitti", "--estimator", drive.RUN.name, "--out", poses)
            found = lodestone.read_trajectory(poses, f"{poses}.times")
            with self.assertRaisesRegex(lodestone.InputError, "KITTI"):
                lodestone.read_trajectory(poses)
        self.assertEqual(found.stamp_ns.tolist(), self.estimate.stamp_ns.tolist())
        np.testing.assert_allclose(found.position_m, self.estimate.position_m, atol=1e-6)

    def test_alignment_and_segments(self):
        evaluation = lodestone.evaluate(self.estimate, self.truth, align="sim3", delta=0.5, delta_unit="metres")
        expected = self.command("--align", "sim3", "--delta", 0.5, "--delta-unit", "metres")
        self.assert_same(evaluation, expected)
        self.assertEqual(evaluation.alignment_scale, expected["alignment"]["scale"])
        self.assertEqual(evaluation.alignment.tolist(),
                         expected["alignment"]["translation_m"] + expected["alignment"]["rotation_xyzw"])

    def test_nees(self):
        table = np.genfromtxt(drive.RUN / "covariance.csv", delimiter=",", skip_header=1)[:, 1:]
        covariance = np.zeros((len(table), 6, 6))
        rows, columns = np.triu_indices(6)
        covariance[:, rows, columns] = covariance[:, columns, rows] = table
        evaluation = lodestone.evaluate(self.estimate, self.truth, interpolate=True, covariance=covariance)
        expected = self.command("--interpolate", "--covariance", drive.RUN / "covariance.csv")["nees"]
        for name, value in expected.items():
            self.assertEqual(evaluation.nees[name], value, name)

    def test_estimates_have_their_covariances(self):
        site = lodestone.load_site(drive.PLATFORM, drive.CLOUD)
        best = lodestone.localize(drive.LOG, site, "ieskf", self.truth).best
        evaluation = lodestone.evaluate(best, drive.TRUTH, interpolate=True)
        self.assertEqual(evaluation.nees["count"], len(best))
        self.assertEqual(list(evaluation.to_frame().columns), ["translation_m", "angle_deg", "heading_deg"])

    def test_errors_of_the_call(self):
        with self.assertRaisesRegex(lodestone.InputError, "align: expected one of .*did you mean 'sim3'"):
            lodestone.evaluate(self.estimate, self.truth, align="sim4")
        with self.assertRaisesRegex(lodestone.InputError, "no stamps .* match"):
            late = lodestone.Trajectory(self.truth.stamp_ns + 10**12, self.truth.position_m, self.truth.quaternion_xyzw)
            lodestone.evaluate(self.estimate, late)
        with self.assertRaisesRegex(lodestone.InputError, "relations: expected"):
            lodestone.evaluate(self.estimate, self.truth, relations=["ate"])
        with self.assertRaisesRegex(lodestone.InputError, "delta: expected"):
            lodestone.evaluate(self.estimate, self.truth, delta=-1)


if __name__ == "__main__":
    unittest.main()

"""Maps that Python builds and reads are those of the commands."""

import tempfile
import unittest
from pathlib import Path

import numpy as np

import drive
import lodestone


class MapsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.platform = lodestone.load_platform(drive.PLATFORM)
        cls.truth = lodestone.read_trajectory(drive.TRUTH)
        cls.field = lodestone.read_magnetic_map(drive.FIELD)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def node_positions(self):
        _, rows, columns = self.field.shape
        row, column = np.mgrid[:rows, :columns]
        x, y = (origin + self.field.resolution_m * steps for origin, steps in zip(self.field.origin_m, (column, row)))
        return np.stack([x, y, np.full_like(x, self.field.heights_m[0])], axis=-1).reshape(-1, 3)

    def test_the_map_at_nodes_is_the_nodes(self):
        nodes = self.field.nodes()
        self.assertEqual(nodes.shape, (*self.field.shape, 4))
        for interpolation in ("bilinear", "bicubic"):
            field, gradient, sigma = self.field.query(self.node_positions(), interpolation)
            known = ~np.isnan(sigma)
            self.assertGreater(known.sum(), 100)
            expected = nodes[0].reshape(-1, 4)[known]
            np.testing.assert_allclose(field[known], expected[:, :3], atol=1e-3)
            np.testing.assert_allclose(sigma[known], expected[:, 3], atol=1e-3)
            self.assertTrue(np.isfinite(gradient[known]).all())
            self.assertTrue(np.isnan(field[~known]).all())

    def test_the_gradient_is_that_of_the_field(self):
        at = self.truth.interpolate(self.truth.stamp_ns[300:310]).position_m
        _, gradient, _ = self.field.query(at)
        step = np.array([1e-5, 0.0, 0.0])
        difference = (self.field.query(at + step)[0] - self.field.query(at - step)[0]) / 2e-5
        np.testing.assert_allclose(gradient[:, :, 0], difference, atol=1e-3)

    def test_building_gives_the_bytes_of_the_command(self):
        survey = lodestone.read_survey(drive.LOG, self.truth, self.platform)
        result = lodestone.build_magnetic_map(survey)
        result.magnetic_map.write(self.folder / "field.yaml", {"made_by": "a test"})
        self.assertEqual((self.folder / "field.tif").read_bytes(), drive.FIELD.with_suffix(".tif").read_bytes())
        text = (self.folder / "field.yaml").read_text()
        self.assertIn("a test", text)
        self.assertIn(f"height_sigma_m: {self.field.height_sigma_m:.6g}"[:20], text)
        in_memory = lodestone.read_survey(lodestone.read_log(drive.LOG, self.platform), self.truth, self.platform)
        for name in ("position_m", "field_ut", "noise_ut"):
            a, b = (np.sort(getattr(one, name), axis=0) for one in (survey, in_memory))
            self.assertTrue(np.array_equal(a, b), name)

    def test_several_drives_and_options(self):
        survey = lodestone.read_survey(drive.LOG, self.truth, self.platform)
        result = lodestone.build_magnetic_map([survey, survey], options={"resolution_m": 0.25, "held_out_block_m": 0})
        self.assertEqual(result.magnetic_map.resolution_m, 0.25)
        self.assertIsNone(result.held_out)
        with self.assertRaisesRegex(lodestone.InputError, "resolution_mm"):
            lodestone.build_magnetic_map(survey, options={"resolution_mm": 250})

    def test_a_map_of_arrays(self):
        nodes = np.zeros((1, 3, 4, 4), np.float32)
        nodes[..., 0] = np.arange(4) * 10.0  # B_x grows along x
        nodes[..., 3] = 0.5
        field = lodestone.MagneticMap(nodes, 0.5, [1.0, 2.0], [0.3])
        values, gradient, sigma = field.query([[1.75, 2.5, 0.3], [9, 9, 9]])
        np.testing.assert_allclose(values[0], [15, 0, 0])
        np.testing.assert_allclose(gradient[0, 0], [20, 0, 0], atol=1e-9)
        self.assertEqual(sigma[0], 0.5)
        self.assertIsNone(field.height_sigma_m)
        self.assertTrue(np.isnan(values[1]).all())
        self.assertTrue(np.array_equal(field.nodes(), nodes))
        with self.assertRaisesRegex(ValueError, r"position_m: expected shape \(N, 3\), found \(2,\)"):
            field.query([1.0, 2.0])

    def test_cloud_maps(self):
        command = self.folder / "command.pcd"
        drive.lodestone("map", "cloud", drive.LOG, "--trajectory", drive.TRUTH, "--platform", drive.PLATFORM, "--out",
                        command, "--voxel-m", 0.1)
        points = lodestone.build_cloud_map([(drive.LOG, self.truth)], self.platform, voxel_m=0.1)
        self.assertTrue(np.array_equal(points, lodestone.read_point_cloud(command)))
        in_memory = lodestone.read_log(drive.LOG, self.platform, imu=False, magnetometers=False)
        self.assertTrue(np.array_equal(
            points, lodestone.build_cloud_map([(in_memory, self.truth)], self.platform, voxel_m=0.1)))
        lodestone.write_point_cloud(self.folder / "map.pcd", points)
        self.assertEqual((self.folder / "map.pcd").read_bytes(), command.read_bytes())


if __name__ == "__main__":
    unittest.main()

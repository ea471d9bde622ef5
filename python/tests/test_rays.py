"""Rays and range images against the walls of a room."""

import math
import threading
import unittest

import numpy as np

import pointflight as pf
from support import room


def wall_distance(origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Exact distances (n,) from inside the room to its walls along unit vectors."""
    low, high = np.array([-3.0, -2.0, 0.0]), np.array([3.0, 2.0, 3.0])
    with np.errstate(divide="ignore", invalid="ignore"):
        ways = np.where(direction > 0, (high - origin) / direction, (low - origin) / direction)
    return np.where(direction == 0, np.inf, ways).min(1)


class RaysTest(unittest.TestCase):
    def setUp(self) -> None:
        random = np.random.default_rng(1)
        self.origins = random.uniform([-2, -1, 0.5], [2, 1, 2.5], (2000, 3))
        self.directions = random.normal(size=(2000, 3))
        self.directions /= np.linalg.norm(self.directions, axis=1)[:, None]

    def test_ranges_points_and_normals_are_the_walls(self) -> None:
        hits = pf.raycast(room(), self.origins, self.directions)
        exact = wall_distance(self.origins, self.directions)
        near = np.abs(hits.range - exact) < 0.05
        self.assertGreater(near.mean(), 0.98)
        np.testing.assert_allclose(hits.point, self.origins + hits.range[:, None] * self.directions, atol=1e-5)
        self.assertTrue((hits.label[near] == 0).all())
        flat = near & (np.abs(hits.normal).max(1) > 0.99)
        self.assertGreater(flat.mean(), 0.8)
        toward = -np.einsum("nk,nk->n", hits.normal, self.directions)
        self.assertTrue((toward[near] >= 0).all())
        # where two walls touch, normals of both count for the incidence
        off = np.abs(np.cos(hits.incidence[flat]) - toward[flat])
        self.assertGreater((off < 0.01).mean(), 0.97)
        self.assertTrue((hits.surfel[near] < len(room().words)).all())
        np.testing.assert_allclose(hits.intensity[flat], hits.point[flat][:, 2], atol=0.15)

    def test_one_origin_or_direction_counts_for_all(self) -> None:
        from_one = pf.raycast(room(), [0, 0, 1.5], self.directions)
        np.testing.assert_array_equal(
            from_one.range, pf.raycast(room(), np.tile([0, 0, 1.5], (2000, 1)), self.directions).range
        )
        along_one = pf.raycast(room(), self.origins, [0, 0, -2])
        np.testing.assert_allclose(along_one.range, self.origins[:, 2], atol=0.02)

    def test_without_a_hit(self) -> None:
        hits = pf.raycast(room(), [[0, 0, 1.5], [0, 0, 50]], [[0, 0, -1], [0, 0, 1]], range_max=1.0)
        self.assertTrue(np.isinf(hits.range).all() and np.isnan(hits.point).all() and np.isnan(hits.normal).all())
        self.assertTrue((hits.surfel == 2**32 - 1).all() and (hits.label == 65535).all())

    def test_none_are_fine(self) -> None:
        hits = pf.raycast(room(), np.zeros((0, 3)), np.zeros((0, 3)))
        self.assertEqual(hits.point.shape, (0, 3))

    def test_range_images(self) -> None:
        grid = pf.grid(16, 64)
        poses = np.stack([pf.pose(0.1 * i, 0, 1.5, yaw=0.3 * i) for i in range(5)])
        images = pf.ranges(room(), poses, grid, range_max=2.5)
        self.assertEqual(images.shape, (5, 16, 64))
        self.assertEqual(images.dtype, np.float32)
        for image, at in zip(images, poses):
            turned = grid.reshape(-1, 3) @ at[:3, :3].T
            exact = np.minimum(wall_distance(at[:3, 3], turned), 2.5).reshape(16, 64)
            self.assertGreater((np.abs(image - exact) < 0.05).mean(), 0.97)
        np.testing.assert_array_equal(pf.ranges(room(), poses[2], grid, range_max=2.5)[0], images[2])

    def test_grid_is_a_picture(self) -> None:
        grid = pf.grid(4, 8, elevation=(-0.4, 0.4), azimuth=(-1.0, 1.0))
        self.assertEqual(grid.shape, (4, 8, 3))
        np.testing.assert_allclose(np.linalg.norm(grid, axis=2), 1)
        self.assertTrue((grid[0, :, 2] > 0).all() and (grid[:, 0, 1] > 0).all())
        np.testing.assert_allclose(grid[0, 0, 2], math.sin(0.3))

    def test_pose_turns_by_roll_pitch_yaw(self) -> None:
        at = pf.pose(1, 2, 3, yaw=math.pi / 2)
        np.testing.assert_allclose(at @ [1, 0, 0, 1], [1, 3, 3, 1], atol=1e-12)
        np.testing.assert_allclose(pf.pose(pitch=0.3)[:3, :3] @ [1, 0, 0], [math.cos(0.3), 0, -math.sin(0.3)])
        np.testing.assert_allclose(pf.pose(roll=0.3)[:3, :3] @ [0, 1, 0], [0, math.cos(0.3), math.sin(0.3)])

    def test_results_do_not_depend_on_the_threads(self) -> None:
        before = pf.threads()
        try:
            pf.set_threads(1)
            one = pf.raycast(room(), self.origins, self.directions)
            pf.set_threads(3)
            self.assertEqual(pf.threads(), 3)
            three = pf.raycast(room(), self.origins, self.directions)
        finally:
            pf.set_threads(before)
        for a, b in zip(one, three):
            np.testing.assert_array_equal(a, b)

    def test_several_threads_at_once(self) -> None:
        expected = pf.raycast(room(), self.origins, self.directions).range
        wrong = []

        def work(number: int) -> None:
            for i in range(20):
                if number == 0:
                    pf.set_threads(1 + i % 3)
                if (pf.raycast(room(), self.origins, self.directions).range != expected).any():
                    wrong.append(number)

        workers = [threading.Thread(target=work, args=(k,)) for k in range(4)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        pf.set_threads(0)
        self.assertEqual(wrong, [])

    def test_misuse_is_an_exception(self) -> None:
        grid = pf.grid(2, 2)
        wrong = [
            lambda: pf.raycast(room(), [[0, 0]], [[1, 0, 0]]),
            lambda: pf.raycast(room(), [0, 0, 0], [0, 0, 0]),
            lambda: pf.raycast(room(), [0, 0, np.inf], [1, 0, 0]),
            lambda: pf.raycast(room(), [0, 0, 0], [np.nan, 0, 0]),
            lambda: pf.raycast(room(), np.zeros((2, 3)), np.ones((3, 3))),
            lambda: pf.raycast(room(), [0, 0, 0], [1, 0, 0], range_max=0.0),
            lambda: pf.raycast(room(), "a", [1, 0, 0]),
            lambda: pf.ranges(room(), np.eye(3), grid),
            lambda: pf.ranges(room(), 2 * np.eye(4), grid),
            lambda: pf.ranges(room(), np.full((4, 4), np.nan), grid),
            lambda: pf.ranges(room(), np.eye(4), [[1, 0, 0]]),
            lambda: pf.grid(0, 5),
            lambda: pf.set_threads(-1),
        ]
        for call in wrong:
            with self.assertRaises((ValueError, TypeError)):
                call()
        # random shapes and types: an exception or an answer, never a crash
        random = np.random.default_rng(2)
        for _ in range(300):
            arrays = []
            for _ in range(2):
                shape = tuple(random.integers(0, 5, random.integers(0, 4)))
                kind = random.choice(["f4", "f8", "i8", "u1", "c16", "O", "?", "S3"])
                arrays.append(np.zeros(shape, kind) if random.random() < 0.5 else np.ones(shape, kind))
            for call in (pf.raycast, pf.ranges):
                try:
                    call(room(), arrays[0], arrays[1])
                except (ValueError, TypeError):
                    pass


if __name__ == "__main__":
    unittest.main()

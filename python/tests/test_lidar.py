"""Sensors and scans: the same bytes as the program's."""

import unittest

import numpy as np

import pointflight as pf
from support import path_of, read_pcd, room, run


class LidarTest(unittest.TestCase):
    def test_scan_has_the_bytes_of_the_program(self) -> None:
        room()
        for name, index, truth in (("vlp16", 0, False), ("mid360", 7, True)):
            out = path_of(f"{name}.pcd")
            done = run(
                "scan", path_of("room.pfmap"), "--lidar", name, "--pose", "0.5,0.2,1.5,0,0,30", "--seed", "5",
                "--index", str(index), "-o", out, *(["--truth"] if truth else []),
            )  # fmt: skip
            self.assertEqual(done.returncode, 0, done.stderr)
            written = read_pcd(out)
            taken = pf.Lidar(name).scan(
                room(), pf.pose(0.5, 0.2, 1.5, yaw=np.radians(30)), seed=5, index=index, truth=truth
            )
            self.assertEqual(written.dtype, taken.dtype)
            self.assertEqual(written.tobytes(), taken.tobytes())

    def test_xyz_is_a_view(self) -> None:
        scan = pf.Lidar("vlp16").scan(room(), pf.pose(0, 0, 1.5))
        self.assertIsInstance(scan, pf.Scan)
        self.assertGreater(len(scan), 0.5 * scan.beams)
        self.assertEqual(scan.xyz.shape, (len(scan), 3))
        self.assertEqual(scan.xyz.ctypes.data, scan.ctypes.data)
        np.testing.assert_array_equal(scan.xyz[:, 2], scan["z"])
        some = scan[scan["ring"] == 3]
        np.testing.assert_array_equal(some.xyz[:, 0], some["x"])
        self.assertEqual(some.beams, scan.beams)
        scan.xyz[0] = (1, 2, 3)
        self.assertEqual(scan["y"][0], 2)
        with self.assertRaises(ValueError):
            scan["x"].xyz  # noqa: B018
        xyz = scan.xyz
        total = float(xyz.sum())
        del scan, some
        self.assertEqual(float(xyz.sum()), total)

    def test_points_lie_in_the_room(self) -> None:
        at = pf.pose(1, 0.5, 1.0, yaw=0.4)
        scan = pf.Lidar("os0_32").scan(room(), at, noise=False)
        scan = scan[scan["label"] == 0]  # without false returns
        world = scan.xyz @ at[:3, :3].T + at[:3, 3]
        inside = (world > [-3.1, -2.1, -0.1]).all(1) & (world < [3.1, 2.1, 3.1]).all(1)
        self.assertGreater(inside.mean(), 0.99)  # surfels of a wall reach beyond its corners

    def test_beams(self) -> None:
        beams = pf.Lidar("vlp16").beams()
        np.testing.assert_allclose(np.linalg.norm(beams.direction, axis=1), 1, atol=1e-6)
        self.assertEqual(beams.ring.max(), 15)
        self.assertTrue(0 <= beams.time.min() and beams.time.max() < 0.1)

    def test_beams_are_those_of_the_scan(self) -> None:
        lidar = pf.Lidar("mid360")
        scan = lidar.scan(room(), pf.pose(0, 0, 1.5), seed=3, index=4, noise=False)
        scan = scan[scan["label"] == 0]
        beams = lidar.beams(seed=3, index=4)
        of_shot = {(np.float32(t), r): d for t, r, d in zip(beams.time, beams.ring, beams.direction)}
        along = np.array([of_shot[shot] for shot in zip(scan["time"], scan["ring"])])
        np.testing.assert_allclose(scan.xyz, along * scan["range"][:, None], atol=1e-4)

    def test_sensor_file_is_there_to_be_changed(self) -> None:
        lidar = pf.Lidar("vlp16")
        self.assertEqual(lidar.rate, 10.0)
        self.assertIn("VLP-16", lidar.title)
        with open(path_of("own.yaml"), "w", encoding="utf-8") as file:
            file.write("rate: 5\nrange_max: 60\npattern: rings\nrings: {channels: 8}\n")
        self.assertEqual(pf.Lidar(path_of("own.yaml")).rate, 5.0)
        self.assertIn("rings:", lidar.text)

    def test_errors(self) -> None:
        with self.assertRaisesRegex(pf.InputError, "mid360"):
            pf.Lidar("mid")
        lidar = pf.Lidar("vlp16")
        for wrong in (
            lambda: lidar.scan(room(), np.eye(3)),
            lambda: lidar.scan(room(), -np.eye(4)),
            lambda: lidar.scan(room(), np.eye(4), seed=-1),
            lambda: lidar.scan(room(), np.eye(4), index=2**40),
            lambda: lidar.scan(room(), np.eye(4), reflectivity=2.0),
            lambda: lidar.scan(room(), np.eye(4), sun_klx=-1.0),
        ):
            with self.assertRaises((ValueError, TypeError)):
                wrong()


if __name__ == "__main__":
    unittest.main()

"""What runs have written."""

import importlib.util
import os
import shutil
import unittest

import numpy as np

import pointflight as pf
from support import path_of, room


def recorded(name: str) -> str:
    """Two vehicles for a second, one with a VLP-16 and a barometer."""
    room()
    folder = path_of(name)
    if os.path.exists(folder):
        return folder
    sim = pf.Simulation(
        {
            "map": path_of("room.pfmap"),
            "duration": 1.0,
            "unfinished": "time_up",
            "output": {"odometry": True},
            "vehicles": [
                {"name": "a", "start": [0, 0, 1.5], "lidars": [{"model": "vlp16"}, {"model": "avia"}],
                 "sensors": [{"kind": "barometer"}], "mission": {"waypoints": [[1, 0, 1.5]]}},
                {"name": "b", "start": [-1, 1, 1.5], "lidars": []},
            ],
        }
    )  # fmt: skip
    with sim.record(folder):
        for _ in sim.samples(pf.CollisionEvent):
            pass
    return folder


class RunsTest(unittest.TestCase):
    def test_tables(self) -> None:
        run = pf.Run(recorded("runs"))
        self.assertEqual(list(run.flights), ["a", "b"])
        self.assertEqual(run.summary["end"], "time up")
        flight = run.flight("a")
        self.assertEqual(len(flight.trajectory), 201)
        self.assertEqual(flight.poses.shape, (201, 4, 4))
        np.testing.assert_array_equal(flight.poses[:, :3, 3], pf.columns(flight.trajectory, "px", "py", "pz"))
        turned = flight.poses[:, :3, :3] @ np.swapaxes(flight.poses[:, :3, :3], 1, 2)
        np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), (201, 3, 3)), atol=1e-12)
        self.assertAlmostEqual(flight.imu["accel_z"].mean(), 9.81, delta=0.3)
        self.assertEqual(len(flight.odometry), 201)
        self.assertIn("pressure", flight.table("barometer").dtype.names)
        self.assertEqual(run.events["event"].dtype.kind, "U" if len(run.events) else "f")
        with self.assertRaisesRegex(pf.InputError, "obstacles.csv"):
            run.obstacles
        with self.assertRaises(KeyError):
            run.flight("c")
        with self.assertRaises(IndexError):
            run.flight(2)

    @unittest.skipUnless(importlib.util.find_spec("pandas"), "pandas is not installed")
    def test_pandas_takes_tables(self) -> None:
        import pandas

        frame = pandas.DataFrame(pf.Run(recorded("runs")).flight(0).trajectory)
        self.assertEqual(frame["pz"].iloc[0], 1.5)

    def test_scans(self) -> None:
        scans = pf.Run(recorded("runs")).flight(0).scans
        self.assertEqual({scan.lidar for scan in scans}, {0, 1})
        scan = scans[0]
        self.assertEqual(scan.points.beams, scan.beams)
        self.assertEqual(len(scan.points), scans.table["points"][0])
        self.assertEqual(scan.points.xyz.shape, (len(scan.points), 3))
        world = scan.points.xyz @ scan.pose[:3, :3].T + scan.pose[:3, 3]
        self.assertGreater(((world > [-3.2, -2.2, -0.2]) & (world < [3.2, 2.2, 3.2])).all(1).mean(), 0.98)
        self.assertEqual(len(scans[2:5]), 3)
        self.assertEqual(scans[-1].index, scans.table["scan"][-1])
        with self.assertRaises(IndexError):
            scans[len(scans)]

    def test_data_set(self) -> None:
        data = pf.DataSet(recorded("runs"), "a", lidar=0)
        self.assertEqual(len(data), 10)
        self.assertEqual(data.gt_poses.shape, (10, 4, 4))
        self.assertEqual(data.sequence_id, "runs")
        for points, times in data:
            self.assertEqual((points.dtype, points.shape[1]), (np.float64, 3))
            self.assertTrue(0 <= times.min() and times.max() <= 1)
        np.testing.assert_array_equal(data.apply_calibration(data.gt_poses), data.gt_poses)
        self.assertEqual(len(pf.DataSet(recorded("runs"), "b")), 0)

    def test_damaged_runs_are_said_in_a_line(self) -> None:
        folder = path_of("damaged")
        shutil.copytree(recorded("runs"), folder, symlinks=True)
        table = os.path.join(folder, "a", "trajectory.csv")
        with open(table, "a", encoding="utf-8") as file:
            file.write("1,2\n")
        with self.assertRaisesRegex(pf.InputError, "trajectory.csv:203: 2 cells"):
            pf.Run(folder).flight("a").trajectory
        scan = os.path.join(folder, "a", "scans", "0_000000.pcd")
        with open(scan, "r+b") as file:
            file.truncate(1000)
        with self.assertRaisesRegex(pf.InputError, "bytes of points"):
            pf.Run(folder).flight("a").scans[0]
        with open(scan, "wb") as file:
            file.write(b"FIELDS x\nSIZE 3\nTYPE Q\nPOINTS many\nDATA binary\n")
        with self.assertRaises(pf.InputError):
            pf.read_pcd(scan)
        os.remove(os.path.join(folder, "summary.json"))
        with self.assertRaisesRegex(pf.InputError, "no complete run"):
            pf.Run(folder)


if __name__ == "__main__":
    unittest.main()

"""The scripts of examples/python run; those whose libraries are missing are skipped."""

import glob
import importlib.util
import os
import subprocess
import sys
import unittest

import pointflight as pf
from support import path_of, run

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "python")


class ExamplesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        size = ("--size-x", "40", "--size-y", "40")
        run("map", "forest", *size, "--trees", "200", "--density", "300", "-o", path_of("ex.pcd"))
        pf.Map.import_clouds(path_of("ex.pcd"), path_of("ex.pfmap"), resolution=0.12)

    def example(self, name: str, *arguments: str) -> str:
        program = [sys.executable, "-B", os.path.join(FOLDER, name), *arguments]
        done = subprocess.run(program, cwd=os.path.dirname(path_of("x")), capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr[-2000:])
        return done.stdout

    def test_all_are_short(self) -> None:
        scripts = glob.glob(os.path.join(FOLDER, "*.py"))
        self.assertGreaterEqual(len(scripts), 6)
        for script in scripts:
            with open(script, encoding="utf-8") as file:
                self.assertLessEqual(len(file.readlines()), 60, script)

    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib is not installed")
    def test_first_scan(self) -> None:
        self.assertIn("scan.png", self.example("first_scan.py", path_of("ex.pfmap"), "mid360", path_of("scan.png")))
        self.assertGreater(os.path.getsize(path_of("scan.png")), 10_000)

    def test_own_map(self) -> None:
        self.assertIn("a way of", self.example("own_map.py", path_of("ex.pcd"), path_of("own.pfmap")))

    def test_planner(self) -> None:
        self.assertIn("from its goal", self.example("planner_loop.py", path_of("ex.pfmap"), path_of("planned")))
        self.assertGreater(len(pf.Run(path_of("planned")).flight("scout").scans), 20)

    def test_sensor_study(self) -> None:
        self.assertIn("vlp16", self.example("sensor_study.py", path_of("ex.pfmap"), "vlp16"))

    def test_data_set(self) -> None:
        self.assertIn("scans,", self.example("export_dataset.py", path_of("ex.pfmap"), path_of("kitti"), "vlp16"))
        scans = glob.glob(path_of("kitti/velodyne/*.bin"))
        with open(path_of("kitti/poses.txt"), encoding="utf-8") as poses:
            self.assertEqual(len(poses.readlines()), len(scans))

    @unittest.skipUnless(importlib.util.find_spec("torch"), "torch is not installed")
    def test_training_and_flying(self) -> None:
        output = path_of("learned.npz")
        told = self.example("train.py", path_of("ex.pfmap"), "-o", output, "--seconds", "4")
        self.assertIn("of 100 arrive", told)
        self.assertIn("of 1 arrive", self.example("fly_policy.py", output, path_of("ex.pfmap")))
        done = run("fly", path_of("ex.pfmap"), "--policy", output, "--duration", "5", "--no-scans", "--no-picture",
                   "-o", path_of("flown"), "--force")  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()

"""Maps: what is opened, made and refused."""

import json
import os
import signal
import sys
import threading
import unittest

import numpy as np

import pointflight as pf
from support import path_of, room, room_points, run


class MapTest(unittest.TestCase):
    def test_header_says_what_the_program_says(self) -> None:
        info = room().info()
        self.assertEqual(info.resolution, 0.1)
        self.assertEqual(info.surfels, len(room()))
        self.assertTrue(info.has_intensity)
        np.testing.assert_allclose(info.bounds, [[-3, -2, 0], [3, 2, 3]], atol=0.03)
        self.assertEqual(info.file_size, os.path.getsize(path_of("room.pfmap")))
        said = json.loads(run("map", "info", path_of("room.pfmap"), "--json").stdout)
        self.assertEqual((said["surfels"], said["bytes"]), (info.surfels, info.file_size))
        np.testing.assert_array_equal([said["min"], said["max"]], info.bounds)
        self.assertEqual(said["made"], info.metadata)
        self.assertRegex(info.hash, "^[0-9a-f]{16}$")
        room().verify()

    def test_map_in_memory_is_the_same(self) -> None:
        made = pf.Map.from_points(room_points(), resolution=0.1)
        self.assertEqual(made.info().hash, room().info().hash)

    def test_resolution_is_found(self) -> None:
        made = pf.Map.from_points(room_points())
        self.assertTrue(0.02 < made.resolution < 0.5, made.resolution)

    def test_nearest_is_the_distance_to_a_wall(self) -> None:
        distance, center = room().nearest([[0, 0, 1.0], [2.5, 0, 1.5], [0, 0, 100], [np.nan, 0, 0]])
        np.testing.assert_allclose(distance[:2], [1.0, 0.5], atol=0.01)
        np.testing.assert_allclose(center[1], [3.0, 0, 1.5], atol=0.1)
        self.assertTrue(np.isinf(distance[2:]).all() and np.isnan(center[2:]).all())
        self.assertEqual(room().nearest([0, 0, 1.0])[0].shape, (1,))
        self.assertTrue(np.isinf(room().nearest([0, 0, 1.0], reach=0.5)[0]).all())

    def test_surfels_lie_on_the_walls(self) -> None:
        surfels = room().surfels()
        self.assertEqual(len(surfels), len(room()))
        np.testing.assert_allclose(np.linalg.norm(surfels["normal"], axis=1), 1, atol=1e-2)
        on_floor = surfels[np.abs(surfels["center"][:, 2]) < 0.01]
        inner = on_floor[np.abs(on_floor["center"][:, :2]).max(1) < 1.5]
        self.assertGreater(len(inner), 100)
        np.testing.assert_allclose(np.abs(inner["normal"][:, 2]), 1, atol=1e-2)
        self.assertEqual(surfels["assumed"].max(), 0)

    def test_words_are_a_view_that_keeps_the_map(self) -> None:
        made = pf.Map.from_points(room_points(), resolution=0.1)
        words = made.words
        total = int(words.sum(dtype=np.uint64))
        before = sys.getrefcount(made._handle)
        more = made.words
        self.assertEqual(sys.getrefcount(made._handle), before + 1)
        self.assertEqual(words.ctypes.data, more.ctypes.data)
        with self.assertRaises(ValueError):
            words[0] = 0
        del made, more
        self.assertEqual(int(words.sum(dtype=np.uint64)), total)

    def test_errors_are_one_line(self) -> None:
        for wrong in (path_of("none.pfmap"), __file__):
            with self.assertRaises(pf.InputError) as raised:
                pf.Map.open(wrong)
            self.assertIn(os.path.basename(wrong), str(raised.exception))
            self.assertNotIn("\n", str(raised.exception))
        with self.assertRaises(pf.InputError):
            pf.Map.import_clouds(path_of("none.pcd"))
        with self.assertRaisesRegex(ValueError, r"points: shape \(n, 3\)"):
            pf.Map.from_points(np.zeros((5, 2)))
        with self.assertRaises(ValueError):
            pf.Map.import_clouds([])
        with self.assertRaises(ValueError):
            room().nearest([0, 0, 0], reach=-1.0)

    def test_files_are_replaced_only_if_asked(self) -> None:
        path = path_of("twice.pfmap")
        pf.Map.from_points(room_points(), path, resolution=0.2)
        with self.assertRaises(FileExistsError):
            pf.Map.from_points(room_points(), path, resolution=0.1)
        self.assertEqual(pf.Map.open(path).resolution, 0.2)
        pf.Map.from_points(room_points(), path, resolution=0.1, force=True)
        self.assertEqual(pf.Map.open(path).resolution, 0.1)
        with self.assertRaisesRegex(ValueError, "pfmap"):
            pf.Map.from_points(room_points(), path_of("cloud.pcd"), force=True)

    def test_interrupt_ends_the_import(self) -> None:
        path = path_of("interrupted.pfmap")
        timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            for _ in range(100):  # however fast the machine is
                pf.Map.from_points(room_points(), path, force=True)
                os.remove(path)
        timer.join()
        self.assertFalse(os.path.exists(path + ".partial"))

    def test_exception_of_a_callback_ends_the_import_and_comes_out(self) -> None:
        said = []

        def stop(what: str, share: float) -> None:
            said.append((what, share))
            raise KeyError("enough")

        path = path_of("stopped.pfmap")
        with self.assertRaisesRegex(KeyError, "enough"):
            pf.Map.from_points(room_points(), path, resolution=0.1, progress=stop)
        self.assertEqual(len(said), 1)
        self.assertFalse(os.path.exists(path))
        self.assertFalse(os.path.exists(path + ".partial"))

    def test_other_threads_run_meanwhile(self) -> None:
        count = 0
        done = threading.Event()

        def work() -> None:
            pf.Map.from_points(room_points())
            done.set()

        thread = threading.Thread(target=work)
        thread.start()
        while not done.wait(0.001):
            count += 1
        thread.join()
        self.assertGreater(count, 3)


if __name__ == "__main__":
    unittest.main()

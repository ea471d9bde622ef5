"""Whatever is given to the module, it answers by an exception: nothing brings the interpreter down."""

import gc
import threading
import unittest
import warnings
from typing import Any, Callable, List

import numpy as np

import pointflight as pf
from pointflight import _pointflight
from pointflight.gym import Goal, Lidar, Observer, VectorEnv, features
from support import room

EXPECTED = (ValueError, TypeError, RuntimeError, KeyError, IndexError, AttributeError, OverflowError, MemoryError, OSError)


def junk(random: np.random.Generator) -> Any:
    """Something that somebody might give."""
    shape = tuple(random.integers(0, 5, random.integers(0, 4)))
    array = random.normal(0.0, 10.0 ** random.integers(-3, 4), shape)
    kinds: List[Callable[[], Any]] = [
        lambda: None, lambda: True, lambda: int(random.integers(-3, 300)), lambda: -1, lambda: 2**63, lambda: -(2**70),
        lambda: float(random.normal()), lambda: float("nan"), lambda: float("inf"), lambda: 1e308, lambda: 1j,
        lambda: "", lambda: "x\0y", lambda: b"bytes", lambda: {}, lambda: {"map": 5}, lambda: [], lambda: [[1, 2], [3]],
        lambda: object(), lambda: room(), lambda: pf.Velocity((1, 0, 0)),
        lambda: array, lambda: array.astype(np.float32), lambda: array.astype(np.int8), lambda: array.astype(complex),
        lambda: array.astype(object), lambda: array > 0, lambda: np.full(shape, np.nan), lambda: np.full(shape, 1e300),
        lambda: random.normal(size=(7, 3)), lambda: random.normal(size=(7, 6))[:, ::2], lambda: random.normal(size=(3, 7)).T,
        lambda: random.normal(size=(7, 3))[::-1], lambda: np.broadcast_to(np.ones(3), (9, 3)), lambda: np.zeros((0, 3)),
        lambda: np.eye(4), lambda: np.stack([np.eye(4)] * 3), lambda: pf.pose(0.5, 0.2, 1.5), lambda: pf.grid(3, 5),
        lambda: np.arange(5, dtype=np.uint32), lambda: np.zeros(4, np.bool_), lambda: np.datetime64("now"),
        lambda: iter([1]), lambda: (i for i in range(3)), lambda: lambda *a: None,
    ]  # fmt: skip
    return kinds[random.integers(len(kinds))]()


def targets() -> List[Callable[..., Any]]:
    """What is called, each with what it needs to be alive."""
    sim = pf.Simulation({"map": "-", "vehicle": {"start": [0, 0, 1.5]}, "lidars": [], "duration": 5.0}, room())
    env = VectorEnv(
        room(), 4, task=Goal(distance=(1.5, 4.0), height=(0.8, 2.0), clearance=0.6), lidar=Lidar(2, 4), autoreset="disabled"
    )
    env.reset(seed=0)
    flights = env._flights[0]
    lidar, observer = pf.Lidar("vlp16"), Observer([1, 0, 1], Lidar(2, 4))
    status = sim.status()
    commands = [
        pf.RotorSpeeds, pf.BodyRates, pf.Attitude, pf.Acceleration, pf.Velocity, pf.Position, pf.Waypoints, pf.TakeOff,
        pf.Land, pf.Hover, pf.Arm, pf.Disarm, pf.Trajectory.b_spline, pf.Trajectory.polynomials, pf.Trajectory._spline,
    ]  # fmt: skip
    return [
        *commands,
        lambda *a: pf.raycast(room(), *a), pf.raycast, lambda *a: pf.ranges(room(), *a), pf.ranges, pf.pose,
        lambda *a: room().nearest(*a), lambda *a: pf.compare(room(), *a), lambda *a: lidar.scan(room(), *a[:1]), lidar.scan,
        lambda *a: sim.command(*a), lambda *a: sim.command(0, *a[:1]), sim.restore, sim.advance_to, sim.status, sim.run,
        pf.Scenario, pf.Vehicle, pf.Lidar, pf.Map.open, pf.Scene, pf.Simulation, pf.Run, pf.read_pcd, pf.read_table,
        env.step, lambda a, *b: env.reset(seed=a), lambda a, *b: env.reset(options=a), flights.place, flights.step,
        flights.measure, flights.set_rotor, flights.clearance_of_obstacles, lambda *a: observer.of_points(status, *a),
        observer.of_map, features, lambda *a: pf.add_sensor(*a), lambda *a: pf.add_controller(*a),
        _pointflight._compare, _pointflight._raycast, _pointflight._ranges, _pointflight._Flights,
        _pointflight._Simulation, _pointflight._Scenario.parse, _pointflight._Scene,
    ]  # fmt: skip


class MisuseTest(unittest.TestCase):
    def test_random_calls(self) -> None:
        random = np.random.default_rng(8)
        calls, refused = targets(), 0
        for _ in range(4000):
            call = calls[random.integers(len(calls))]
            given = [junk(random) for _ in range(random.integers(1, 5))]
            try:
                with np.errstate(all="ignore"), warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    call(*given)
            except EXPECTED:
                refused += 1
        self.assertGreater(refused, 1500)

    def test_views_outlive_their_owners(self) -> None:
        place = pf.Map.from_points(np.random.default_rng(0).uniform(-2, 2, (4000, 3)), resolution=0.2)
        words, surfels = place.words, place.surfels()
        total = int(words.sum(dtype=np.uint64))
        scan = pf.Lidar("vlp16").scan(room(), pf.pose(0, 0, 1.5))
        xyz, first = scan.xyz, scan.xyz.copy()
        del place, scan
        gc.collect()
        junk_memory = [np.random.default_rng(i).normal(size=100_000) for i in range(20)]
        self.assertEqual(int(words.sum(dtype=np.uint64)), total)
        np.testing.assert_array_equal(xyz, first)
        self.assertEqual(len(junk_memory), 20)
        self.assertTrue(np.isfinite(surfels["center"]).all())

    def test_threads(self) -> None:
        sim = pf.Simulation({"map": "-", "vehicle": {"start": [0, 0, 1.5]}, "duration": 20.0}, room())
        refused, done, failed = [0], threading.Event(), []

        def disturb() -> None:
            random = np.random.default_rng(threading.get_ident() % 1000)
            while not done.is_set():
                try:
                    choice = random.integers(4)
                    if choice == 0:
                        sim.status()
                    elif choice == 1:
                        sim.command(0, pf.Velocity((0.1, 0, 0)))
                    elif choice == 2:
                        sim.restore(sim.state())
                    else:
                        pf.raycast(room(), random.normal(0, 0.2, (50, 3)) + [0, 0, 1.5], random.normal(size=(50, 3)))
                except RuntimeError:
                    refused[0] += 1
                except Exception as error:  # noqa: BLE001
                    failed.append(error)

        threads = [threading.Thread(target=disturb) for _ in range(3)]
        for thread in threads:
            thread.start()
        for _ in range(200):
            try:
                sim.advance_to(sim.time + 0.02, pf.ScanSample)
            except (RuntimeError, ValueError):
                refused[0] += 1
        done.set()
        for thread in threads:
            thread.join()
        self.assertEqual(failed, [])


if __name__ == "__main__":
    unittest.main()

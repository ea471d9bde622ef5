"""Links in Python, pickled states, exact scenes and comparisons."""

import json
import pickle
import subprocess
import sys
import unittest

import numpy as np

import pointflight as pf
from support import path_of, room, run

KEYS = {
    "map": "-",
    "duration": 0.6,
    "unfinished": "time_up",
    "vehicle": {"name": "scout", "start": [0, 0, 1.5]},
    "lidars": [{"model": "mid360"}],
}


class Turning(pf.Link):
    """Turns faster with each scan."""

    kinds = (pf.ScanSample,)
    answers = (pf.ScanSample,)

    def __init__(self) -> None:
        self.log, self.scans, self.orders = [], [], []

    def open(self) -> None:
        self.log.append("open")

    def close(self) -> None:
        self.log.append("close")

    def on_sample(self, sample) -> None:
        self.scans.append(sample)
        self.orders.append(("scout", pf.Velocity((0.1, 0, 0), yaw_rate=0.2 * len(self.scans), in_body=True)))

    def take_orders(self, time):
        given, self.orders = self.orders, []
        return given


class LinkTest(unittest.TestCase):
    def test_a_link_flies_a_run(self) -> None:
        link, sim = Turning(), pf.Simulation(KEYS, room())
        self.assertEqual(sim.run(link), "completed")
        self.assertEqual(link.log, ["open", "close"])
        self.assertEqual(len(link.scans), 6)
        self.assertGreater(abs(sim.status().angular_velocity[2]), 0.5)
        by_hand, turning = pf.Simulation(KEYS, room()), Turning()
        for sample in by_hand.samples(pf.ScanSample):
            turning.on_sample(sample)
            by_hand.command(*turning.take_orders(0.0)[0])
        self.assertEqual(sim.summary, by_hand.summary)
        np.testing.assert_array_equal(sim.status().orientation, by_hand.status().orientation)
        in_step = pf.Simulation(KEYS, room())
        in_step.run(Turning(), lockstep=5.0)
        np.testing.assert_array_equal(sim.status().orientation, in_step.status().orientation)

    def test_exceptions_come_out_as_they_were(self) -> None:
        class Failing(Turning):
            def on_sample(self, sample) -> None:
                raise KeyError("mine")

        sim = pf.Simulation(KEYS, room())
        start = sim.state()
        with self.assertRaisesRegex(KeyError, "mine"):
            sim.run(Failing())
        with self.assertRaisesRegex(RuntimeError, "restore"):
            sim.step()
        sim.restore(start)
        self.assertEqual(sim.run(Turning()), "completed")
        for wrong in (lambda: sim.run(object()), lambda: pf.Simulation(KEYS, room()).run(Turning(), rate=-1.0)):
            with self.assertRaises((TypeError, ValueError)):
                wrong()

        class Nonsense(Turning):
            def take_orders(self, time):
                return [("scout", "fly")]

        with self.assertRaises((TypeError, RuntimeError, ValueError)):
            pf.Simulation(KEYS, room()).run(Nonsense())

    def test_a_run_with_links_is_recorded(self) -> None:
        sim = pf.Simulation(KEYS, room())
        with sim.record(path_of("linked"), replace=True):
            sim.run(Turning())
        flight = pf.Run(path_of("linked")).flight("scout")
        self.assertEqual(len(flight.scans), 6)

    def test_calls_within_a_link_are_refused(self) -> None:
        class Curious(Turning):
            def on_sample(self, sample) -> None:
                sim.status()

        sim = pf.Simulation(KEYS, room())
        with self.assertRaisesRegex(RuntimeError, "in use"):
            sim.run(Curious())


class PickleTest(unittest.TestCase):
    def test_commands(self) -> None:
        spline = pf.Trajectory.b_spline(np.random.default_rng(0).normal(size=(6, 4)), 0.4, 3)
        pieces = pf.Trajectory.polynomials([1.0, 2.0], np.random.default_rng(1).normal(size=(2, 4, 3)))
        for command in (spline, pieces):
            again = pickle.loads(pickle.dumps(command))
            self.assertEqual(again.duration, command.duration)
        for command in (
            pf.RotorSpeeds([1, 2, 3, 4]), pf.BodyRates((1, 2, 3), 4), pf.Attitude((0, 0, 0, 1), 5, (1, 2, 3)),
            pf.Acceleration((1, 2, 3), 0.5, 0.25), pf.Velocity((1, 2, 3)), pf.Velocity((1, 2, 3), 0.5, 0.2, True),
            pf.Position((1, 2, 3), (4, 5, 6), (7, 8, 9), 0.5, 0.25), pf.Waypoints([[1, 2, 3]], 0.7), pf.TakeOff(2, 0.5),
            pf.Land(0.3), pf.Hover(), pf.Arm(), pf.Disarm(),
        ):  # fmt: skip
            again = pickle.loads(pickle.dumps(command))
            self.assertIs(type(again), type(command))
            for name in dir(command):
                if not name.startswith("_"):
                    np.testing.assert_array_equal(getattr(again, name), getattr(command, name), name)

    def test_states_and_simulations(self) -> None:
        room()
        sim = pf.Simulation({**KEYS, "map": path_of("room.pfmap")})
        sim.advance_to(0.1)
        sim.command("scout", pf.Velocity((0.5, 0.2, 0.0), yaw_rate=0.4))
        sim.advance_to(0.25)
        spline = np.tile([0, 0, 1.5, 0.0], (8, 1)) + np.linspace(0, 0.6, 8)[:, None]
        sim.command("scout", pf.Trajectory.b_spline(spline, 0.2))
        sim.advance_to(0.3)
        kept = pickle.dumps((sim, sim.state()))
        fork = sim.fork()
        expected = [sample.imu if hasattr(sample, "imu") else sample for sample in sim.advance_to(0.6)]
        again, state = pickle.loads(kept)
        self.assertEqual((again.time_ns, round(state.time, 9)), (300_000_000, 0.3))
        self.assertEqual(len(again.advance_to(0.6)), len(expected))
        self.assertEqual(again.summary, sim.summary)
        np.testing.assert_array_equal(again.status().position, sim.status().position)
        again.restore(state)
        self.assertEqual(again.time_ns, 300_000_000)
        np.testing.assert_array_equal(again.status().velocity, fork.status().velocity)
        again.interrupt()
        self.assertFalse(pickle.loads(pickle.dumps(again)).is_running)
        other = pf.Simulation({**KEYS, "map": path_of("room.pfmap"), "seed": 7})
        with self.assertRaisesRegex(ValueError, "another scenario"):
            other.restore(state)

    def test_in_another_process(self) -> None:
        room()
        sim = pf.Simulation({**KEYS, "map": path_of("room.pfmap"), "lidars": []})
        sim.advance_to(0.1)
        sim.command(0, pf.Velocity((0.5, 0.2, 0.0)))
        sim.advance_to(0.4)
        with open(path_of("sim.pickle"), "wb") as file:
            pickle.dump(sim, file)
        program = "import pickle, sys; s = pickle.load(open(sys.argv[1], 'rb')); print(s.status().position.tobytes().hex())"
        told = subprocess.run([sys.executable, "-B", "-c", program, path_of("sim.pickle")], capture_output=True, text=True)
        self.assertEqual(told.stdout.strip(), sim.status().position.tobytes().hex(), told.stderr)

    def test_what_cannot_be_pickled(self) -> None:
        with self.assertRaisesRegex(pickle.PicklingError, "maps in files"):
            pickle.dumps(pf.Map.from_points(np.random.default_rng(0).uniform(0, 1, (500, 3)), resolution=0.1))


class FidelityTest(unittest.TestCase):
    def test_scenes_are_exact(self) -> None:
        self.assertIn("yard", pf.Scene.names())
        scene = pf.Scene("partition_5cm")
        points = scene.points(0.2)
        origin = points.mean(0) + [0.3, 0.2, 0.1]
        some = points[:: len(points) // 200]
        ranges, tags = scene.raycast(origin, some - origin, range_max=200.0)
        distances = np.linalg.norm(some - origin, axis=1)
        self.assertTrue((ranges < distances + 1e-3).all())
        self.assertGreater((np.abs(ranges - distances) < 1e-3).mean(), 0.2)
        self.assertTrue(((tags >= 0) & (tags < len(scene.tags))).all())
        up, none = scene.raycast(points.max(0) + 1.0, (0, 0, 1))
        self.assertEqual((up[0], none[0]), (np.inf, -1))
        with self.assertRaisesRegex(pf.InputError, "yard"):
            pf.Scene("nowhere")

    def test_fidelity_is_the_program_s(self) -> None:
        name = "box"
        told = pf.fidelity(pf.Scene(name), resolution=0.1, poses=2)
        shares = sum(told["all"][key] for key in ("right", "early", "late", "missing", "false"))
        self.assertAlmostEqual(shares, 1.0)
        self.assertGreater(told["all"]["right"], 0.8)
        result = run("fidelity", name, "--resolution", "0.1", "--poses", "2", "--json")
        program = json.loads(result.stdout)
        program = program["cases"][0] if isinstance(program, dict) else program[0]
        self.assertEqual(told["all"]["rays"], program["all"]["rays"])
        self.assertAlmostEqual(told["all"]["early"], program["all"]["early_fraction"], delta=0.02)

    def test_compare(self) -> None:
        walls = np.array([[3.0, 0.1 * k, 1.5] for k in range(-10, 11)])
        made = pf.compare(room(), walls, (0, 0, 1.5))
        np.testing.assert_allclose(made.rendered, made.range, atol=0.02)
        self.assertEqual(made.statistics["right"], 1.0)
        self.assertTrue(made.supported.all())
        nearer = pf.compare(room(), 0.8 * (walls - [0, 0, 1.5]) + [0, 0, 1.5], np.tile([0, 0, 1.5], (21, 1)), cloud=walls[:5])
        self.assertEqual(nearer.supported.sum(), 0)
        some = pf.compare(room(), walls, (0, 0, 1.5), cloud=walls[:5])
        self.assertGreaterEqual(some.supported.sum(), 5)
        self.assertEqual(some.statistics["rays"], some.supported.sum())
        for wrong in (
            lambda: pf.compare(room(), walls, walls[:3]),
            lambda: pf.compare(room(), [[0, 0, 1.5]], (0, 0, 1.5)),
            lambda: pf.compare(room(), [[np.nan, 0, 1.5]], (0, 0, 1.5)),
        ):
            with self.assertRaises(ValueError):
                wrong()


if __name__ == "__main__":
    unittest.main()

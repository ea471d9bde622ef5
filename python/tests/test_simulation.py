"""Flights: the files of the program, states, forks, commands, samples, misuse."""

import gc
import itertools
import os
import signal
import threading
import time
import unittest

import numpy as np

import pointflight as pf
from support import path_of, room, run


def scenario(**changes: object) -> pf.Scenario:
    """A vehicle with a Mid-360 in the room, for three seconds."""
    room()
    keys = {
        "map": path_of("room.pfmap"),
        "duration": 3.0,
        "unfinished": "time_up",
        "vehicle": {"name": "scout", "start": [0, 0, 1.5]},
        "lidars": [{"model": "mid360", "snapshot": True}],
    }
    return pf.Scenario({**keys, **changes})


class Firmware(unittest.TestCase):
    def test_a_simulation_of_a_program_has_no_firmware(self) -> None:
        wish = scenario(vehicle={"name": "scout", "start": [0, 0, 1.5], "autopilot": "px4"})
        with self.assertRaisesRegex(pf.InputError, "only `pointflight fly`"):
            pf.Simulation(wish)


def samples_of(sim: pf.Simulation) -> list:
    """Some figures of all samples to the end, to be compared exactly."""
    figures = []
    for sample in sim.samples():
        figures.append((type(sample).__name__, sample.time_ns))
        if isinstance(sample, pf.StateSample):
            figures.append(tuple(sample.position) + tuple(sample.orientation) + tuple(sample.rotor_speeds))
        elif isinstance(sample, pf.ImuSample):
            figures.append(tuple(sample.gyro) + tuple(sample.accel))
        elif isinstance(sample, pf.ScanSample):
            figures.append(sample.scan.tobytes())
    return figures


class SimulationTest(unittest.TestCase):
    def test_recorded_run_has_the_bytes_of_the_program(self) -> None:
        with open(path_of("flight.yaml"), "w", encoding="utf-8") as file:
            file.write(scenario(mission={"waypoints": [[1, 1, 1.5]]}, duration=0, unfinished="failure").text)
        done = run("fly", path_of("flight.yaml"), "-o", path_of("by_program"))
        self.assertEqual(done.returncode, 0, done.stderr)
        sim = pf.Simulation(path_of("flight.yaml"))
        with sim.record(path_of("by_python")):
            scans = [sample for sample in sim.samples(pf.ScanSample)]
        self.assertEqual(sim.end, "completed")
        self.assertGreater(len(scans), 10)
        files = [os.path.join(path_of("by_python"), "scans", name) for name in os.listdir(path_of("by_python/scans"))]
        files += [path_of("by_python/" + name) for name in ("trajectory.csv", "imu.csv", "events.csv", "summary.json")]
        for written in files:
            with open(written, "rb") as ours, open(written.replace("by_python", "by_program"), "rb") as theirs:
                self.assertEqual(ours.read(), theirs.read(), written)
        with open(path_of("by_python/files.txt"), "rb") as file:
            self.assertIn(b"summary.json", file.read())

    def test_rays_hit_what_moves(self) -> None:
        balls = {"count": 4, "radius": 0.2, "speed": 0.5, "speed_max": 1.0}
        sim = pf.Simulation(scenario(obstacles=[balls]))
        sim.advance_to(0.7)
        # another run of the same scenario says where they are when that time comes
        later = next(s for s in pf.Simulation(scenario(obstacles=[balls])).samples(pf.ObstacleSample) if s.time >= 0.7)
        self.assertAlmostEqual(later.time, sim.time)
        away = np.array([[0.0, 0.0, 2.9]])
        ways = later.poses[:, :3, 3] - away
        hits = sim.raycast(away, ways)
        seen = hits.label == later.labels
        self.assertGreater(seen.sum(), 0)
        np.testing.assert_allclose(hits.range[seen], np.linalg.norm(ways, axis=1)[seen] - 0.2, atol=1e-3)
        self.assertTrue((hits.surfel[hits.label > 0] == 2**32 - 1).all())
        vehicle = sim.raycast([0, 0, 2.9], [0, 0, -1])
        self.assertEqual(vehicle.label[0], 1)
        self.assertTrue(0.0 < 1.4 - vehicle.range[0] < 0.3)
        self.assertEqual(pf.raycast(room(), [0, 0, 2.9], [0, 0, -1]).label[0], 0)

    def test_recording_leaves_nothing_after_an_exception(self) -> None:
        sim = pf.Simulation(scenario())
        with self.assertRaises(ZeroDivisionError):
            with sim.record(path_of("broken")):
                sim.step()
                1 / 0
        self.assertFalse(os.path.exists(path_of("broken/summary.json")))
        with pf.Simulation(scenario()).record(path_of("broken")):
            pass
        self.assertTrue(os.path.exists(path_of("broken/summary.json")))
        with self.assertRaisesRegex(pf.InputError, "broken"):
            pf.Simulation(scenario()).record(path_of("broken"))

    def test_state_restore_and_fork_give_the_same_bytes(self) -> None:
        sim = pf.Simulation(scenario(seed=5))
        sim.command("scout", pf.Waypoints([(1, 0.5, 1.2)]))
        sim.advance_to(1.0)
        state, other = sim.state(), sim.fork()
        self.assertEqual(state.time, sim.time)
        first = samples_of(sim)
        self.assertGreater(len(first), 1000)
        self.assertEqual(samples_of(other), first)
        sim.restore(state)
        self.assertTrue(sim.is_running)
        self.assertEqual(samples_of(sim), first)
        other.restore(state)
        self.assertEqual(samples_of(other), first)
        with self.assertRaisesRegex(ValueError, "another simulation"):
            pf.Simulation(scenario(seed=5)).restore(state)

    def test_steps_and_advances_are_the_same(self) -> None:
        one, two = pf.Simulation(scenario()), pf.Simulation(scenario(), room())
        stepped = [s.time_ns for _ in range(500) for s in one.step()]
        self.assertEqual(stepped, [s.time_ns for s in two.advance_to(0.5)])
        self.assertEqual((one.time_ns, one.time), (500_000_000, 0.5))
        self.assertEqual(two.advance_to(0.2), [])  # it is past
        self.assertTrue(all(type(s) is pf.ImuSample for s in two.advance_to(1.0, pf.ImuSample)))
        kinds = {type(s) for s in two.advance_to(2.0, pf.ImuSample, pf.ScanSample)}
        self.assertEqual(kinds, {pf.ImuSample, pf.ScanSample})
        self.assertEqual(list(two.samples(until=1.0)), [])

    def test_commands(self) -> None:
        sim = pf.Simulation(scenario())
        for _ in range(100):
            sim.command(0, pf.Velocity((0.5, 0, 0), yaw_rate=0.2))
            sim.advance_to(sim.time + 0.02)
        status = sim.status("scout")
        self.assertAlmostEqual(status.velocity[0], 0.5, delta=0.05)
        self.assertEqual(status.command, "velocity")
        for command in (
            pf.Position((0, 0, 1.5)), pf.Attitude((0, 0, 0, 1), 10.0), pf.BodyRates((0, 0, 0.1), 10.0),
            pf.Acceleration((0, 0, 0)), pf.RotorSpeeds([500] * 4), pf.Hover(), pf.TakeOff(0.5), pf.Land(),
            pf.Arm(), pf.Waypoints([[0, 0, 1], [0, 0, 2]], speed=0.5),
            pf.Trajectory.b_spline([(0, 0, 1 + 0.1 * i, 0) for i in range(6)], 0.5),
            pf.Trajectory.polynomials([1.0], [[[0, 0.1], [0, 0], [1.5, 0], [0, 0]]]),
        ):  # fmt: skip
            sim.command("scout", command)
            sim.step()
        with self.assertRaisesRegex(pf.CommandRejected, "rotor"):
            sim.command("scout", pf.RotorSpeeds([500] * 3))
        sim.command("scout", pf.Disarm())
        for wrong in (
            lambda: pf.Velocity((1, 2)), lambda: pf.Position("far"), lambda: pf.Attitude((0, 0, 0, 0), 1.0),
            lambda: pf.Waypoints([[1, 2]]), lambda: pf.Trajectory.b_spline([(0, 0, 0, 0)], 0.5),
            lambda: pf.Trajectory.polynomials([1.0, 2.0], [[[0], [0], [0], [0]]]),
            lambda: sim.command("scout", 5), lambda: sim.command("scout", None),
        ):  # fmt: skip
            with self.assertRaises((ValueError, TypeError)):
                wrong()
        with self.assertRaisesRegex(KeyError, "scout"):
            sim.command("drone", pf.Hover())
        with self.assertRaises(IndexError):
            sim.command(1, pf.Hover())

    def test_samples_hold_what_they_say(self) -> None:
        sim = pf.Simulation(
            scenario(
                sensors=[{"kind": "barometer"}],
                output={"odometry_rate": 50},
            )
        )
        self.assertIn("barometer", sim.sensors())
        by_kind = {}
        for sample in sim.samples():
            by_kind.setdefault(type(sample), []).append(sample)
        state = by_kind[pf.StateSample][-1]
        np.testing.assert_array_equal(state.pose[:3, 3], state.position)
        self.assertEqual(state.rotor_speeds.shape, (4,))
        self.assertGreater(state.clearance, 1.0)
        self.assertEqual(state.nearest_label, 0)
        imu = np.array([s.accel for s in by_kind[pf.ImuSample]])
        self.assertAlmostEqual(imu[:, 2].mean(), 9.81, delta=0.2)
        odometry = by_kind[pf.OdometrySample][-1]
        np.testing.assert_array_equal(odometry.position, odometry.true_position)
        self.assertEqual(len(by_kind[pf.OdometrySample]), 151)
        self.assertAlmostEqual(by_kind[pf.Measurement][0].values[0], 101300, delta=1500)
        scan = by_kind[pf.ScanSample][3]
        self.assertEqual(len(scan.scan), len(scan))
        self.assertEqual(scan.scan.beams, scan.beams)
        np.testing.assert_allclose(scan.pose_at(scan.time)[:3, 3], [0, 0, 1.6], atol=0.1)
        with self.assertRaises(ValueError):
            scan.pose_at(0.0)
        self.assertEqual(sim.summary["end"], sim.end)
        self.assertEqual(sim.step(), [])

    def test_samples_outlive_their_simulation(self) -> None:
        sim = pf.Simulation(scenario())
        kept = sim.advance_to(0.3)
        del sim
        gc.collect()
        scan = [s for s in kept if isinstance(s, pf.ScanSample)][0]
        xyz = scan.scan.xyz
        del kept, scan
        gc.collect()
        self.assertGreater(len(xyz), 1000)

    def test_scenario_is_checked_as_a_file(self) -> None:
        s = scenario()
        self.assertEqual(s.vehicles, ("scout",))
        self.assertEqual(pf.Scenario.parse(s.text).text, s.text)
        self.assertEqual(pf.Scenario(s.values).text, s.text)
        other = s.replace({"seed": np.int64(7), "vehicle.start": np.array([0, 0, 2.0]), "lidars[0].model": "vlp16"})
        self.assertEqual((other["seed"], s["seed"]), (7, 1))
        self.assertEqual(other["lidars"][0]["model"], "vlp16")
        for key, value, message in (
            ("sed", 4, "seed"),
            ("vehicle.start", [1, 2], "start"),
            ("lidars[0].model", "mid", "mid360"),
            ("duration", -1, "duration"),
        ):
            with self.assertRaisesRegex(pf.InputError, message):
                pf.Simulation(s.replace({key: value}))
        for key in ("lidars[5].model", "seed.x", "lidars.model", "", "a b"):
            with self.assertRaisesRegex(ValueError, "key"):
                s.replace({key: 1})
        with self.assertRaises(TypeError):
            s.replace({"seed": object()})
        text = s.text + "\nros: {profile: mavros, outputs: [{kind: clock, topic: '/c', rate: 5}]}\n"
        with_ros = pf.Scenario.parse(text).values["ros"]
        self.assertEqual(with_ros["outputs"][0], {"kind": "clock", "topic": "/c", "rate": 5})
        self.assertEqual(with_ros["profile"], "mavros")

    def test_vehicle(self) -> None:
        quad = pf.Vehicle("quad_330")
        self.assertEqual(quad.rotors, 4)
        self.assertGreater(quad.thrust_max, 1.5 * quad.mass * 9.81)
        self.assertEqual(quad.values["mass"], quad.mass)
        with self.assertRaisesRegex(pf.InputError, "quad_330"):
            pf.Vehicle("quad")

    def test_two_threads_run_side_by_side_but_not_one_simulation(self) -> None:
        sims = [pf.Simulation(scenario()) for _ in range(2)]
        threads = [threading.Thread(target=sim.advance_to, args=(1.0,)) for sim in sims]
        for thread in threads:
            thread.start()
        refused = 0
        while any(thread.is_alive() for thread in threads):
            try:
                sims[0].step()
            except RuntimeError as error:
                self.assertIn("another thread", str(error))
                refused += 1
        for thread in threads:
            thread.join()
        self.assertEqual(sims[1].time, 1.0)

    def test_ctrl_c_ends_an_advance(self) -> None:
        sim = pf.Simulation(scenario(duration=900))
        timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            sim.advance_to(900.0, pf.CollisionEvent)
        timer.join()
        self.assertTrue(0 < sim.time < 900)
        sim.step()  # it goes on

    def test_other_threads_run_meanwhile(self) -> None:
        sim = pf.Simulation(scenario())
        count, done = [0], threading.Event()

        def work() -> None:
            while not done.is_set():
                count[0] += 1
                time.sleep(0)

        thread = threading.Thread(target=work)
        thread.start()
        sim.advance_to(2.0, pf.CollisionEvent)
        done.set()
        thread.join()
        self.assertGreater(count[0], 20)

    def test_control_period(self) -> None:
        def flown(period: float) -> np.ndarray:
            keys = {"control_period": period} if period else {}
            sim = pf.Simulation(
                {"map": path_of("room.pfmap"), "lidars": [], "duration": 3.0, "unfinished": "time_up",
                 "vehicle": {"start": [-1, -1, 1.5], **keys}}
            )  # fmt: skip
            sim.command(0, pf.Velocity((0.8, 0.4, 0.1), yaw_rate=0.5))
            positions = []
            while sim.is_running:
                sim.step(pf.CollisionEvent)
                positions.append(sim.status().position)
            return np.array(positions)

        room()
        each, step, coarse = flown(0.0), flown(0.001), flown(0.005)
        np.testing.assert_array_equal(each, step)
        apart = np.abs(coarse - each).max()
        self.assertTrue(1e-6 < apart < 0.05, apart)
        for wrong in (0.0015, 0.0001):
            with self.assertRaisesRegex(pf.InputError, "control_period|whole number of physics steps"):
                flown(wrong)

    def test_misuse(self) -> None:
        sim = pf.Simulation(scenario())
        for wrong in (
            lambda: sim.advance_to(float("nan")),
            lambda: sim.advance_to(-1),
            lambda: sim.step(int),
            lambda: sim.restore(None),
            lambda: sim.restore(5),
            lambda: pf.SimulationState(),
            lambda: pf.Simulation(None),
            lambda: pf.Simulation({}, 5),
        ):
            with self.assertRaises((ValueError, TypeError, AttributeError)):
                wrong()
        with self.assertRaisesRegex(pf.InputError, "map"):
            pf.Simulation({"map": "nowhere.pfmap"})
        for sample in itertools.islice(sim.samples(), 20):
            self.assertIn(type(sample).__name__, repr(sample))


if __name__ == "__main__":
    unittest.main()

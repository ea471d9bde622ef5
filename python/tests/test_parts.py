"""Controllers, sensors and renderers written in Python."""

import unittest

import numpy as np

import pointflight as pf
from support import path_of, room

SEEN = []  # what is registered lives as long as the process


def careful(vehicle: pf.Vehicle):
    base = pf.Controller("cascade", vehicle)

    def update(state, setpoint, dt, memory):
        if SEEN and SEEN[0] == "fail" and state.position[2] > 1.55:
            raise ZeroDivisionError("of the controller")
        count, inner = memory or (0, None)
        speeds, inner = base.update(state, setpoint, dt, inner)
        return speeds, (count + 1, inner)

    return update


def probe(seen: pf.SensorInput):
    seen.memory = (seen.memory or 0) + 1
    noise = seen.settings["noise"] * seen.random().normal()
    return [seen.state.position[2] + noise, seen.memory]


def near_only(origins, directions, hits):
    hits["range"][hits["range"] > 2.0] = -1
    return hits


pf.add_controller("careful", careful)
pf.add_sensor("probe", {"height": "m", "count": ""}, probe, rate=20, settings={"noise": 0.0})
pf.add_renderer("near_only", near_only)
pf.add_controller("short", lambda vehicle: lambda *_: ([1.0, 2.0], None))
pf.add_controller("wordy", lambda vehicle: lambda *_: "full power")
pf.add_sensor("broken", {"a": ""}, lambda seen: 1 / 0)
pf.add_sensor("long", {"a": ""}, lambda seen: [1, 2])


def keys(**changes: object) -> dict:
    room()
    return {
        "map": path_of("room.pfmap"),
        "duration": 1.0,
        "unfinished": "time_up",
        "vehicle": {"start": [0, 0, 1.5], "controller": "careful"},
        "lidars": [],
        "mission": {"waypoints": [[0, 0, 2.0]]},
        **changes,
    }


def states(sim: pf.Simulation) -> list:
    return [s.position.tobytes() + s.rotor_speeds.tobytes() for s in sim.samples(pf.StateSample)]


class PartsTest(unittest.TestCase):
    def setUp(self) -> None:
        SEEN.clear()

    def test_a_controller_that_passes_on_gives_the_same_bytes(self) -> None:
        ours = states(pf.Simulation(keys()))
        theirs = states(pf.Simulation(keys(vehicle={"start": [0, 0, 1.5], "controller": "cascade"})))
        self.assertEqual(ours, theirs)

    def test_states_hold_what_python_remembers(self) -> None:
        sim = pf.Simulation(keys(sensors=[{"kind": "probe", "noise": 0.1}]))
        sim.advance_to(0.3)
        state = sim.state()
        first = [s.values.tobytes() for s in sim.samples(pf.Measurement)]
        counts = [np.frombuffer(values)[1] for values in first]
        self.assertEqual(counts, list(range(7, 7 + len(counts))))
        sim.restore(state)
        self.assertEqual([s.values.tobytes() for s in sim.samples(pf.Measurement)], first)

    def test_sensor(self) -> None:
        sim = pf.Simulation(keys(sensors=[{"kind": "probe", "rate": 50}]))
        values = np.array([s.values for s in sim.samples(pf.Measurement)])
        self.assertEqual(values.shape, (51, 2))
        self.assertAlmostEqual(values[0, 0], 1.5)
        self.assertEqual(sim.sensors(0).count("probe"), 1)
        with self.assertRaisesRegex(pf.InputError, "noise"):
            pf.Simulation(keys(sensors=[{"kind": "probe", "nois": 1}]))
        noisy = {"kind": "probe", "noise": 1.0}
        draws = [s.values[0] for s in pf.Simulation(keys(sensors=[noisy])).samples(pf.Measurement)]
        again = [s.values[0] for s in pf.Simulation(keys(sensors=[noisy])).samples(pf.Measurement)]
        other = [s.values[0] for s in pf.Simulation(keys(sensors=[noisy], seed=2)).samples(pf.Measurement)]
        self.assertEqual(draws, again)
        self.assertNotEqual(draws, other)

    def test_renderer(self) -> None:
        lidar = {"model": "vlp16", "renderer": "near_only", "noise": False}
        scans = [s.scan for s in pf.Simulation(keys(lidars=[lidar])).samples(pf.ScanSample)]
        self.assertEqual(len(scans), 10)
        real = scans[5][scans[5]["label"] == 0]
        self.assertTrue(0 < len(real) < scans[5].beams)
        self.assertLessEqual(real["range"].max(), 2.2)

    def test_exceptions_come_out_as_they_were(self) -> None:
        SEEN.append("fail")
        sim = pf.Simulation(keys())
        state = sim.state()
        with self.assertRaisesRegex(ZeroDivisionError, "of the controller"):
            sim.advance_to(1.0)
        with self.assertRaisesRegex(RuntimeError, "restore"):
            sim.step()
        SEEN.clear()
        sim.restore(state)
        sim.advance_to(1.0)
        with self.assertRaises(ZeroDivisionError):
            pf.Simulation(keys(sensors=[{"kind": "broken"}])).advance_to(1.0)
        with self.assertRaisesRegex(ValueError, "measurement: shape"):
            pf.Simulation(keys(sensors=[{"kind": "long"}])).advance_to(1.0)
        for name, kind in (("short", ValueError), ("wordy", TypeError)):
            with self.assertRaises(kind):
                pf.Simulation(keys(vehicle={"start": [0, 0, 1.5], "controller": name})).step()
        with self.assertRaisesRegex(ValueError, "there already"):
            pf.add_controller("careful", careful)
        with self.assertRaises((TypeError, ValueError)):
            pf.add_sensor("nameless", {"a": 5}, probe)

    def test_a_callback_cannot_use_its_own_simulation(self) -> None:
        sims = []

        def meddle(seen: pf.SensorInput):
            sims[0].step()
            return [0]

        pf.add_sensor("meddle", {"a": ""}, meddle)
        sims.append(pf.Simulation(keys(sensors=[{"kind": "meddle"}])))
        with self.assertRaisesRegex(RuntimeError, "in use"):
            sims[0].step()


if __name__ == "__main__":
    unittest.main()

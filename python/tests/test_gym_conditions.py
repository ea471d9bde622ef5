"""What happens around vehicles that learn: obstacles, other vehicles, gusts, loads, faults; courses and formations."""

import unittest

import numpy as np

import pointflight as pf
from gym_check import check_env, check_vector, same
from pointflight.gym import (
    Corridor, Env, Explore, Formation, Goal, Hover, Lidar, ParallelEnv, VectorEnv, evaluate, hold, in_formation, lidar_of,
    straight, wander,
)  # fmt: skip
from support import room

SMALL = Lidar(4, 16, range_max=6.0)
BALLS = {"obstacles": [{"shape": "sphere", "radius": 0.15, "count": 6, "speed": 1.0, "at_border": "bounce"}], "seed": 3}
COURSE = [[-2, -1, 1.2], [2, -1, 1.2], [2, 1, 1.6], [-2, 1, 1.2], [-2, -1, 1.4]]


def goal() -> Goal:
    """In the room of the tests."""
    return Goal(distance=(1.5, 4.0), height=(0.8, 2.0), clearance=0.6, radius=0.5, time_limit=4.0)


def corridor() -> Corridor:
    return Corridor(COURSE, width=1.2, corners=2, radius=0.4, time_limit=6.0)


def formation() -> Formation:
    return Formation(side=0.9, distance=(0.5, 3.0), height=(1.2, 1.8), clearance=1.0, time_limit=3.0)


def some(task, mode: str = "disabled", count: int = 8, **arguments) -> VectorEnv:
    return VectorEnv(room(), count, task=task(), lidar=SMALL, autoreset=mode, **arguments)


class ConditionsTest(unittest.TestCase):
    def tearDown(self) -> None:
        pf.set_threads(0)

    def test_rules(self) -> None:
        for task in (corridor, formation):
            check_vector(self, lambda mode, count, task=task: some(task, mode, count))
        check_env(self, lambda: Env(room(), task=corridor(), lidar=SMALL, scenario=BALLS))
        for scenario in (BALLS, {"air": {"wind": {"mean": [1, 0, 0], "turbulence": "severe"}}}):
            check_vector(self, lambda mode, count, s=scenario: some(goal, mode, count, scenario=s))
        faults = {"faults": [{"kind": "lidar", "from": 0.5}, {"kind": "scan_drop", "value": 0.5}]}
        check_vector(self, lambda mode, count: some(goal, mode, count, scenario=faults))

    def test_same_bits_however_many_and_on_any_threads(self) -> None:
        scenario = {**BALLS, "air": {"wind": {"turbulence": "severe"}}, "faults": [{"kind": "rotor", "value": 0.9}]}
        vary = {"mass": (0.9, 1.2), "air.wind.mean": ([-1, -1, 0], [1, 1, 0]), "faults[0].from": (0.0, 2.0)}
        for task in (goal, formation):
            runs = []
            for threads, count in ((1, 40), (2, 40), (1, 8)):
                pf.set_threads(threads)
                env = some(task, "same_step", count, scenario=scenario, vary=vary)
                random = np.random.default_rng(1)
                log = [env.reset(seed=11)[0]]
                for _ in range(30):
                    log.append(env.step(random.uniform(-1, 1, (40, 4))[:count])[0])
                runs.append(log)
            for one, other, few in zip(*runs):
                self.assertTrue(same(one, other))
                self.assertTrue(same({name: values[:8] for name, values in one.items()}, few))

    def test_obstacles_are_seen_and_hit(self) -> None:
        still = {"obstacles": [{"shape": "sphere", "radius": 0.3, "motion": "still", "position": [0, 0, 1.2]}]}
        env = some(lambda: Corridor([[-2, 0, 1.2], [2, 0, 1.2]], corners=1), count=2, scenario=still)
        ahead = Lidar(1, 1, (-0.01, 0.01), (-0.01, 0.01), range_max=6.0)
        seeing = VectorEnv(room(), 2, task=Corridor([[-2, 0, 1.2], [2, 0, 1.2]], corners=1), lidar=ahead, scenario=still)
        seen, _ = seeing.reset(seed=0)
        self.assertAlmostEqual(float(seen["range"][0, 0, 0]) * 6.0, 1.7, places=4)
        env.reset(seed=0)
        least = 9.0
        for _ in range(40):
            before = env.states.position[0].copy()
            _, _, terminated, _, infos = env.step(np.tile([0.3, 0.0, 0.0, 0.0], (2, 1)))
            if terminated[0]:
                break
            least = min(least, infos["clearance"][0])
        self.assertTrue(infos["collided"][0])
        self.assertLess(least, 0.12)
        self.assertLess(np.linalg.norm(before - [0, 0, 1.2]), 0.3 + 0.35 + 0.1)

    def test_obstacles_move_as_in_a_simulation(self) -> None:
        env = some(goal, count=64, scenario=BALLS)
        seen, _ = env.reset(seed=2)
        same_seeds = some(goal, count=64)
        alone, _ = same_seeds.reset(seed=2)
        there = (env.states.position == same_seeds.states.position).all(1)  # others would start within an obstacle
        self.assertGreater(there.sum(), 20)
        nearer = seen["range"] < alone["range"] - 0.01
        self.assertGreater(nearer[there].mean(), 0.005)
        self.assertTrue((seen["range"] <= alone["range"] + 1e-6)[there].all())
        self.assertGreater(len(np.unique(env.conditions.clock)), 60)
        # the same scenario flown: distances of a vehicle at its start
        loop = {"shape": "sphere", "radius": 0.2, "motion": "loop", "speed": 0.7}
        ways = ([[-2, 0, 1.5], [2, 0, 1.5], [0, 1, 1.0]], [[0, -1, 0.8], [1, -1, 2.0]])
        scenario = {"obstacles": [{**loop, "waypoints": way} for way in ways], "output": {"obstacle_rate": 10}}
        sim = pf.Simulation(
            {"map": "-", "duration": 65, "unfinished": "time_up", "lidars": [], "vehicle": {"start": [-2.5, -1.5, 1]},
             **scenario}, room(),
        )  # fmt: skip
        env = some(goal, count=4, scenario={"obstacles": scenario["obstacles"]})
        env.reset(seed=2)
        at, hull = np.array([0.1, 0.3, 1.3]), env.vehicle.values["radius"]
        for sample in list(sim.samples(pf.ObstacleSample, until=20.0))[::7]:
            expected = np.linalg.norm(sample.poses[:, :3, 3] - at, axis=1).min() - 0.2 - hull
            told = env._flights[0].clearance_of_obstacles(at[None], np.array([sample.time]))[0]
            self.assertAlmostEqual(told, min(1.5, expected), delta=1e-5)

    def test_a_team_sees_and_hits_itself(self) -> None:
        fine = Lidar(16, 128, range_max=6.0)
        task = Formation(side=0.9, distance=(0.5, 3.0), height=(1.2, 1.8), clearance=1.0, radius=0.01)
        env = VectorEnv(room(), 8, task=task, lidar=fine, autoreset="disabled")
        seen, _ = env.reset(seed=4)
        alone = VectorEnv(room(), 1, task=goal(), lidar=fine)
        alone.reset(seed=0)
        at = env.states.position[0]
        alone.place(np.zeros(1, np.uint32), at[None], at[None] + np.append(env.states.heading[0], 0.0))
        alone._measure(np.zeros(1, np.uint32))
        empty = alone._observation()["range"][0]
        self.assertTrue((seen["range"][0] <= empty + 1e-6).all())
        self.assertGreater((seen["range"][0] < empty - 0.05).sum(), 0)
        toward = np.zeros((8, 4))
        middle = env.task._middle(env.states.position)
        s = env.states
        for _ in range(12):
            toward[:, :3] = s.level(middle - s.position) * 0.4
            _, _, terminated, _, infos = env.step(toward)
            if terminated.any():
                break
        self.assertTrue(terminated.any())
        np.testing.assert_array_equal(infos["collided"], terminated)
        np.testing.assert_array_equal(terminated.reshape(2, 4).all(1), terminated.reshape(2, 4).any(1))

    def test_gusts_blow_as_strongly_as_asked(self) -> None:
        def spread(turbulence: str) -> float:
            env = VectorEnv(
                room(), 64, task=Hover(height=(1.4, 1.6), clearance=0.9, displacement=0.0), lidar=None, autoreset="disabled",
                scenario={"air": {"wind": {"mean": [0, 0, 0], "turbulence": turbulence}}},
            )  # fmt: skip
            env.reset(seed=0)
            for _ in range(30):
                env.step(np.zeros((64, 4)))
            return float(env.states.velocity.std())

        calm, light, severe = spread("none"), spread("light"), spread("severe")
        self.assertLess(calm, 1e-3)
        self.assertGreater(light, 0.005)
        self.assertGreater(severe, 1.5 * light)

    def test_loads_sink_and_rotors_fail(self) -> None:
        heavy = some(goal, count=4, action="rotor_speeds", vary={"mass": (2.0, 2.0)})
        plain = some(goal, count=4, action="rotor_speeds")
        half = {"faults": [{"kind": "rotor", "index": 1, "value": 0.5, "from": 0.15}]}
        failing = some(goal, count=4, action="rotor_speeds", scenario=half)
        for env in (heavy, plain, failing):
            env.reset(seed=1)
            env.step(np.zeros((4, 4)))
        # half of what would carry it is left: g / 2
        np.testing.assert_allclose(heavy.states.velocity[:, 2], -0.5 * 9.80665 * 0.1, rtol=0.02)
        np.testing.assert_allclose(plain.states.velocity, 0.0, atol=1e-6)
        self.assertTrue(same(plain.states.velocity, failing.states.velocity))
        for env in (plain, failing):
            env.step(np.zeros((4, 4)))
            env.step(np.zeros((4, 4)))
        self.assertGreater(np.abs(failing.states.angular_velocity[:, :2]).min(), 1.0)
        np.testing.assert_allclose(plain.states.angular_velocity, 0.0, atol=1e-6)

    def test_lidars_fail(self) -> None:
        dead = some(goal, scenario={"faults": [{"kind": "lidar", "from": 0.15, "until": 0.35}]})
        seen = [dead.reset(seed=1)[0]["range"]]
        for _ in range(4):
            seen.append(dead.step(np.zeros((8, 4)))[0]["range"])
        self.assertEqual([(image == 1.0).all() for image in seen], [False, False, True, True, False])
        drops = some(goal, count=64, scenario={"faults": [{"kind": "scan_drop", "value": 0.3}]})
        before, kept = drops.reset(seed=1)[0]["range"], []
        for _ in range(10):
            now = drops.step(np.full((64, 4), 0.3))[0]["range"]
            kept.append((now == before).all((1, 2)) & drops.moved)
            before = now
        self.assertAlmostEqual(np.mean(kept[:5]), 0.3, delta=0.08)

    def test_courses(self) -> None:
        env = some(lambda: Corridor(COURSE, width=1.2, corners=2, radius=0.4, time_limit=30.0), count=16)
        seen, _ = env.reset(seed=0)
        self.assertEqual(seen["state"].shape, (16, 17))
        ends = {name: np.zeros(16, bool) for name in ("reached", "left", "collided")}
        for _ in range(250):
            seen, _, terminated, _, infos = env.step(0.15 * straight(seen))
            for name, values in ends.items():
                values |= infos[name] & terminated
        self.assertGreater(ends["reached"].sum(), 12)
        env.reset(seed=0)
        for _ in range(20):
            seen, _, terminated, _, infos = env.step(np.tile([0.0, 0.4, 0.0, 0.0], (16, 1)))
            ends["left"] |= infos["left"] & terminated
        self.assertGreater(ends["left"].sum(), 8)
        tour = room().tour(length=6.0, margin=0.3)
        self.assertGreater(len(tour), 2)
        self.assertGreater(room().nearest(tour)[0].min(), 0.55)
        self.assertTrue(same(tour, room().tour(length=6.0, margin=0.3)))
        with self.assertRaisesRegex(ValueError, "no position is free"):
            room().tour(margin=3.0)

    def test_a_sensor_s_field_of_view_and_noise(self) -> None:
        lidar = lidar_of("mid360", 4, 24, noise=0.05)
        self.assertEqual((lidar.rows, lidar.columns, lidar.noise, lidar.range_max), (4, 24, 0.05, 10.0))
        self.assertEqual(lidar.azimuth, (-np.pi, np.pi))
        self.assertAlmostEqual(np.degrees(lidar.elevation[0]), -7.2, delta=1.0)
        self.assertAlmostEqual(np.degrees(lidar.elevation[1]), 52.2, delta=1.0)
        avia = lidar_of(pf.Lidar("avia"))
        self.assertEqual((avia.sensor, avia.noise), ("avia", 0.0))
        self.assertLess(avia.azimuth[1], np.radians(40))
        seen = VectorEnv(room(), 2, task=goal(), lidar=avia).reset(seed=0)[0]["range"]
        self.assertEqual(seen.shape, (2, 16, 64))

    def test_beams_come_back_as_a_sensor_s_do(self) -> None:
        def images(**surroundings: object) -> np.ndarray:
            sensed = lidar_of("vlp16", 8, 32, rolling=False)
            env = VectorEnv(room(), 4, task=goal(), lidar=sensed, scenario={"surroundings": surroundings})
            return env.reset(seed=0)[0]["range"]

        plain = lidar_of("vlp16", 8, 32, rolling=False)._replace(sensor=None)
        exact = VectorEnv(room(), 4, task=goal(), lidar=plain).reset(seed=0)[0]["range"]
        bright = images(reflectivity=0.5)
        off = 10.0 * (bright - exact)[(exact < 1.0) & (bright < 1.0)]
        self.assertTrue(0.002 < off[np.abs(off) < 0.2].std() < 0.03)
        self.assertGreater((bright < 1.0).mean(), (exact < 1.0).mean() - 0.02)
        self.assertTrue(same(bright, images(reflectivity=0.5)))
        self.assertLess((images(reflectivity=0.00005) < 1.0).mean(), 0.9 * (bright < 1.0).mean())
        with self.assertRaisesRegex(pf.InputError, "no_such"):
            VectorEnv(room(), 1, task=goal(), lidar=Lidar(sensor="no_such"))
        with self.assertRaisesRegex(ValueError, "depth camera"):
            VectorEnv(room(), 1, task=goal(), lidar=Lidar(sensor="d455"))

    def test_agents_of_a_team(self) -> None:
        env = ParallelEnv(room(), task=formation(), lidar=SMALL)
        self.assertEqual(env.possible_agents, ["drone0", "drone1", "drone2", "drone3"])
        with self.assertRaisesRegex(RuntimeError, "reset"):
            env.step({})
        seen, infos = env.reset(seed=3)
        twin = some(formation, count=4)
        expected, _ = twin.reset(seed=3)
        self.assertEqual(set(seen), set(env.agents), set(infos))
        random = np.random.default_rng(0)
        while env.agents:
            actions = {agent: random.uniform(-0.3, 0.3, 4) for agent in env.agents}
            for agent, observation in seen.items():
                self.assertTrue(env.observation_space(agent).contains(observation))
            seen, rewards, ends, cuts, infos = env.step(actions)
            expected, reward, terminated, truncated, _ = twin.step(np.stack(list(actions.values())))
            for i, agent in enumerate(env.possible_agents):
                self.assertTrue(same(seen[agent]["range"], np.ascontiguousarray(expected["range"][i])))
                self.assertEqual((rewards[agent], ends[agent], cuts[agent]), (reward[i], terminated[i], truncated[i]))
                self.assertIn("collided", infos[agent])
        self.assertTrue(all(ends.values()) or all(cuts.values()))
        env.reset()
        with self.assertRaisesRegex(ValueError, "drone3"):
            env.step({"drone0": np.zeros(4)})
        two = ParallelEnv(room(), task=goal(), lidar=None, team=2)
        self.assertEqual(len(two.reset(seed=0)[0]), 2)

    def test_pilots(self) -> None:
        still = VectorEnv(room(), 8, task=Hover(displacement=0.3, height=(1, 2), clearance=0.8), lidar=None, autoreset="disabled")
        self.assertEqual(evaluate(still, hold, range(8)).arrived, 8)
        square = VectorEnv(room(), 16, task=formation(), lidar=None, autoreset="disabled")
        score = evaluate(square, lambda seen: 0.5 * in_formation(seen), range(4))
        self.assertEqual((score.flights, score.arrived), (4, 4))
        level = Lidar(1, 60, (-0.05, 0.05), range_max=6.0)
        explore = VectorEnv(
            room(), 8, task=Explore(cell=0.5, height=(0.8, 2.0), clearance=0.6, time_limit=4.0), lidar=level, autoreset="disabled"
        )
        self.assertEqual(evaluate(explore, wander(explore, 0.2), range(8)).collided, 0)

    def test_misuse(self) -> None:
        for wrong in (
            lambda: some(goal, scenario={"mission": {}}),
            lambda: some(goal, scenario={"faults": [{"kind": "imu"}]}),
            lambda: some(goal, vary={"gravity": (1, 2)}),
            lambda: some(goal, vary={"mass": (0.0, 1.0)}),
            lambda: some(goal, vary={"mass": ([1, 2], [1, 2])}),
            lambda: some(goal, vary={"air.wind.mean": (1.0, 2.0)}),
            lambda: some(goal, vary={"faults[0].from": (0, 1)}),
            lambda: some(goal, team=3, count=9),
            lambda: some(formation, count=6),
            lambda: some(formation, team=2),
            lambda: some(formation).reset(seed=list(range(8))),
            lambda: some(formation).reset(options={"reset_mask": np.arange(8) == 0}),
            lambda: some(lambda: Corridor(np.zeros((3, 2)))),
            lambda: some(lambda: Corridor(COURSE, corners=5)),
            lambda: some(goal)._flights[0].set_rotor(np.zeros(1, np.uint32), 4, np.ones(1)),
            lambda: some(goal)._flights[0].set_rotor(np.zeros(1, np.uint32), 0, np.full(1, 2.0)),
            lambda: some(goal)._flights[0].place(np.zeros(1, np.uint32), np.zeros((1, 11)), np.zeros(1, np.uint64)),
        ):  # fmt: skip
            with self.assertRaises(ValueError):
                wrong()
        with self.assertRaises(pf.InputError):
            some(goal, scenario={"obstacles": [{"shape": "donut"}]})


if __name__ == "__main__":
    unittest.main()

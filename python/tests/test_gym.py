"""Environments for learning: gymnasium's rules, the same bits however many there are, pilots that arrive."""

import types
import unittest

import numpy as np

import pointflight as pf
from gym_check import check_env, check_vector, same
from pointflight.gym import (
    Env,
    Explore,
    Goal,
    Hover,
    Lidar,
    Observer,
    Policy,
    Race,
    VectorEnv,
    advantages,
    evaluate,
    reactive,
    straight,
)
from pointflight.gym.observer import deskewed
from pointflight.gym.stable_baselines import StableBaselinesEnv
from support import path_of, room

SMALL = Lidar(4, 16, range_max=6.0)


def goal() -> Goal:
    """In the room of the tests."""
    return Goal(distance=(1.5, 4.0), height=(0.8, 2.0), clearance=0.6, radius=0.5, time_limit=4.0)


def hover() -> Hover:
    return Hover(displacement=0.3, height=(1.0, 2.0), clearance=0.8, time_limit=2.0)


def race() -> Race:
    return Race(goals=3, distance=(1.0, 4.0), height=(0.8, 2.0), clearance=0.6, radius=0.6, time_limit=6.0)


def explore() -> Explore:
    return Explore(cell=0.5, height=(0.8, 2.0), clearance=0.6, time_limit=4.0)


def some(task, mode: str = "next_step", count: int = 8, **arguments) -> VectorEnv:
    return VectorEnv(room(), count, task=task(), lidar=SMALL, autoreset=mode, **arguments)


def pose_of(states, i: int) -> np.ndarray:
    """(4, 4) by v + 2 w (q x v) + 2 q x (q x v) of each axis."""
    q, w = states.orientation[i, :3], states.orientation[i, 3]
    pose = np.eye(4)
    for k, axis in enumerate(np.eye(3)):
        uv = 2 * np.cross(q, axis)
        pose[:3, k] = axis + w * uv + np.cross(q, uv)
    pose[:3, 3] = states.position[i]
    return pose


class GymTest(unittest.TestCase):
    def tearDown(self) -> None:
        pf.set_threads(0)

    def test_rules_of_one(self) -> None:
        for task in (goal, hover, race, explore):
            for action in ("velocity", "acceleration", "body_rates", "rotor_speeds"):
                check_env(self, lambda task=task, action=action: Env(room(), task=task(), lidar=SMALL, action=action))
        check_env(self, lambda: Env(room(), task=goal(), lidar=None))

    def test_rules_of_many(self) -> None:
        for task in (goal, hover, race, explore):
            check_vector(self, lambda mode, count, task=task: some(task, mode, count))

    def test_same_bits_however_many_and_on_any_threads(self) -> None:
        random = np.random.default_rng(1)
        actions = random.uniform(-1, 1, (40, 33, 4))
        runs = []
        for threads, count in ((1, 33), (2, 33), (1, 1)):
            pf.set_threads(threads)
            env = some(goal, count=count)
            log = [env.reset(seed=11)[0]]
            for step in actions:
                log.append(env.step(step[:count])[:4])
            runs.append(log)
        self.assertTrue(all(same(a, b) for a, b in zip(_flat(runs[0]), _flat(runs[1]))))
        for many, one in zip(_flat(runs[0]), _flat(runs[2])):
            self.assertTrue(same(np.asarray(many)[:1], one))

    def test_a_gpu_has_the_same_bits(self) -> None:
        lidar = Lidar(4, 16, range_max=6.0, rolling=True)
        try:
            VectorEnv(room(), 1, task=goal(), lidar=lidar, renderer="gpu")
        except ValueError as error:
            self.skipTest(str(error))
        random = np.random.default_rng(1)
        actions = random.uniform(-1, 1, (10, 9, 4))
        runs = []
        for renderer in ("beam", "gpu", "auto"):
            env = VectorEnv(room(), 9, task=goal(), lidar=lidar, renderer=renderer)
            log = [env.reset(seed=11)[0]]
            for step in actions:
                log.append(env.step(step)[:4])
            runs.append(log)
        for other in runs[1:]:
            self.assertTrue(all(same(a, b) for a, b in zip(_flat(runs[0]), _flat(other))))

    def test_seeds(self) -> None:
        env = some(goal, count=3)
        first, _ = env.reset(seed=[5, 9, 6])
        second, _ = env.reset(seed=5)
        self.assertTrue(same(first["state"][0], second["state"][0]))
        self.assertTrue(same(first["state"][2], second["state"][1]))
        mask = np.array([False, True, False])
        third, _ = env.reset(seed=[0, 9, 0], options={"reset_mask": mask})
        self.assertTrue(same(third["state"][0], second["state"][0]))
        self.assertTrue(same(third["state"][1], first["state"][1]))

    def test_views_and_copies(self) -> None:
        views, copies = some(goal, copy=False), some(goal)
        image = views.reset(seed=1)[0]["range"]
        self.assertFalse(image.flags.writeable)
        self.assertTrue(np.shares_memory(image, views._flights[0].ranges))
        kept = copies.reset(seed=1)[0]["range"]
        before = kept.copy()
        self.assertTrue(same(kept, image.copy()))
        for env in (views, copies):
            env.step(np.full((8, 4), 0.5))
        self.assertTrue(same(kept, before))
        self.assertFalse(same(image, before))
        del views
        self.assertTrue(np.isfinite(image).all())

    def test_ranges_are_those_of_the_map(self) -> None:
        env = some(goal)
        seen, _ = env.reset(seed=2)
        for i in range(3):
            at = pose_of(env.states, i)
            image = pf.ranges(room(), at, pf.grid(4, 16, SMALL.elevation), range_max=6.0)
            np.testing.assert_allclose(seen["range"][i], np.minimum(image[0] / 6.0, 1.0), atol=1e-5)

    def test_pooled_ranges_are_the_least_of_each_cell(self) -> None:
        pooled = Lidar(2, 8, range_max=6.0, pool=(3, 2))
        seen = VectorEnv(room(), 4, task=goal(), lidar=pooled).reset(seed=2)[0]["range"]
        fine = VectorEnv(room(), 4, task=goal(), lidar=Lidar(6, 16, range_max=6.0)).reset(seed=2)[0]["range"]
        self.assertTrue(same(seen, np.ascontiguousarray(fine.reshape(4, 2, 3, 8, 2).min((2, 4)))))
        rolling = VectorEnv(room(), 4, task=goal(), lidar=pooled._replace(rolling=True))
        finer = VectorEnv(room(), 4, task=goal(), lidar=Lidar(6, 16, range_max=6.0, rolling=True))
        for env in (rolling, finer):
            env.reset(seed=2)
            seen = env.step(np.full((4, 4), 0.7))[0]["range"]
        least = rolling._observation()["range"]
        self.assertTrue(same(least, np.ascontiguousarray(seen.reshape(4, 2, 3, 8, 2).min((2, 4)))))
        with self.assertRaisesRegex(ValueError, "pool"):
            VectorEnv(room(), 4, task=goal(), lidar=Lidar(2, 8, pool=(0, 1)))

    def test_points_are_deskewed_to_the_present(self) -> None:
        # a body that turns about z at 2 rad/s and flies; marks of the world, each measured at another time
        random = np.random.default_rng(3)
        marks = random.uniform(-5, 5, (50, 3))
        ages = random.uniform(0.0, 0.1, 50)
        velocity, rate, yaw = np.array([2.0, -1.0, 0.5]), 2.0, 0.7

        def in_body(mark: np.ndarray, before: float) -> np.ndarray:
            c, s = np.cos(yaw - rate * before), np.sin(yaw - rate * before)
            return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ (mark + velocity * before)

        measured = np.stack([in_body(mark, age) for mark, age in zip(marks, ages)])
        now = np.stack([in_body(mark, 0.0) for mark in marks])
        body = types.SimpleNamespace(
            velocity=velocity, angular_velocity=np.array([0, 0, rate]),
            orientation=np.array([0, 0, np.sin(yaw / 2), np.cos(yaw / 2)]),
        )  # fmt: skip
        np.testing.assert_allclose(deskewed(measured, ages, body), now, atol=1e-12)

    def test_cells_of_points(self) -> None:
        body = types.SimpleNamespace(
            position=np.zeros(3), velocity=np.zeros(3), orientation=np.array([0, 0, 0, 1.0]), angular_velocity=np.zeros(3)
        )
        points = [[2.0, 0.4, 0.0], [4.0, 0.02, 0.0], [20.0, 0.0, 0.0], [0, 0, 0]]
        lidar = Lidar(1, 1, (-0.5, 0.5), (-0.5, 0.5))
        closest = Observer([5, 0, 0], lidar).of_points(body, points[:2])["range"]
        self.assertAlmostEqual(float(closest[0, 0, 0]), 0.400005, places=5)
        nearest = Observer([5, 0, 0], lidar._replace(pool=(2, 2))).of_points(body, points)["range"]
        self.assertAlmostEqual(float(nearest[0, 0, 0]), 0.2039608, places=5)
        self.assertEqual(Observer([5, 0, 0], lidar).of_points(body, np.zeros((0, 3)))["range"].max(), 1.0)
        self.assertEqual(Observer([5, 0, 0], lidar).of_points(body, points[2:])["range"].max(), 1.0)

    def test_advantages(self) -> None:
        rewards, ends = np.array([[1.0], [2.0], [3.0]]), np.array([[False], [True], [False]])
        values = np.array([[0.5], [0.25], [0.125], [4.0]], np.float32)
        last = 3.0 + 0.9 * 4.0 - 0.125
        middle = 2.0 - 0.25
        first = 1.0 + 0.9 * 0.25 - 0.5 + 0.9 * 0.8 * middle
        found = advantages(rewards, values, ends, 0.9, 0.8)
        np.testing.assert_allclose(found[:, 0], [first, middle, last], rtol=1e-6)

    def test_several_maps(self) -> None:
        env = VectorEnv([room(), room()], 5, task=goal(), lidar=SMALL)
        alone = VectorEnv(room(), 5, task=goal(), lidar=SMALL)
        self.assertTrue(same(env.reset(seed=4)[0], alone.reset(seed=4)[0]))
        actions = np.full((5, 4), 0.3)
        for _ in range(10):
            self.assertTrue(same(env.step(actions)[:4], alone.step(actions)[:4]))

    def test_a_straight_pilot_arrives_in_an_empty_room(self) -> None:
        env = some(goal, "disabled", 32)
        seen, _ = env.reset(seed=0)
        reached = np.zeros(32, bool)
        collided = np.zeros(32, bool)
        for _ in range(40):
            s = seen["state"]
            to_goal = np.stack([s[:, 0] * s[:, 2] * 30, s[:, 1] * s[:, 2] * 30, s[:, 3] * 3, 0 * s[:, 0]], 1)
            speed = np.minimum(np.linalg.norm(to_goal, axis=1, keepdims=True), 1.0) / 3.0
            seen, _, _, _, infos = env.step(to_goal / np.linalg.norm(to_goal, axis=1, keepdims=True) * speed)
            reached |= infos["reached"] & infos["_reached"]
            collided |= infos["collided"]
        self.assertGreater(reached.sum(), 28)
        self.assertLess(collided.sum(), 3)

    def test_stable_baselines(self) -> None:
        env = StableBaselinesEnv(some(goal, "same_step"))
        env.seed(3)
        seen = env.reset()
        self.assertTrue(same(seen, some(goal).reset(seed=3)[0]))
        ends = 0
        random = np.random.default_rng(1)
        for _ in range(60):
            env.step_async(random.uniform(-1, 1, (8, 4)).astype(np.float32))
            seen, rewards, dones, infos = env.step_wait()
            self.assertEqual((rewards.dtype, dones.dtype, len(infos)), (np.float32, np.bool_, 8))
            for i in np.flatnonzero(dones):
                ends += 1
                self.assertTrue(env.observation_space.contains(infos[i]["terminal_observation"]))
                self.assertIs(type(infos[i]["TimeLimit.truncated"]), bool)
            self.assertTrue(all("terminal_observation" not in infos[i] for i in np.flatnonzero(~dones)))
        self.assertGreater(ends, 2)
        self.assertEqual(env.get_attr("action_period", [0, 1]), [0.1, 0.1])
        self.assertEqual(env.env_is_wrapped(object), [False] * 8)
        with self.assertRaises(ValueError):
            StableBaselinesEnv(some(goal))
        with self.assertRaises(RuntimeError):
            env.step_wait()

    def test_policies_are_kept_and_evaluated(self) -> None:
        env = some(goal, "disabled", 16)
        random = np.random.default_rng(0)
        width = 64 + 15
        layers = [
            (random.normal(0, 0.1, (8, width)).astype(np.float32), np.zeros(8, np.float32)),
            (random.normal(0, 0.01, (3, 8)).astype(np.float32), np.zeros(3, np.float32)),
        ]
        policy = Policy(layers, {"base": 0.3, "range_max": 6.0})
        policy.save(path_of("policy.npz"))
        again = Policy.load(path_of("policy.npz"))
        seen, _ = env.reset(seed=0)
        np.testing.assert_array_equal(policy(seen), again(seen))
        self.assertEqual(policy(seen).shape, (16, 4))
        score = evaluate(env, policy, range(16))
        self.assertEqual(score.arrived + score.collided + score.late, 16)
        self.assertGreater(score.arrived, 10)
        self.assertTrue(score.interval[0] < score.arrived / 16 <= score.interval[1] + 1e-9)
        self.assertGreater(evaluate(env, reactive(env, 0.3), range(16)).arrived, 4)

    def test_observer_sees_what_the_environment_does(self) -> None:
        env = some(goal, count=1)
        for seed in range(3):
            seen, _ = env.reset(seed=seed)
            for _ in range(3):  # headings that are asked for and those that are differ in a turn
                seen = env.step([[0.4, 0.2, 0.1, 0.0]])[0]
            states = env.states
            pose = pose_of(states, 0)
            body = types.SimpleNamespace(
                position=states.position[0], velocity=states.velocity[0], orientation=states.orientation[0],
                angular_velocity=states.angular_velocity[0], pose=pose,
            )  # fmt: skip
            observer = Observer(env.task.goal[0], SMALL, goal())
            observer.elapsed, observer.last_action = env.elapsed[0], env.last_actions[0]
            told = observer.of_map(body, room())
            np.testing.assert_allclose(told["range"], seen["range"], atol=1e-5)
            np.testing.assert_allclose(told["state"], seen["state"], atol=0.01)
            directions = pf.grid(4, 16, SMALL.elevation).reshape(-1, 3)
            points = directions * (told["range"].reshape(-1, 1) * 6.0)
            again = observer.of_points(body, points)
            np.testing.assert_allclose(again["range"], told["range"], atol=1e-5)

    def test_race_goes_from_goal_to_goal(self) -> None:
        def slow() -> Race:
            return Race(goals=3, distance=(1, 4), height=(0.8, 2.0), clearance=0.7, time_limit=20.0)

        env = some(slow, "disabled", 16)
        seen, _ = env.reset(seed=0)
        passed = np.zeros(16, np.int64)
        finished = np.zeros(16, bool)
        for _ in range(200):
            before = env.task.goal.copy()
            seen, _, terminated, _, infos = env.step(0.3 * straight(seen))
            moved = (env.task.goal != before).any(1)
            np.testing.assert_array_equal(moved, (infos["passed"] > passed) & (infos["passed"] < 3))
            passed = infos["passed"]
            finished |= infos["reached"] & terminated
        self.assertGreater(finished.sum(), 10)
        self.assertTrue((passed[finished] == 3).all())

    def test_exploring_counts_cells_once(self) -> None:
        env = some(explore, "disabled", 2)
        env.reset(seed=0)
        still = np.zeros((2, 4))
        _, _, _, _, infos = env.step(still)
        self.assertGreater(infos["found"].min(), 20)
        points, hit = env.points()
        inside = (points > [-3.1, -2.1, -0.1]).all(2) & (points < [3.1, 2.1, 3.1]).all(2)
        self.assertTrue(inside[hit].all())
        for _ in range(3):
            _, _, _, _, infos = env.step(still)
        self.assertLess(infos["found"].max(), 5)
        self.assertTrue((infos["cells"] >= 20).all())

    def test_wind_blows_and_ranges_are_noisy_as_told(self) -> None:
        calm = some(goal, count=16)
        blown = some(goal, count=16, vary={"air.wind.mean": ([-4, -4, 0], [4, 4, 0])})
        calm.reset(seed=1), blown.reset(seed=1)
        start = calm.states.position.copy()
        np.testing.assert_array_equal(start, blown.states.position)
        for env in (calm, blown):
            env.step(np.zeros((16, 4)))
        self.assertLess(np.abs(calm.states.position - start).max(), 1e-3)
        self.assertGreater(np.abs(blown.states.position - start).max(), 1e-3)
        exact = VectorEnv(room(), 64, task=goal(), lidar=SMALL).reset(seed=5)[0]["range"]
        noisy_lidar = SMALL._replace(noise=0.06, dropout=0.2)
        noisy = VectorEnv(room(), 64, task=goal(), lidar=noisy_lidar).reset(seed=5)[0]["range"]
        again = VectorEnv(room(), 3, task=goal(), lidar=noisy_lidar).reset(seed=5)[0]["range"]
        np.testing.assert_array_equal(noisy[:3], again)
        lost = (noisy == 1.0) & (exact < 0.9)
        self.assertAlmostEqual(lost.mean(), 0.2 * (exact < 0.9).mean(), delta=0.02)
        off = (noisy - exact)[(noisy < 1.0) & (exact < 0.9)] * 6.0
        self.assertAlmostEqual(off.std(), 0.06, delta=0.005)
        self.assertAlmostEqual(off.mean(), 0.0, delta=0.005)

    def test_misuse(self) -> None:
        for wrong in (
            lambda: VectorEnv(room(), 0),
            lambda: VectorEnv(room(), 2, autoreset="never"),
            lambda: VectorEnv(room(), 2, task="win"),
            lambda: VectorEnv(room(), 2, action="teleport", task=goal()),
            lambda: VectorEnv([], 2),
            lambda: VectorEnv(room(), 2, renderer="pencil", task=goal()),
            lambda: VectorEnv(room(), 2, lidar=Lidar(0, 5), task=goal()),
            lambda: VectorEnv(room(), 2, task=goal(), physics_step=0.007),
            lambda: some(Goal).reset(),  # 20 m do not fit into the room
            lambda: some(goal).step(np.zeros((8, 4))),
            lambda: Env(room(), num_envs=3),
            lambda: some(goal).reset(seed=-1),
            lambda: some(goal).reset(options={"reset_mask": np.zeros(8, bool)}),
        ):
            with self.assertRaises((ValueError, TypeError, RuntimeError)):
                wrong()
        env = some(goal)
        env.reset(seed=1)
        for actions in (np.zeros(4), np.zeros((8, 3)), np.full((8, 4), np.nan), "left"):
            with self.assertRaises((ValueError, TypeError)):
                env.step(actions)


def _flat(log):
    """Observations and results one after the other."""
    arrays = []
    for entry in log:
        parts = (entry,) if isinstance(entry, dict) else entry
        for part in parts:
            arrays += list(part.values()) if isinstance(part, dict) else [part]
    return arrays


if __name__ == "__main__":
    unittest.main()

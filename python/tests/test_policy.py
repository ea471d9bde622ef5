"""Policies of pointflight.gym in the program: `pointflight fly --policy`."""

import json
import unittest

import numpy as np

import pointflight as pf
from pointflight.gym import FacingGoal, Goal, Lidar, Observer, Policy, VectorEnv, facing_goal, straight, turned
from support import path_of, room, run

LIDAR = Lidar(3, 12, pool=(2, 2), range_max=6.0)
GOAL = (2.0, 1.2, 1.6)
KEYS = {
    "map": "room.pfmap",
    "seed": 4,
    "vehicle": {"name": "pilot", "start": [-2, -1, 1.2], "start_yaw_deg": 20},
    "lidars": [{"model": "vlp16", "position": [0, 0, 0.05]}],
    "mission": {"waypoints": [list(GOAL)]},
}


def policy_file(lidar: "Lidar | None" = LIDAR, **others: object) -> str:
    """A network of small random numbers about half of the straight way."""
    random = np.random.default_rng(5)
    inputs = 15 + (0 if lidar is None else lidar.rows * lidar.columns)
    layers = [
        (random.normal(0.0, 0.1, (8, inputs)).astype(np.float32), random.normal(0.0, 0.1, 8).astype(np.float32)),
        (random.normal(0.0, 0.05, (4, 8)).astype(np.float32), np.zeros(4, np.float32)),
    ]
    about = {
        "task": "goal", "time_limit": 20.0, "action": "velocity", "speed": 1.5, "yaw_rate": 1.0, "action_period": 0.1,
        "base": 0.5, **others, **({} if lidar is None else {"lidar": lidar._asdict()}),
    }  # fmt: skip
    path = path_of("policy.npz" if lidar else "blind.npz")
    Policy(layers, about).save(path)
    return path


def scenario_file(**changes: object) -> str:
    path = path_of("policy.yaml")
    with open(path, "w") as file:
        json.dump({**KEYS, **changes}, file)
    return path


def flown_in_python(policy: Policy, seconds: float) -> np.ndarray:
    """(k, 3): positions at the ends of scans."""
    sim = pf.Simulation({**KEYS, "mission": {}, "duration": seconds, "unfinished": "time_up"}, room())
    observer = Observer(GOAL, policy.lidar, Goal())
    positions = []
    for sample in sim.samples(pf.ScanSample):
        body = sim.status("pilot")
        positions.append(body.position)
        points = sample.scan.xyz + [0, 0, 0.05]
        action = policy(observer.of_points(body, points, sim.time - sample.start - sample.scan["time"]))[0]
        observer.last_action, observer.elapsed = action, sim.time
        sim.command("pilot", pf.Velocity(1.5 * action[:3], yaw_rate=float(action[3]), in_body=True))
    return np.array(positions)


class PolicyTest(unittest.TestCase):
    def test_program_and_module_fly_alike(self) -> None:
        for others in ({}, {"faces_goal": True}):
            with self.subTest(**others):
                self._fly_alike(**others)

    def _fly_alike(self, **others: object) -> None:
        room()
        path = policy_file(**others)
        result = run("fly", scenario_file(), "--policy", path, "-o", path_of("policy_run"), "--no-picture", "--force")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("pilot reached 1 of 1 goals", result.stderr)
        table = pf.Run(path_of("policy_run")).flight("pilot").trajectory
        places = pf.columns(table, "px", "py", "pz")
        expected = flown_in_python(Policy.load(path), 3.0)
        self.assertGreater(np.linalg.norm(expected[-1] - expected[0]), 1.0)
        for i, position in enumerate(expected):
            row = np.argmin(np.abs(table["time"] - 0.1 * (i + 1)))
            np.testing.assert_allclose(places[row], position, atol=0.03)
        self.assertLess(np.linalg.norm(places[-1] - GOAL), 1.5)

    def test_that_faces_its_goal_flies_turned_situations_alike(self) -> None:
        random = np.random.default_rng(2)
        image = random.uniform(0, 1, (6, 3, 12)).astype(np.float32)
        state = random.uniform(-0.5, 0.5, (6, 15)).astype(np.float32)
        bearing = random.uniform(-0.2, 0.2, 6)
        state[:, 0], state[:, 1] = np.cos(bearing), np.sin(bearing)
        policy = Policy.load(policy_file(LIDAR, faces_goal=True))
        ahead = policy({"range": image, "state": state})
        plain = Policy.load(policy_file(LIDAR))({"range": image, "state": state})
        np.testing.assert_array_equal(ahead, plain)
        by = np.arange(6) * np.radians(30)  # to the left, whole columns
        turn = np.stack([np.cos(by), np.sin(by)], 1).astype(np.float32)
        elsewhere = state.copy()
        for x in (0, 4, 7, 11):
            elsewhere[:, x : x + 2] = turned(state[:, x : x + 2], turn)
        rolled = np.stack([np.roll(image[k], -k, 1) for k in range(6)])
        seen, found = facing_goal({"range": rolled, "state": elsewhere})
        np.testing.assert_allclose(found, turn, atol=1e-6)
        np.testing.assert_array_equal(seen["range"], image)
        np.testing.assert_allclose(policy({"range": rolled, "state": elsewhere}), turned(ahead, turn), atol=1e-5)
        with self.assertRaisesRegex(ValueError, "full circle"):
            Policy(policy.layers, {**policy.about, "lidar": LIDAR._replace(azimuth=(-1.0, 1.0))._asdict()})

    def test_environments_that_face_the_goal(self) -> None:
        env = VectorEnv(room(), 6, task=Goal(distance=(1, 3), clearance=0.4), lidar=LIDAR, autoreset="same_step")
        facing = FacingGoal(VectorEnv(room(), 6, task=Goal(distance=(1, 3), clearance=0.4), lidar=LIDAR,
                                      autoreset="same_step"))  # fmt: skip
        seen, plain = facing.reset(seed=1)[0], env.reset(seed=1)[0]
        self.assertTrue(facing.about()["faces_goal"] and facing.num_envs == 6)
        finals = 0
        for _ in range(60):
            turn = facing_goal(plain)[1]
            action = np.pad(0.9 * straight(seen)[:, :3], ((0, 0), (0, 1)))
            seen, reward, terminated, _, infos = facing.step(action)
            plain, expected, ended, _, others = env.step(turned(action, turn))
            np.testing.assert_array_equal(reward, expected)
            np.testing.assert_array_equal(seen["state"], facing_goal(plain)[0]["state"])
            self.assertTrue((np.abs(np.arctan2(seen["state"][:, 1], seen["state"][:, 0])) < np.radians(15.1)).all())
            for i in np.flatnonzero(infos.get("_final_obs", ())):
                last = {name: values[None] for name, values in others["final_obs"][i].items()}
                np.testing.assert_array_equal(infos["final_obs"][i]["range"], facing_goal(last)[0]["range"][0])
                finals += 1
        self.assertGreater(finals, 0)
        with self.assertRaisesRegex(ValueError, "full circle"):
            FacingGoal(VectorEnv(room(), 1, task=Goal(distance=(1, 3), clearance=0.4), lidar=None))

    def test_without_ranges(self) -> None:
        room()
        path = scenario_file(lidars=[])
        result = run("fly", path, "--policy", policy_file(None), "-o", path_of("blind_run"), "--no-picture", "--force")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("pilot reached 1 of 1 goals", result.stderr)

    def test_what_cannot_be_flown_is_said(self) -> None:
        room()
        path = policy_file()
        for changes, policy, words in (
            ({"mission": {}}, path, "no waypoints to fly to"),
            ({"lidars": []}, path, "has no LiDAR"),
            ({}, path_of("room.pfmap"), "is no zip archive"),
            ({}, path_of("missing.npz"), "missing.npz"),
        ):
            scenario = scenario_file(**changes)
            result = run("fly", scenario, "--policy", policy, "-o", path_of("none"), "--no-picture", "--force")
            self.assertEqual(result.returncode, 2, words)
            self.assertIn(words, result.stderr)
            self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)


if __name__ == "__main__":
    unittest.main()

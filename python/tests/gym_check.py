"""Gymnasium's rules, as its own checker has them (gymnasium.utils.env_checker and its vector environments)."""

import unittest
from typing import Any, Callable

import numpy as np


def same(a: Any, b: Any) -> bool:
    """Bit for bit, of arrays within dicts."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))
    if isinstance(a, np.ndarray) and a.dtype == object:
        return all((x is None) == (y is None) and (x is None or same(x, y)) for x, y in zip(a, b))
    return np.asarray(a).tobytes() == np.asarray(b).tobytes()


def check_env(test: unittest.TestCase, make: Callable[[], Any]) -> None:
    """One environment."""
    env = make()
    seen, info = env.reset(seed=123)
    test.assertIsInstance(info, dict)
    test.assertTrue(env.observation_space.contains(seen), seen)
    again, _ = env.reset(seed=123)
    other, _ = env.reset(seed=456)
    following, _ = env.reset()
    test.assertTrue(same(seen, again))
    test.assertFalse(same(seen, other))
    test.assertFalse(same(other, following))
    env.reset(seed=1, options={})
    env.action_space.seed(5)
    action = env.action_space.sample()
    test.assertTrue(env.action_space.contains(action))
    twin = make()
    for one in (env, twin):
        one.reset(seed=7)
    for _ in range(30):
        ours, theirs = env.step(action), twin.step(action)
        test.assertEqual(len(ours), 5)
        for a, b in zip(ours, theirs):
            test.assertTrue(same(a, b))
        observation, reward, terminated, truncated, info = ours
        test.assertTrue(env.observation_space.contains(observation))
        test.assertIs(type(reward), float)
        test.assertIs(type(terminated), bool)
        test.assertIs(type(truncated), bool)
        test.assertIsInstance(info, dict)
        if terminated or truncated:
            break
    test.assertIn("render_modes", env.metadata)
    env.close()
    env.close()


def check_vector(test: unittest.TestCase, make: Callable[[str, int], Any]) -> None:
    """Three modes of many environments beside each other: the same episodes."""
    runs = {mode: make(mode, 8) for mode in ("next_step", "same_step", "disabled")}
    firsts = {mode: env.reset(seed=3)[0] for mode, env in runs.items()}
    test.assertTrue(same(firsts["next_step"], firsts["same_step"]))
    random = np.random.default_rng(2)
    env = runs["next_step"]
    test.assertTrue(env.observation_space.contains(firsts["next_step"]))
    test.assertEqual(env.action_space.shape, (8, *env.single_action_space.shape))
    ends = 0
    waiting = np.zeros(8, bool)
    for _ in range(60):
        actions = random.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        # the one that begins anew within the step is given what the others get a step later: keep them in step
        observation, reward, terminated, truncated, infos = runs["same_step"].step(actions)
        ended = terminated | truncated
        free, f_reward, f_terminated, f_truncated, _ = runs["disabled"].step(actions)
        test.assertTrue(same(reward, f_reward))
        test.assertTrue(same(terminated, f_terminated) and same(truncated, f_truncated))
        test.assertEqual(reward.dtype, np.float64)
        test.assertEqual((terminated.dtype, terminated.shape), (np.dtype(bool), (8,)))
        for i in np.flatnonzero(ended):
            ends += 1
            last = {name: values[i] for name, values in free.items()}
            test.assertTrue(same(infos["final_obs"][i], last))
            test.assertTrue(infos["_final_obs"][i])
        if ended.any():
            begun, _ = runs["disabled"].reset(options={"reset_mask": ended})
            test.assertTrue(same(observation, begun))
        else:
            test.assertNotIn("final_obs", infos)
    test.assertGreater(ends, 2)
    # the action of the step after an end is ignored
    for _ in range(60):
        before = waiting
        observation, reward, terminated, truncated, _ = env.step(random.uniform(-1, 1, env.action_space.shape))
        test.assertFalse((before & (terminated | truncated)).any())
        test.assertTrue((reward[before] == 0).all())
        waiting = terminated | truncated
    for env in runs.values():
        env.close()

"""How well a pilot does: `evaluate`."""

from __future__ import annotations

import math
from typing import NamedTuple, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from .pilots import Pilot
from .tasks import Floats
from .vector import VectorEnv



class Score(NamedTuple):
    """What came of some flights, each on a seed of its own."""

    flights: int
    """"""
    arrived: int
    """Reached the goal without touching anything; of tasks without goals: flew until the time was up."""
    collided: int
    """"""
    late: int
    """Neither."""
    interval: Tuple[float, float]
    """Of the share that arrives: Wilson's, 95 %."""
    seconds: float
    """Mean of those that arrived."""
    reward: float
    """Mean sum of an episode."""

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"{self.arrived} of {self.flights} arrive ({100 * low:.0f} to {100 * high:.0f} %), "
            f"{self.collided} collide, {self.seconds:.1f} s, reward {self.reward:.2f}"
        )


def wilson(hits: int, count: int, z: float = 1.96) -> Tuple[float, float]:
    """Interval of a share (Wilson, JASA 22, 1927)."""
    share = hits / count
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return middle - half, middle + half


def evaluate(env: VectorEnv, pilot: Pilot, seeds: Sequence[int]) -> Score:
    """One flight on each seed; the environment has as many vehicles or teams as there are seeds. A team counts once."""
    count, teams = env.num_envs, env.num_envs // env.team
    if len(seeds) != teams:
        raise ValueError(f"seeds: {teams} are wanted, one for each environment")
    seen, _ = env.reset(seed=[int(seed) for seed in seeds for _ in range(env.team)])
    over = np.zeros(count, bool)
    arrived, collided = np.zeros(count, bool), np.zeros(count, bool)
    seconds, rewards = np.zeros(count), np.zeros(count)
    while not over.all():
        seen, reward, terminated, truncated, infos = env.step(pilot(seen))
        seconds[~over] += env.action_period
        rewards[~over] += reward[~over]
        now = (terminated | truncated) & ~over
        arrived |= infos.get("reached", ~terminated) & now
        collided |= infos.get("collided", np.zeros(count, bool)) & now
        over |= now
    arrived, collided = arrived[:: env.team], collided.reshape(teams, -1).any(1)
    there, hit = int(arrived.sum()), int(collided.sum())
    mean = float(seconds[:: env.team][arrived].mean()) if there else math.nan
    return Score(teams, there, hit, teams - there - hit, wilson(there, teams), mean, float(rewards.mean()))


def advantages(
    rewards: Floats, values: NDArray[np.float32], ends: NDArray[np.bool_], gamma: float, share: float
) -> NDArray[np.float32]:
    """(t, n) of rewards (t, n), values (t + 1, n) and whether an episode has ended with the step (t, n): generalised
    advantages (Schulman et al., arXiv 1506.02438), share: its lambda."""
    live = gamma * ~ends
    errors = rewards + live * values[1:] - values[:-1]
    found = np.zeros_like(errors)
    later = np.zeros(errors.shape[1])
    for t in reversed(range(len(errors))):
        found[t] = later = errors[t] + share * live[t] * later
    return found.astype(np.float32)

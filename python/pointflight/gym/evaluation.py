"""How well a pilot does: `evaluate`, and a pilot that was not learned."""

from __future__ import annotations

import math
from typing import Callable, Dict, NamedTuple, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from .vector import Observation, VectorEnv

Pilot = Callable[[Observation], NDArray[np.float32]]


class Score(NamedTuple):
    """What came of some flights, each on a seed of its own."""

    flights: int
    """"""
    arrived: int
    """Reached the goal without touching anything."""
    collided: int
    """"""
    late: int
    """Neither, when the time was up."""
    interval: Tuple[float, float]
    """Of the share that arrives: Wilson's, 95 %."""
    seconds: float
    """Mean of those that arrived."""


def wilson(hits: int, count: int, z: float = 1.96) -> Tuple[float, float]:
    """Interval of a share (Wilson, JASA 22, 1927)."""
    share = hits / count
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return middle - half, middle + half


def evaluate(env: VectorEnv, pilot: Pilot, seeds: Sequence[int]) -> Score:
    """One flight on each seed. The environment's task is `Goal`, its number that of the seeds."""
    if len(seeds) != env.num_envs:
        raise ValueError(f"seeds: {env.num_envs} are wanted, one for each environment")
    seen, _ = env.reset(seed=list(seeds))
    over = np.zeros(env.num_envs, bool)
    ends: Dict[str, NDArray[np.bool_]] = {name: np.zeros(env.num_envs, bool) for name in ("reached", "collided")}
    seconds = np.zeros(env.num_envs)
    while not over.all():
        seen, _, terminated, truncated, infos = env.step(pilot(seen))
        seconds[~over] += env.action_period
        now = (terminated | truncated) & ~over
        for name, values in ends.items():
            values |= infos[name] & now
        over |= now
    arrived, collided = int(ends["reached"].sum()), int(ends["collided"].sum())
    mean = float(seconds[ends["reached"]].mean()) if arrived else math.nan
    late = env.num_envs - arrived - collided
    return Score(env.num_envs, arrived, collided, late, wilson(arrived, env.num_envs), mean)


def reactive(env: VectorEnv, speed: float = 0.5) -> Pilot:
    """A hand-made pilot: of 72 level ways that are 0.6 m free on both sides for 3 m, the one nearest to the goal, at a
    share of the full speed. It looks at all beams as if they were level, so give it few rows near the horizon."""
    lidar = env.lidar
    if lidar is None:
        raise ValueError("reactive: it flies by ranges")
    range_max = lidar.range_max
    left, right = lidar.azimuth[1], lidar.azimuth[0]
    columns = left - (left - right) * (np.arange(lidar.columns) + 0.5) / lidar.columns
    azimuth = np.broadcast_to(columns, (lidar.rows, lidar.columns)).reshape(-1)
    ways = np.arange(72) * 2 * np.pi / 72

    def pilot(seen: Observation) -> NDArray[np.float32]:
        s = seen["state"]
        ranges = seen["range"].reshape(len(s), -1) * range_max
        to_goal = np.arctan2(s[:, 1], s[:, 0])
        half = np.arcsin(np.minimum(1.0, 0.6 / np.maximum(ranges, 1e-3)))
        free = np.full((len(s), 72), 20.0)
        for k, way in enumerate(ways):
            off = np.abs((azimuth[None, :] - way + np.pi) % (2 * np.pi) - np.pi)
            in_way = (off <= half) & (ranges < 0.999 * range_max)
            free[:, k] = np.where(in_way, ranges, 20.0).min(1)
        toward = np.cos(ways[None, :] - to_goal[:, None])
        toward[free < np.minimum(3.0, s[:, 2:3] * 30.0)] = -2.0
        best = toward.argmax(1)
        moving = speed * (toward.max(1) > -2.0)
        climb = np.clip(s[:, 3] * 3.0, -1.0, 1.0) * 0.3
        ahead, left_of = np.cos(ways[best]) * moving, np.sin(ways[best]) * moving
        actions: NDArray[np.float32] = np.stack([ahead, left_of, climb, 0 * climb], 1).astype(np.float32)
        return actions

    return pilot

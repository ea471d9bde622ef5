"""Pilots that were not learned, to compare policies with: one for each task."""

from __future__ import annotations

from typing import Callable

import numpy as np
from numpy.typing import NDArray

from .images import Lidar, Observation
from .vector import VectorEnv

Actions = NDArray[np.float32]
Pilot = Callable[[Observation], Actions]


def straight(observation: Observation) -> Actions:
    """(n, 4): the straight way to the goal at full speed, without turning. For tasks with a goal."""
    s = observation["state"]
    way = np.stack([s[:, 0] * s[:, 2] * 30.0, s[:, 1] * s[:, 2] * 30.0, s[:, 3] * 3.0, 0.0 * s[:, 0]], 1)
    unit: Actions = way / np.maximum(np.sqrt((way * way).sum(1, keepdims=True)), 1e-6)
    return unit


def hold(observation: Observation) -> Actions:
    """(n, 4): back to where it should hover, at a speed by how far off it is. For `Hover`."""
    s = observation["state"]
    actions: Actions = np.concatenate([np.clip(1.5 * s[:, 0:3], -1.0, 1.0), 0.0 * s[:, :1]], 1)
    return actions


def in_formation(observation: Observation, actions: int = 4) -> Actions:
    """(n, 4): straight at two thirds of full speed, and back to its place in the square. For `Formation`."""
    s = observation["state"]
    back = np.concatenate([s[:, 11 + actions : 14 + actions], 0.0 * s[:, :1]], 1)
    flown: Actions = np.clip(0.66 * straight(observation) - 0.5 * back, -1.0, 1.0)
    return flown


def reactive(env: VectorEnv, speed: float = 0.5) -> Pilot:
    """Of 72 level ways that are 0.6 m free on both sides for 3 m, the one nearest to the goal, at a share of the full
    speed. It looks at all beams as if they were level, so give it few rows near the horizon."""
    free_ways = _free_ways(env)

    def pilot(seen: Observation) -> Actions:
        s = seen["state"]
        free = free_ways(seen)
        toward = np.cos(_WAYS[None, :] - np.arctan2(s[:, 1], s[:, 0])[:, None])
        toward[free < np.minimum(3.0, s[:, 2:3] * 30.0)] = -2.0
        return _along(toward, speed, np.clip(s[:, 3] * 3.0, -1.0, 1.0) * 0.3)

    return pilot


def wander(env: VectorEnv, speed: float = 0.5) -> Pilot:
    """The free way that is nearest to the one it flies along now, at a share of the full speed. For `Explore`."""
    free_ways = _free_ways(env)

    def pilot(seen: Observation) -> Actions:
        s = seen["state"]
        toward = np.cos(_WAYS[None, :] - np.arctan2(s[:, 1], s[:, 0])[:, None])
        toward[free_ways(seen) < 3.0] = -2.0
        return _along(toward, speed, -s[:, 2])

    return pilot


_WAYS = np.arange(72) * 2 * np.pi / 72


def _along(toward: NDArray[np.float32], speed: float, climb: NDArray[np.float32]) -> Actions:
    """The best way of each row; stands if none is free."""
    best = toward.argmax(1)
    moving = speed * (toward.max(1) > -2.0)
    ahead, left_of = np.cos(_WAYS[best]) * moving, np.sin(_WAYS[best]) * moving
    actions: Actions = np.stack([ahead, left_of, climb, 0 * climb], 1).astype(np.float32)
    return actions


def _free_ways(env: VectorEnv) -> Callable[[Observation], NDArray[np.float32]]:
    """(n, 72): how far one can fly along each way with 0.6 m on both sides, m, 20 at most."""
    lidar = env.lidar
    if lidar is None:
        raise ValueError("this pilot flies by ranges: lidar")
    azimuth, range_max = _azimuths(lidar), lidar.range_max

    def free_ways(seen: Observation) -> NDArray[np.float32]:
        ranges = seen["range"].reshape(len(seen["range"]), -1) * range_max
        half = np.arcsin(np.minimum(1.0, 0.6 / np.maximum(ranges, 1e-3)))
        free = np.full((len(ranges), 72), 20.0, np.float32)
        for k, way in enumerate(_WAYS):
            off = np.abs((azimuth[None, :] - way + np.pi) % (2 * np.pi) - np.pi)
            in_way = (off <= half) & (ranges < 0.999 * range_max)
            free[:, k] = np.where(in_way, ranges, 20.0).min(1)
        return free

    return free_ways


def _azimuths(lidar: Lidar) -> NDArray[np.float64]:
    """(cells,)"""
    left, right = lidar.azimuth[1], lidar.azimuth[0]
    columns = left - (left - right) * (np.arange(lidar.columns) + 0.5) / lidar.columns
    return np.broadcast_to(columns, (lidar.rows, lidar.columns)).reshape(-1)

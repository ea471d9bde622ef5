"""What is to be learned: `Goal`, `Race`, `Explore`, `Hover` (courses.py: `Corridor`, `Formation`). Derive `Task` for
your own.

All arrays have a row for each environment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, List, NamedTuple, Set, Tuple

import numpy as np
from numpy.typing import NDArray

from .draws import draws

if TYPE_CHECKING:
    from .vector import VectorEnv

Floats = NDArray[np.float64]


class Outcome(NamedTuple):
    """What came of an action."""

    reward: Floats
    """(n,)"""
    terminated: NDArray[np.bool_]
    """(n,): crashed, or done."""
    info: Dict[str, NDArray[Any]]
    """Whatever else is of interest, a row for each environment."""


class States:
    """The true states of all vehicles: views of columns (n, k)."""

    def __init__(self, table: Floats) -> None:
        self.position = table[:, 0:3]
        """m, world."""
        self.velocity = table[:, 3:6]
        """m/s, world."""
        self.orientation = table[:, 6:10]
        """x, y, z, w."""
        self.angular_velocity = table[:, 10:13]
        """rad/s, body."""
        self.heading = table[:, 13:15]
        """Cosine and sine of the heading that actions are in."""
        self.clearance = table[:, 15]
        """(n,): least distance of the hull to the map since the last action, m, 1.5 at most."""
        self.flown = table[:, 16]
        """(n,): m since the start."""
        self.collided = table[:, 17] != 0
        """(n,)"""

    def level(self, vectors: Floats) -> Floats:
        """Vectors of the world (n, 3) ahead, left and up in the heading's frame."""
        c, s = self.heading[:, 0], self.heading[:, 1]
        x, y = vectors[:, 0], vectors[:, 1]
        return np.stack([c * x + s * y, c * y - s * x, vectors[:, 2]], 1)

    def tilt(self) -> Floats:
        """(n, 2): the world's z along the body's x and y."""
        x, y, z, w = self.orientation.T
        return np.stack([2 * (x * z - y * w), 2 * (y * z + x * w)], 1)


def lengths(vectors: Floats) -> Floats:
    """(n,) of (n, 2) or (n, 3)."""
    square = vectors[:, 0] * vectors[:, 0]
    for k in range(1, vectors.shape[1]):
        square = square + vectors[:, k] * vectors[:, k]
    return np.sqrt(square)


class Task:
    """Places vehicles, says what policies know of them, rewards them and ends episodes."""

    time_limit = 20.0
    """s; then an episode is truncated."""
    state_size = 0
    """Numbers of one state."""
    team = 1
    """Vehicles that do it together."""

    def begin(self, env: "VectorEnv") -> None:
        """Once, before anything else."""

    def reset(self, env: "VectorEnv", which: NDArray[np.uint32]) -> None:
        """Places these vehicles (`env.place`); draws are `env.draws(which, count)`."""
        raise NotImplementedError

    def state(self, env: "VectorEnv") -> Floats:
        """(n, state_size): what policies know besides ranges."""
        raise NotImplementedError

    def judge(self, env: "VectorEnv", change: Floats) -> Outcome:
        """After an action. change: (n,), the squared difference of the actions to the ones before. What is said of
        those that stood still (`env.moved`) does not count."""
        raise NotImplementedError


class Goal(Task):
    """Fly to a goal 20 to 30 m away without touching anything.

    state (11 + actions): direction to the goal in the heading's frame (2); its horizontal distance / 30 m and height /
    3 m, both at most 1; velocity in that frame / 3 m/s (3); tilt (2); share of the time that is gone; 2 m / horizontal
    distance, at most 1; the last action.
    """

    def __init__(
        self,
        *,
        distance: Tuple[float, float] = (20.0, 30.0),
        height: Tuple[float, float] = (1.5, 3.0),
        clearance: float = 1.0,
        radius: float = 1.0,
        time_limit: float = 20.0,
    ) -> None:
        """distance: from start to goal, horizontal, m. height: of both above ground, m. clearance: of both, m. radius:
        the goal is reached within it, m."""
        self.distance, self.height, self.clearance, self.radius = distance, height, clearance, radius
        self.time_limit = time_limit

    def begin(self, env: "VectorEnv") -> None:
        self.state_size = 11 + env.single_action_space.shape[0]
        self.goal = np.zeros((env.num_envs, 3))
        self.away = np.zeros(env.num_envs)
        self._checked: Set[int] = set()

    def reset(self, env: "VectorEnv", which: NDArray[np.uint32]) -> None:
        start, goal = self._ends(env, which)
        env.place(which, start, goal)
        self.goal[which] = goal
        self.away[which] = lengths(goal - start)

    def _ends(self, env: "VectorEnv", which: NDArray[np.uint32]) -> Tuple[Floats, Floats]:
        """Starts and goals (m, 3) that these environments draw."""
        u = env.draws(which, 1 + self._tries)
        for _, places in env.places(which, self.height, self.clearance):
            self._check(places)
        start = env.positions(which, u[:, 0], self.height, self.clearance)
        return start, self._goals(env, which, start, u[:, 1:])

    _tries = 64

    def _goals(self, env: "VectorEnv", which: NDArray[np.uint32], start: Floats, u: Floats) -> Floats:
        """(m, 3): of the positions that u (m, tries) draws the first that is as far away as it should be, else the
        nearest to that."""
        goal = np.empty((len(which), 3))
        for rows, places in env.places(which, self.height, self.clearance):
            candidates = places[(u[rows] * len(places)).astype(np.int64)]
            apart = candidates[:, :, :2] - start[rows][:, None, :2]
            d = np.sqrt(apart[:, :, 0] * apart[:, :, 0] + apart[:, :, 1] * apart[:, :, 1])
            off = np.maximum(np.maximum(self.distance[0] - d, d - self.distance[1]), 0.0)
            goal[rows] = candidates[np.arange(len(off)), off.argmin(1)]
        return goal

    def _check(self, places: Floats) -> None:
        if id(places) in self._checked:
            return
        some = places[:256, None, :2] - places[None, :256, :2]
        d = np.sqrt(some[:, :, 0] * some[:, :, 0] + some[:, :, 1] * some[:, :, 1])
        if not ((d >= self.distance[0]) & (d <= self.distance[1])).any():
            raise ValueError(
                f"distance: no two free positions are {self.distance[0]} to {self.distance[1]} m apart, "
                f"{d.max():.1f} m at most"
            )
        self._checked.add(id(places))

    def state(self, env: "VectorEnv") -> Floats:
        return self.state_of(env.states, self.goal, env.elapsed, env.last_actions)

    def state_of(self, s: States, goal: Floats, elapsed: Floats, last_actions: Floats) -> Floats:
        """(n, state_size): the same of any vehicles, for flights outside of an environment."""
        to_goal = s.level(goal - s.position)
        flat = np.maximum(lengths(to_goal[:, :2]), 1e-6)
        return np.concatenate(
            [
                to_goal[:, :2] / flat[:, None],
                np.minimum(flat, 30.0)[:, None] / 30.0,
                np.clip(to_goal[:, 2:] / 3.0, -1.0, 1.0),
                s.level(s.velocity) / 3.0,
                s.tilt(),
                elapsed[:, None] / self.time_limit,
                np.minimum(1.0, 2.0 / flat)[:, None],
                last_actions,
            ],
            1,
        )

    def judge(self, env: "VectorEnv", change: Floats) -> Outcome:
        s = env.states
        away = lengths(self.goal - s.position)
        progress, self.away = self.away - away, away
        reached = ~s.collided & (away < self.radius)
        reward = 0.5 * progress - 0.02 * change - 0.4 * np.maximum(0.0, 0.45 - s.clearance) - 0.02
        reward = reward - 5.0 * s.collided + 5.0 * reached
        info = {"reached": reached, "collided": s.collided, "clearance": s.clearance.copy(), "flown": s.flown.copy()}
        return Outcome(reward, s.collided | reached, info)


class Race(Goal):
    """Goals one after the other, each 8 to 15 m from the one before: all of them, as quickly as it can.

    The state is that of `Goal`, so that its policies race as well.
    """

    def __init__(
        self,
        *,
        goals: int = 5,
        distance: Tuple[float, float] = (8.0, 15.0),
        height: Tuple[float, float] = (1.5, 3.0),
        clearance: float = 1.0,
        radius: float = 1.0,
        time_limit: float = 40.0,
    ) -> None:
        """goals: how many. The rest as of `Goal`."""
        if goals < 1:
            raise ValueError(f"goals: 1 or more, not {goals}")
        super().__init__(
            distance=distance, height=height, clearance=clearance, radius=radius, time_limit=time_limit
        )
        self.goals = goals

    def begin(self, env: "VectorEnv") -> None:
        super().begin(env)
        self.passed = np.zeros(env.num_envs, np.int64)

    def reset(self, env: "VectorEnv", which: NDArray[np.uint32]) -> None:
        super().reset(env, which)
        self.passed[which] = 0

    def judge(self, env: "VectorEnv", change: Floats) -> Outcome:
        reward, terminated, info = super().judge(env, change)
        reached = info["reached"] & env.moved
        self.passed = self.passed + reached
        finished = self.passed >= self.goals
        on = np.flatnonzero(reached & ~finished).astype(np.uint32)
        if len(on):
            # the next goal's draws follow those of the ones before
            u = env.draws(on, 1 + self._tries * self.goals)
            at = 1 + self._tries * self.passed[on]
            rows = u[np.arange(len(on))[:, None], at[:, None] + np.arange(self._tries)[None, :]]
            self.goal[on] = self._goals(env, on, self.goal[on], rows)
            self.away[on] = lengths(self.goal[on] - env.states.position[on])
        info = {**info, "reached": finished & reached, "passed": self.passed.copy()}
        return Outcome(reward - 0.03, info["collided"] | finished, info)


class Explore(Task):
    """See as much as there is: each cell that a beam hits for the first time counts.

    state (6 + actions): velocity in the heading's frame / 3 m/s (3), tilt (2), share of the time that is gone, the last
    action. Cells are counted by the ranges that policies see, so a LiDAR is needed.
    """

    def __init__(
        self,
        *,
        cell: float = 1.0,
        height: Tuple[float, float] = (1.5, 3.0),
        clearance: float = 1.0,
        time_limit: float = 40.0,
    ) -> None:
        """cell: its side, m."""
        self.cell, self.height, self.clearance, self.time_limit = cell, height, clearance, time_limit

    def begin(self, env: "VectorEnv") -> None:
        if env.lidar is None:
            raise ValueError("Explore: a LiDAR is needed")
        self.state_size = 6 + env.single_action_space.shape[0]
        self.cells = np.zeros(env.num_envs, np.int64)
        self._seen: List[NDArray[np.int64]] = [np.zeros(0, np.int64)] * env.num_envs

    def reset(self, env: "VectorEnv", which: NDArray[np.uint32]) -> None:
        u = env.draws(which, 4)
        start = env.positions(which, u[:, 0], self.height, self.clearance)
        env.place(which, start, start + 2.0 * u[:, 1:4] - 1.0)
        self.cells[which] = 0
        for i in which:
            self._seen[i] = np.zeros(0, np.int64)

    def state(self, env: "VectorEnv") -> Floats:
        s = env.states
        return np.concatenate(
            [s.level(s.velocity) / 3.0, s.tilt(), env.elapsed[:, None] / self.time_limit, env.last_actions], 1
        )

    def judge(self, env: "VectorEnv", change: Floats) -> Outcome:
        s = env.states
        found = np.zeros(env.num_envs, np.int64)
        points, hit = env.points()
        numbers = np.floor(points / self.cell).astype(np.int64) + (1 << 20)
        keys = (numbers[..., 0] << 42) | (numbers[..., 1] << 21) | numbers[..., 2]
        for i in range(env.num_envs):
            now = np.union1d(self._seen[i], keys[i][hit[i]])
            found[i], self._seen[i] = len(now) - len(self._seen[i]), now
        self.cells = self.cells + found
        reward = 0.02 * found - 0.02 * change - 0.4 * np.maximum(0.0, 0.45 - s.clearance) - 5.0 * s.collided
        return Outcome(reward, s.collided, {"collided": s.collided, "found": found, "cells": self.cells.copy()})


class Hover(Task):
    """Stay within reach of a position from which it was displaced, and keep still.

    state (9 + actions): the position's offset in the heading's frame / 3 m (3), velocity in it / 3 m/s (3), tilt (2),
    share of the time that is gone, the last action.
    """

    def __init__(
        self,
        *,
        displacement: float = 1.0,
        height: Tuple[float, float] = (1.5, 3.0),
        clearance: float = 2.5,
        time_limit: float = 10.0,
    ) -> None:
        """displacement: of the start along each axis, at most, m."""
        self.displacement, self.height, self.clearance = displacement, height, clearance
        self.time_limit = time_limit

    def begin(self, env: "VectorEnv") -> None:
        self.state_size = 9 + env.single_action_space.shape[0]
        self.target = np.zeros((env.num_envs, 3))

    def reset(self, env: "VectorEnv", which: NDArray[np.uint32]) -> None:
        u = env.draws(which, 6)
        target = env.positions(which, u[:, 0], self.height, self.clearance)
        start = target + self.displacement * (2.0 * u[:, 1:4] - 1.0)
        facing = start + 2.0 * u[:, 3:6] - 1.0
        env.place(which, start, facing)
        self.target[which] = target

    def state(self, env: "VectorEnv") -> Floats:
        s = env.states
        return np.concatenate(
            [
                s.level(self.target - s.position) / 3.0,
                s.level(s.velocity) / 3.0,
                s.tilt(),
                env.elapsed[:, None] / self.time_limit,
                env.last_actions,
            ],
            1,
        )

    def judge(self, env: "VectorEnv", change: Floats) -> Outcome:
        s = env.states
        off = lengths(self.target - s.position)
        lost = s.collided | (off > 3.0 * self.displacement + 1.0)
        reward = 1.0 / (1.0 + off * off) - 0.02 * change - 0.05 * lengths(s.velocity) - 10.0 * lost
        return Outcome(reward, lost, {"collided": s.collided, "off": off})

"""Tasks along a course and in a team: `Corridor`, `Formation`; and `TASKS`, all by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple, Type

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .tasks import Explore, Floats, Goal, Hover, Outcome, Race, Task, lengths

if TYPE_CHECKING:
    from .vector import VectorEnv


class Corridor(Goal):
    """Fly along a course from corner to corner as quickly as it can, without leaving the corridor around it.

    state (13 + actions): that of `Goal` for the next corner, then how far it is off the line of the leg, to the left
    and up, as a share of half the corridor's width.
    """

    def __init__(
        self,
        course: Optional[ArrayLike] = None,
        *,
        width: float = 4.0,
        corners: int = 3,
        length: float = 100.0,
        clearance: float = 1.0,
        radius: float = 1.0,
        time_limit: float = 40.0,
    ) -> None:
        """course: corners (k, 3), world, m; without one, a tour of each map (`Map.tour`) of at least `length` m that is
        free by `clearance`. width: of the corridor, m. corners: how many are passed in an episode, from one of the
        course on; the goal is the last. radius: a corner is passed within it, m."""
        super().__init__(clearance=clearance, radius=radius, time_limit=time_limit)
        self.width, self.corners, self.length = width, corners, length
        self.course = None if course is None else np.asarray(course, dtype=np.float64)
        if corners < 1 or (self.course is not None and (self.course.ndim != 2 or self.course.shape[1] != 3)):
            raise ValueError("Corridor: a course (k, 3), and 1 corner or more")

    def begin(self, env: "VectorEnv") -> None:
        super().begin(env)
        self.state_size += 2
        self._courses: List[Floats] = []
        for place in env.maps:
            course = self.course
            if course is None:
                course = place.tour(length=self.length, margin=self.clearance - 0.3)
            if len(course) <= self.corners:
                raise ValueError(f"{place!r}: {self.corners} corners after a start are wanted, not {len(course)}")
            self._courses.append(course)
        self._next = np.zeros(env.num_envs, np.int64)
        self._last = np.zeros(env.num_envs, np.int64)
        self._from = np.zeros((env.num_envs, 3))

    def reset(self, env: "VectorEnv", which: NDArray[np.uint32]) -> None:
        u = env.draws(which, 1)[:, 0]
        for k, rows in env.maps_of(which):
            course, own = self._courses[k], which[rows]
            first = (u[rows] * (len(course) - self.corners)).astype(np.int64)
            self._next[own], self._last[own] = first + 1, first + self.corners
            self._from[own], self.goal[own] = course[first], course[first + 1]
        env.place(which, self._from[which], self.goal[which])
        self.away[which] = lengths(self.goal[which] - self._from[which])

    def state(self, env: "VectorEnv") -> Floats:
        return np.concatenate([super().state(env), self._off(env) / (0.5 * self.width)], 1)

    def _off(self, env: "VectorEnv") -> Floats:
        """(n, 2): m off the leg's line, to the left of its direction and up."""
        leg = self.goal - self._from
        along = leg / np.maximum(lengths(leg), 1e-6)[:, None]
        flat = np.maximum(np.sqrt(along[:, 0] * along[:, 0] + along[:, 1] * along[:, 1]), 1e-6)
        p = env.states.position - self._from
        left = (along[:, 0] * p[:, 1] - along[:, 1] * p[:, 0]) / flat
        ahead = along[:, 0] * p[:, 0] + along[:, 1] * p[:, 1] + along[:, 2] * p[:, 2]
        return np.stack([left, p[:, 2] - ahead * along[:, 2]], 1)

    def judge(self, env: "VectorEnv", change: Floats) -> Outcome:
        off = self._off(env)  # before the next leg begins
        reward, _, info = super().judge(env, change)
        passed = info["reached"] & env.moved
        finished = passed & (self._next >= self._last)
        left = ~passed & (lengths(off) > 0.5 * self.width) & ~info["collided"]
        on = np.flatnonzero(passed & ~finished).astype(np.uint32)
        for k, rows in env.maps_of(on):
            own = on[rows]
            self._next[own] += 1
            self._from[own], self.goal[own] = self.goal[own], self._courses[k][self._next[own]]
            self.away[own] = lengths(self.goal[own] - env.states.position[own])
        info = {**info, "reached": finished, "left": left}
        return Outcome(reward - 5.0 * left - 0.03, info["collided"] | finished | left, info)


class Formation(Goal):
    """Four vehicles fly to a goal as a square, without touching anything or each other.

    Draws, goals and ends are a team's. state (23 + actions): that of `Goal` for the vehicle's own corner; how far it is
    from its place in the square around the middle of all, in its heading's frame, m (3); where the others are in that
    frame / 5 m (9).
    """

    team = 4

    def __init__(
        self,
        *,
        side: float = 2.0,
        distance: Tuple[float, float] = (20.0, 30.0),
        height: Tuple[float, float] = (1.5, 3.0),
        clearance: float = 2.0,
        radius: float = 1.5,
        time_limit: float = 25.0,
    ) -> None:
        """side: of the square, m. clearance: of the start's middle and of the goal, m. The rest as of `Goal`."""
        super().__init__(
            distance=distance, height=height, clearance=clearance, radius=radius, time_limit=time_limit
        )
        self.side = side

    def begin(self, env: "VectorEnv") -> None:
        if env.team != self.team:
            raise ValueError(f"Formation: teams of {self.team} are wanted, not of {env.team}")
        super().begin(env)
        self.state_size += 12
        self._corner = np.zeros((env.num_envs, 3))

    def reset(self, env: "VectorEnv", which: NDArray[np.uint32]) -> None:
        start, goal = self._ends(env, which)
        way = goal - start
        ahead = way[:, :2] / np.maximum(lengths(way[:, :2]), 1e-6)[:, None]
        member = which % self.team
        x = np.where(member < 2, 0.5, -0.5) * self.side
        y = np.where(member % 2 == 0, 0.5, -0.5) * self.side
        corner = np.zeros((len(which), 3))
        corner[:, 0] = ahead[:, 0] * x - ahead[:, 1] * y
        corner[:, 1] = ahead[:, 1] * x + ahead[:, 0] * y
        env.place(which, start + corner, goal + corner)
        self._corner[which] = corner
        self.goal[which] = goal + corner
        self.away[which] = lengths(goal - start)

    def _middle(self, positions: Floats) -> Floats:
        """(n, 3): of each vehicle's team."""
        of_teams = positions.reshape(-1, self.team, 3)
        middle = (of_teams[:, 0] + of_teams[:, 1] + of_teams[:, 2] + of_teams[:, 3]) * 0.25
        return np.repeat(middle, self.team, 0)

    def state(self, env: "VectorEnv") -> Floats:
        s = env.states
        off = s.level(s.position - self._middle(s.position) - self._corner)
        n = env.num_envs
        member = np.arange(n)
        others = [s.position[member - member % self.team + (member + k) % self.team] for k in (1, 2, 3)]
        seen = [s.level(other - s.position) / 5.0 for other in others]
        return np.concatenate([super().state(env), off, *seen], 1)

    def judge(self, env: "VectorEnv", change: Floats) -> Outcome:
        s = env.states
        middle = self._middle(s.position)
        off = lengths(s.position - middle - self._corner)
        reward, _, info = super().judge(env, change)
        reward = reward - 5.0 * info["reached"]  # each by itself, which does not count
        collided = np.repeat(s.collided.reshape(-1, self.team).any(1), self.team)
        reached = ~collided & (lengths(self.goal - self._corner - middle) < self.radius)
        reward = reward + 5.0 * reached - 0.1 * off
        info = {**info, "reached": reached, "collided": collided, "off": off}
        return Outcome(reward, collided | reached, info)


TASKS: Dict[str, Type[Any]] = {
    "goal": Goal,
    "race": Race,
    "corridor": Corridor,
    "explore": Explore,
    "hover": Hover,
    "formation": Formation,
}
"""By name."""

__all__ = ["TASKS", "Corridor", "Formation", "Task"]

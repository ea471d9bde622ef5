"""Goals are always ahead: `facing_goal` and environments that see so."""

from __future__ import annotations

from typing import Any, Dict, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .images import Lidar, Observation
from .vector import VectorEnv

Floats = NDArray[np.float32]


def facing_goal(observation: Observation) -> Tuple[Observation, Floats]:
    """What a vehicle that headed for its goal would see, to the nearest column of an image of the full circle: what is
    learned for a goal ahead serves for one anywhere. And cosines and sines (n, 2) of how far it has been turned to the
    left. For states of `Goal` and `Race`."""
    image, state = observation["range"], observation["state"].copy()
    columns = image.shape[2]
    step = 2.0 * np.pi / columns
    k = np.rint(np.arctan2(state[:, 1], state[:, 0]) / step)
    turn = np.stack([np.cos(k * step), np.sin(k * step)], 1).astype(np.float32)
    back = turn * np.array([1.0, -1.0], np.float32)
    for x in (0, 4, 7, 11):  # direction to the goal, velocity, tilt, last action
        state[:, x : x + 2] = turned(state[:, x : x + 2], back)
    source = (np.arange(columns)[None, :] - k.astype(np.int64)[:, None]) % columns
    return {**observation, "range": np.take_along_axis(image, source[:, None, :], 2), "state": state}, turn


def turned(actions: Floats, turn: Floats) -> Floats:
    """Actions (n, 2 or more), ahead and left first, turned to the left: those for the vehicle as it is of those for the
    one that `facing_goal` sees by."""
    x, y, (cos, sin) = actions[:, 0], actions[:, 1], turn.T
    return np.concatenate([np.stack([cos * x - sin * y, sin * x + cos * y], 1), actions[:, 2:]], 1)


def faces_all(lidar: Optional[Lidar], task: str, action: str) -> bool:
    """If what is seen can be turned."""
    whole = lidar is not None and abs(lidar.azimuth[1] - lidar.azimuth[0] - 2 * np.pi) < 1e-6
    return whole and task in ("goal", "race") and action == "velocity"


class FacingGoal:
    """A `VectorEnv` of `Goal` or `Race`, whose vehicles see and act as if they always headed for their goals. The rest
    is the environment's."""

    def __init__(self, env: VectorEnv) -> None:
        """env: with a LiDAR of the full circle, and velocities as actions."""
        if not faces_all(env.lidar, env.about()["task"], env.action):
            raise ValueError("FacingGoal: the full circle, goal or race, and velocities are wanted")
        self.env = env
        self._turn = np.ones((env.num_envs, 2), np.float32)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.env, name)

    def about(self) -> Dict[str, Any]:
        """`VectorEnv.about`, by which policies do the same by themselves."""
        return {**self.env.about(), "faces_goal": True}

    def reset(
        self, *, seed: Any = None, options: Optional[Mapping[str, Any]] = None
    ) -> Tuple[Observation, Dict[str, Any]]:
        """As `VectorEnv.reset`."""
        seen, infos = self.env.reset(seed=seed, options=options)
        seen, self._turn = facing_goal(seen)
        return seen, infos

    def step(
        self, actions: ArrayLike
    ) -> Tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Dict[str, Any]]:
        """As `VectorEnv.step`."""
        asked = turned(np.asarray(actions, np.float32), self._turn)
        seen, reward, terminated, truncated, infos = self.env.step(asked)
        seen, self._turn = facing_goal(seen)
        for i in np.flatnonzero(infos.get("_final_obs", ())):
            last = {name: values[None] for name, values in infos["final_obs"][i].items()}
            infos["final_obs"][i] = {name: values[0] for name, values in facing_goal(last)[0].items()}
        return seen, reward, terminated, truncated, infos

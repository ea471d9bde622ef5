"""What a policy sees of a flight outside of an environment: `Observer`."""

from __future__ import annotations

import math
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _pointflight
from ..map import Map
from ..rays import ranges
from .tasks import Floats, Goal, States
from .vector import Lidar, Observation


class Observer:
    """Observations of the task `Goal` for one vehicle, of states and points from a `Simulation`, ROS, a run."""

    def __init__(self, goal: ArrayLike, lidar: Lidar, task: Optional[Goal] = None) -> None:
        """goal: (3,), m, world. lidar and task: those of the environment that the policy has learned in."""
        self.goal = np.asarray(goal, dtype=np.float64)
        self.lidar = lidar
        self.task = Goal() if task is None else task
        self.elapsed = 0.0
        """s since the start: whoever flies counts it on."""
        self.last_action = np.zeros(4)
        """(4,): whoever flies sets it."""
        self._directions = _pointflight._grid(lidar.rows, lidar.columns, *lidar.elevation, *lidar.azimuth)

    def of_map(self, body: Any, place: Map) -> Observation:
        """Of a vehicle in a map. body: what has position, velocity, orientation and pose, such as a `StatusSample`."""
        image = ranges(place, body.pose, self._directions, self.lidar.range_max)[0]
        return self._seen(body, np.minimum(image / self.lidar.range_max, 1.0))

    def of_points(self, body: Any, points: ArrayLike) -> Observation:
        """Of points (n, 3), m, body frame: each cell of the image takes the nearest that it holds."""
        xyz = np.asarray(points, dtype=np.float64)
        distance = np.sqrt((xyz * xyz).sum(1))
        xyz, distance = xyz[distance > 1e-3], distance[distance > 1e-3]
        up = np.arcsin(np.clip(xyz[:, 2] / distance, -1.0, 1.0))
        around = np.arctan2(xyz[:, 1], xyz[:, 0])
        (low, high), (right, left) = self.lidar.elevation, self.lidar.azimuth
        row = np.floor((high - up) / (high - low) * self.lidar.rows).astype(np.int64)
        column = np.floor((left - around) / (left - right) * self.lidar.columns).astype(np.int64)
        inside = (row >= 0) & (row < self.lidar.rows) & (column >= 0) & (column < self.lidar.columns)
        image = np.full((self.lidar.rows, self.lidar.columns), self.lidar.range_max)
        np.minimum.at(image, (row[inside], column[inside]), distance[inside])
        return self._seen(body, image / self.lidar.range_max)

    def _seen(self, body: Any, image: NDArray[Any]) -> Observation:
        x, y, z, w = body.orientation
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        row = np.concatenate(
            [body.position, body.velocity, body.orientation, body.angular_velocity,
             [math.cos(yaw), math.sin(yaw), 0.0, 0.0, 0.0]]
        )  # fmt: skip
        state: Floats = self.task.state_of(
            States(row[None]), self.goal[None], np.array([self.elapsed]), self.last_action[None]
        )
        return {"range": image[None].astype(np.float32), "state": state.astype(np.float32)}

"""What a policy sees of a flight outside of an environment: `Observer`."""

from __future__ import annotations

import math
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..map import Map
from ..poses import rotations
from ..rays import ranges
from .tasks import Floats, Goal, States
from .images import Lidar, Observation, grid_of


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
        cells = (lidar.rows, lidar.columns)
        self._middles = grid_of(lidar).reshape(*cells, 3)
        self._beams = grid_of(lidar._replace(rows=cells[0] * lidar.pool[0], columns=cells[1] * lidar.pool[1]))

    def of_map(self, body: Any, place: Map) -> Observation:
        """Of a vehicle in a map. body: what has position, velocity, orientation and pose, such as a `StatusSample`."""
        (rows, columns), (down, across) = self._middles.shape[:2], self.lidar.pool
        fine = self._beams.reshape(rows * down, columns * across, 3)
        seen = ranges(place, body.pose, fine, self.lidar.range_max)[0].reshape(rows, down, columns, across)
        return self._seen(body, np.minimum(seen.min((1, 3)) / self.lidar.range_max, 1.0))

    def of_points(self, body: Any, points: ArrayLike, ages: Optional[ArrayLike] = None) -> Observation:
        """Of points (n, 3), m, body frame: each cell of the image takes the nearest that it holds, or, if the
        environment's cells have one beam each, the one closest to their middle. ages: (n,), how long before the body's
        state each was measured, s, by which they are deskewed at its present velocity and angular velocity."""
        xyz = np.asarray(points, dtype=np.float64)
        if ages is not None:
            xyz = deskewed(xyz, np.asarray(ages, dtype=np.float64), body)
        distance = np.sqrt((xyz * xyz).sum(1))
        xyz, distance = xyz[distance > 1e-3], distance[distance > 1e-3]
        up = np.arcsin(np.clip(xyz[:, 2] / distance, -1.0, 1.0))
        around = np.arctan2(xyz[:, 1], xyz[:, 0])
        (low, high), (right, left) = self.lidar.elevation, self.lidar.azimuth
        row = np.floor((high - up) / (high - low) * self.lidar.rows).astype(np.int64)
        column = np.floor((left - around) / (left - right) * self.lidar.columns).astype(np.int64)
        inside = (row >= 0) & (row < self.lidar.rows) & (column >= 0) & (column < self.lidar.columns)
        row, column, xyz, distance = row[inside], column[inside], xyz[inside], distance[inside]
        image = np.full((self.lidar.rows, self.lidar.columns), self.lidar.range_max)
        if self.lidar.pool == (1, 1):
            along = (self._middles[row, column] * xyz).sum(1) / distance
            order = np.argsort(along, kind="stable")  # of points in one cell the last one stays
            image[row[order], column[order]] = np.minimum(distance[order], self.lidar.range_max)
        else:
            np.minimum.at(image, (row, column), distance)
        return self._seen(body, image / self.lidar.range_max)

    def _seen(self, body: Any, image: NDArray[Any]) -> Observation:
        x, y, z, w = body.orientation
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        row = np.concatenate(
            [body.position, body.velocity, body.orientation, body.angular_velocity,
             [math.cos(yaw), math.sin(yaw), 0.0, 0.0, 0.0]]
        )  # fmt: skip
        elapsed = np.array([min(self.elapsed, self.task.time_limit)])
        state: Floats = self.task.state_of(States(row[None]), self.goal[None], elapsed, self.last_action[None])
        return {"range": image[None].astype(np.float32), "state": state.astype(np.float32)}


def deskewed(points: Floats, ages: Floats, body: Any) -> Floats:
    """Points (n, 3) in the body frame of when they were measured, `ages` (n,) s ago, in its present one: velocity
    (world) and angular velocity (body) are taken as constant."""
    x, y, z, w = body.orientation
    back = rotations(np.array([[-x, -y, -z, w]]))[0]
    turn = -np.asarray(body.angular_velocity, dtype=np.float64) * ages[:, None]
    angle = np.sqrt((turn * turn).sum(1))
    axis = turn / np.maximum(angle, 1e-12)[:, None]
    sine, cosine = np.sin(angle)[:, None], np.cos(angle)[:, None]
    along = (axis * points).sum(1, keepdims=True)
    turned = points * cosine + np.cross(axis, points) * sine + axis * along * (1.0 - cosine)  # Rodrigues
    now: Floats = turned - ages[:, None] * (back @ np.asarray(body.velocity, dtype=np.float64))
    return now

"""Poses and patterns of directions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _pointflight


def numbers(values: ArrayLike) -> NDArray[np.float64]:
    """Float64 of whatever numpy makes real numbers of; not of complex ones, text or objects (TypeError)."""
    return np.asarray(values).astype(np.float64, casting="same_kind", copy=False)


def pose(
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
) -> NDArray[np.float64]:
    """T_world_sensor as a matrix (4, 4): metres and radians, turned by roll about x, then pitch about y, then yaw
    about z, all of the world (aircraft angles)."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y],
            [-sp, cp * sr, cp * cr, z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def rotations(quaternions: ArrayLike) -> NDArray[np.float64]:
    """(n, 3, 3) of unit quaternions (n, 4): x, y, z, w."""
    x, y, z, w = numbers(quaternions).T
    turned = np.empty((len(x), 3, 3))
    turned[:, 0] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], 1)
    turned[:, 1] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], 1)
    turned[:, 2] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], 1)
    return turned


def grid(
    rows: int,
    columns: int,
    elevation: ArrayLike = (-math.pi / 6, math.pi / 6),
    azimuth: ArrayLike = (-math.pi, math.pi),
) -> NDArray[np.float64]:
    """Directions (rows, columns, 3) of a range image, unit vectors in the sensor frame.

    Row 0 is the highest and column 0 the farthest to the left, as in a picture. `elevation` and `azimuth` are the ends
    of the field of view in radians; directions are the centres of its cells.
    """
    if rows < 1 or columns < 1:
        raise ValueError(f"rows, columns: 1 or more are wanted, not {rows} and {columns}")
    low, high = (float(v) for v in np.asarray(elevation, dtype=np.float64))
    right, left = (float(v) for v in np.asarray(azimuth, dtype=np.float64))
    return _pointflight._grid(rows, columns, low, high, right, left)

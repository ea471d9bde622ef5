"""What policies see by: `Lidar`, and range images."""

from __future__ import annotations

import math
from typing import Any, Dict, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from .. import _pointflight
from ..lidar import Lidar as Sensor
from .draws import NOISE, draws

Observation = Dict[str, NDArray[np.float32]]


class Lidar(NamedTuple):
    """Which ranges policies see: an image, row 0 the highest, column 0 the farthest to the left."""

    rows: int = 16
    """From the highest elevation to the lowest."""
    columns: int = 64
    """From the left end of the azimuth to the right."""
    elevation: Tuple[float, float] = (-math.radians(15), math.radians(15))
    """Ends of the field of view, rad."""
    azimuth: Tuple[float, float] = (-math.pi, math.pi)
    """rad"""
    range_max: float = 10.0
    """m"""
    pool: Tuple[int, int] = (1, 1)
    """Beams in each cell of the image, rows and columns; the nearest counts."""
    rolling: bool = False
    """Columns are measured one after the other while the vehicle moves, the left one first; else all at the end."""
    noise: float = 0.0
    """Standard deviation of ranges, m; bell-shaped, at most 3.46 of it."""
    dropout: float = 0.0
    """Share of cells that see nothing."""
    sensor: Optional[str] = None
    """A LiDAR (`pointflight.Lidar`'s name or path): beams report what it would of what they hit, by its detection,
    range noise and false alarms and the scenario's "surroundings"; None: exact ranges."""


def lidar_of(sensor: Union[str, Sensor], rows: int = 16, columns: int = 64, **others: Any) -> Lidar:
    """The field of view of a sensor file (a name, a path or a `pointflight.Lidar`), seen as an image of so many cells
    whose beams come back as the sensor's do. others: of `Lidar`; range_max is 10 m at most unless it is given."""
    sensor = sensor if isinstance(sensor, Sensor) else Sensor(sensor)
    directions = sensor.beams().direction.astype(np.float64)
    up = np.arcsin(np.clip(directions[:, 2], -1.0, 1.0))
    around = np.arctan2(directions[:, 1], directions[:, 0])
    whole = bool((np.diff(np.sort(around)) < math.radians(10)).all() and np.ptp(around) > math.radians(350))
    values = sensor.values
    given: Dict[str, Any] = {
        "elevation": (float(up.min()), float(up.max())),
        "azimuth": (-math.pi, math.pi) if whole else (float(around.min()), float(around.max())),
        "range_max": min(10.0, values["range_max"]),
        "rolling": True,
        "sensor": sensor.name,
    }
    return Lidar(rows, columns, **{**given, **others})


def grid_of(lidar: Lidar) -> NDArray[np.float64]:
    """(rows * columns, 3): the middles of an image's cells, unit vectors."""
    return _pointflight._grid(lidar.rows, lidar.columns, *lidar.elevation, *lidar.azimuth).reshape(-1, 3)


def beams_of(lidar: Optional[Lidar]) -> Tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Directions (k, 3), those of a cell one after the other, and shares of the period (k,) or (0,)."""
    if lidar is None:
        return np.zeros((0, 3), np.float32), np.zeros(0, np.float32)
    if lidar.rows < 1 or lidar.columns < 1:
        raise ValueError(f"lidar: 1 row and column or more, not {lidar.rows} x {lidar.columns}")
    if not (lidar.noise >= 0.0 and 0.0 <= lidar.dropout <= 1.0):
        raise ValueError(f"lidar: noise 0 or above and dropout 0 to 1, not {lidar.noise} and {lidar.dropout}")
    down, across = lidar.pool
    if down < 1 or across < 1:
        raise ValueError(f"lidar: pool of 1 beam or more, not {down} x {across}")
    rows, columns = lidar.rows, lidar.columns
    fine = (rows * down, columns * across)

    def by_cell(values: NDArray[Any]) -> NDArray[np.float32]:
        parts = values.reshape(rows, down, columns, across, -1).transpose(0, 2, 1, 3, 4)
        return parts.reshape(fine[0] * fine[1], -1).astype(np.float32)

    directions = by_cell(_pointflight._grid(*fine, *lidar.elevation, *lidar.azimuth))
    if not lidar.rolling:
        return directions, np.zeros(0, np.float32)
    shares = np.broadcast_to((np.arange(fine[1]) + 0.5) / fine[1], fine)
    return directions, by_cell(shares)[:, 0]


def measured(
    images: NDArray[np.float32],
    lidar: Lidar,
    seeds: NDArray[np.uint64],
    episodes: NDArray[np.uint64],
    steps: NDArray[np.int64],
) -> NDArray[np.float32]:
    """Images (n, rows, columns) with noise and dropout: draws are addressed by seed, episode, step and cell."""
    shape = images.shape
    first = NOISE + (steps.astype(np.uint64) << np.uint64(24))
    u = draws(seeds, episodes, 5 * shape[1] * shape[2], first).reshape(*shape, 5)
    # the sum of four uniform numbers less 2: variance 1 / 3
    bell = (u[..., 0] + u[..., 1] + u[..., 2] + u[..., 3] - 2.0) * math.sqrt(3.0)
    noisy = images + (lidar.noise / lidar.range_max * bell).astype(np.float32)
    lost = (images >= 1.0) | (u[..., 4] < lidar.dropout)
    return np.where(lost, np.float32(1.0), np.clip(noisy, np.float32(0.0), np.float32(1.0)))

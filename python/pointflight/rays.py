"""Single rays: `raycast`, `ranges`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _pointflight
from .map import Map
from .poses import numbers


class Hits(NamedTuple):
    """What rays hit, an entry for each."""

    range: NDArray[np.float64]
    """(n,): m along the ray; infinite if it hits nothing within its range."""
    point: NDArray[np.float64]
    """(n, 3): world, m; NaN without a hit."""
    normal: NDArray[np.float32]
    """(n, 3): of the surfel that gave most of the return, towards the ray's origin; NaN without a hit."""
    incidence: NDArray[np.float32]
    """(n,): between ray and normal, radians; NaN without a hit."""
    intensity: NDArray[np.float32]
    """(n,): in the scale of the map's cloud; 0 if it had none."""
    surfel: NDArray[np.uint32]
    """(n,): that surfel's index in `Map.words`; 2**32 - 1 of what moves and without a hit."""
    label: NDArray[np.uint16]
    """(n,): 0 the map, 1 and so on the vehicles, from 10001 on the obstacles; 65535 without a hit."""


def raycast(map: Map, origins: ArrayLike, directions: ArrayLike, range_max: float = 100.0) -> Hits:
    """Casts rays in a map (`Simulation.raycast`: among all that moves in a run as well) from origins (n, 3), world, m,
    along directions (n, 3) of any length; one of either, (3,), counts for all of the other. Rays may start anywhere:
    they are sorted so that neighbours are cast together.
    """
    return Hits(
        *_pointflight._raycast(
            map._handle, numbers(origins), numbers(directions), range_max
        )
    )


def ranges(map: Map, poses: ArrayLike, directions: ArrayLike, range_max: float = 10.0) -> NDArray[np.float32]:
    """Range images (n, rows, columns) from poses (n, 4, 4) or (4, 4), T_world_sensor, along directions
    (rows, columns, 3) in the sensor frame (`grid`): exact ranges in m, `range_max` if nothing is nearer.
    """
    return _pointflight._ranges(
        map._handle, numbers(poses), numbers(directions), range_max
    )

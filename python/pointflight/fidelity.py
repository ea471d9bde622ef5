"""How well maps agree with exact scenes and with real scans: `Scene`, `fidelity`, `compare`."""

from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _pointflight
from .map import Map
from .poses import numbers
from .settings import Path


class Scene:
    """A place of exact shapes, of which every range is known: one of `Scene.names()`, or a file of one's own
    (docs/fidelity.md)."""

    def __init__(self, name: Path) -> None:
        """Raises InputError that lists the names."""
        self._handle = _pointflight._Scene(str(name))

    @staticmethod
    def names() -> Dict[str, str]:
        """Those that are shipped, and what each is there to show."""
        return dict(_pointflight._scene_names())

    @property
    def name(self) -> str:
        """As it was given."""
        return self._handle.name

    @property
    def tags(self) -> Sequence[str]:
        """Kinds of shapes, by number."""
        return tuple(self._handle.tags)

    def raycast(
        self, origins: ArrayLike, directions: ArrayLike, range_max: float = 100.0
    ) -> Tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Exact ranges (n,), m, infinite without a hit, of rays as `raycast` takes them, and numbers of tags (n,), -1
        without a hit."""
        return self._handle.raycast(numbers(origins), numbers(directions), range_max)

    def points(self, resolution: float = 0.05, *, noise: float = 0.0, seed: int = 1) -> NDArray[np.float64]:
        """(n, 3): a cloud of it, 8 points a square of `resolution` (m), moved along the normals by `noise` (m)."""
        return self._handle.points(resolution, noise, seed)

    def __repr__(self) -> str:
        return f"<Scene {self.name}: {self._handle.about}>"


def fidelity(
    scene: Scene, map: Optional[Map] = None, *, resolution: float = 0.05, poses: int = 8, seed: int = 1
) -> Dict[str, Dict[str, Any]]:
    """Renders beams in a map of the scene and compares them with the exact ones, as `pointflight fidelity` does.

    map: one made of the scene; without it, of its `points(resolution)`. poses: how many sensors stand in it, unless it
    has poses of its own. Gives "all", "interior" (no range jump near), "silhouette", and "by_tag", "by_incidence",
    "by_range", each a dict of these: rays; right (within 0.1 m), early, late, missing, false: shares of all rays;
    median_abs_error, p90_abs_error, p95_abs_error, bias of the right ones, m.
    """
    if map is None:
        map = Map.from_points(scene.points(resolution), resolution=resolution)
    return scene._handle.fidelity(map._handle, poses, seed)


class Comparison(NamedTuple):
    """Real returns and what was rendered along their rays, an entry for each."""

    range: NDArray[np.float64]
    """(n,): measured, m."""
    rendered: NDArray[np.float64]
    """(n,): m; infinite if nothing was hit."""
    supported: NDArray[np.bool_]
    """(n,): a point of the cloud lies within 0.1 m of the return; without a cloud all are."""
    assumed: NDArray[np.bool_]
    """(n,): what was hit is a surfel that no survey saw."""
    statistics: Dict[str, float]
    """Of those that are supported, as `fidelity` has them."""


def compare(map: Map, points: ArrayLike, origins: ArrayLike, cloud: Optional[ArrayLike] = None) -> Comparison:
    """Renders the rays of real returns, as `pointflight compare` does.

    points: (n, 3), world, m, of one scan or more. origins: where the sensor was, (3,) or one for each point (n, 3).
    cloud: (m, 3), the points that the map was made of: returns elsewhere say nothing of the map.
    """
    given: Optional[NDArray[np.float64]] = None if cloud is None else numbers(cloud)
    measured, rendered, supported, assumed, statistics = _pointflight._compare(
        map._handle, numbers(points), numbers(origins), given
    )
    return Comparison(measured, rendered, supported.astype(np.bool_), assumed.astype(np.bool_), statistics)


__all__: List[str] = ["Comparison", "Scene", "compare", "fidelity"]

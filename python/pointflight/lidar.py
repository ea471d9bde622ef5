"""Sensors and their scans: `Lidar`."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, List, NamedTuple, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _pointflight
from .map import Map
from .poses import numbers


class Beams(NamedTuple):
    """The beams of a scan, in firing order."""

    direction: NDArray[np.float32]
    """(n, 3): unit vectors in the sensor frame."""
    time: NDArray[np.float64]
    """(n,): s after the scan's start."""
    ring: NDArray[np.uint16]
    """(n,): as the vendor's driver numbers it."""


class Scan(np.ndarray):  # type: ignore[type-arg]  # numpy before 1.22 cannot be indexed
    """The returns of one scan in firing order: a structured array (n,) with the fields of the program's PCD files.

    x, y, z float32, m in the sensor frame; intensity, range float32; time float32, s after the scan's start; ring,
    label uint16 (0 the map, 65535 a false return). With `truth=True` also what no sensor knows: true_range, incidence,
    depth, deskewed_x, deskewed_y, deskewed_z float32, surfel, thing uint32, sub_ray, sub_rays uint16, assumed,
    class uint8.
    """

    beams: int
    """How many beams were fired."""

    def __array_finalize__(self, obj: Any) -> None:
        self.beams = getattr(obj, "beams", 0)

    @property
    def xyz(self) -> NDArray[np.float32]:
        """(n, 3): a view of the points, m in the sensor frame."""
        if self.ndim != 1 or self.dtype.names is None or self.dtype.names[:3] != ("x", "y", "z"):
            raise ValueError("xyz: a scan's points are wanted, (n,) with x, y and z")
        x = self.view(np.ndarray)["x"]
        return np.lib.stride_tricks.as_strided(
            x, shape=(len(self), 3), strides=(self.strides[0], x.itemsize), writeable=self.flags.writeable
        )


def scan_of(rows: NDArray[np.uint8], fields: List[Tuple[str, str]], beams: int) -> Scan:
    """A scan of its bytes."""
    scan = rows.view(np.dtype(fields)).view(Scan)
    scan.beams = beams
    return scan


class Lidar:
    """A sensor: one of those that are shipped (`pointflight lidar list`), or a file of one's own."""

    def __init__(self, name: Union[str, "os.PathLike[str]"]) -> None:
        """name: "mid360", or the path of a sensor file (.yaml), of Ouster's metadata (.json) or of a table of
        directions (.csv). Raises InputError that lists the names."""
        self._name = os.fspath(name)
        self._handle = _pointflight._Lidar(self._name)

    @property
    def name(self) -> str:
        """As it was given."""
        return self._name

    @property
    def title(self) -> str:
        """Maker and model."""
        return self._handle.title

    @property
    def rate(self) -> float:
        """Scans a second."""
        return self._handle.rate

    @property
    def text(self) -> str:
        """The sensor file with all its keys, YAML."""
        return self._handle.text

    @property
    def values(self) -> Dict[str, Any]:
        """A copy of all its keys (docs/sensors.md), as nested dicts and lists."""
        return dict(json.loads(self._handle.json))

    def __reduce__(self) -> Any:
        return Lidar, (self._name,)

    def __repr__(self) -> str:
        return f"<Lidar {self.title}>"

    def beams(self, *, seed: int = 1, index: int = 0) -> Beams:
        """What `scan` fires with the same seed and index: patterns that do not repeat start anywhere."""
        return Beams(*self._handle.beams(seed, index))

    def scan(
        self,
        map: Map,
        pose: ArrayLike,
        *,
        seed: int = 1,
        index: int = 0,
        noise: bool = True,
        truth: bool = False,
        sun_klx: float = 100.0,
        reflectivity: float = 0.0,
    ) -> Scan:
        """Takes a scan from a pose (4, 4), T_world_sensor, as `pointflight scan` does: the same bytes.

        seed: of the noise. index: which scan of a pattern that does not repeat; it is taken at `index` periods.
        noise: False: exact ranges. truth: adds what no sensor knows of each point. sun_klx: kilolux, 100 in full sun.
        reflectivity: of surfaces of which the map does not say it; 0: it varies from surfel to surfel.
        """
        return scan_of(
            *self._handle.scan(map._handle, numbers(pose), seed, index, noise, truth, sun_klx, reflectivity)
        )

"""Maps of places: `Map`."""

from __future__ import annotations

import dataclasses
import json
import os
import pickle
import tempfile
from typing import Any, Callable, Iterable, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _pointflight
from .poses import numbers

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[str, float], object]


@dataclasses.dataclass(frozen=True)
class MapInfo:
    """What the header of a map says."""

    name: str
    """The path that it was opened by, or what stands for it."""
    resolution: float
    """r, m."""
    surfels: int
    """How many it has."""
    bounds: NDArray[np.float64]
    """(2, 3): least and greatest coordinates of the surfels' centres, m."""
    has_intensity: bool
    """False: intensities are 0 everywhere."""
    file_size: int
    """Bytes."""
    hash: str
    """Sixteen hexadecimal digits of what is in it."""
    metadata: Any
    """How it was made: what JSON there is in the file."""


class Map:
    """A map of surfels, immutable and shared by all that use it.

    `open` takes milliseconds whatever its size: it is mapped into memory, and processes share the pages.
    """

    def __init__(self, handle: _pointflight.Map) -> None:
        """Use `open`, `import_clouds` or `from_points`."""
        self._handle = handle

    @staticmethod
    def open(path: Path) -> Map:
        """Opens a .pfmap. Raises InputError if it is none."""
        return Map(_pointflight.Map._open(os.fspath(path)))

    @staticmethod
    def import_clouds(
        clouds: Union[Path, Iterable[Path]],
        output: Optional[Path] = None,
        *,
        resolution: Optional[float] = None,
        force: bool = False,
        progress: Optional[Progress] = None,
    ) -> Map:
        """Makes a map of point clouds or meshes, as `pointflight map import` does.

        clouds: paths of files (PCD, PLY, LAS, E57, ...), one or several, all in one world frame.
        output: the .pfmap to write; without it the map is in memory alone. `force` replaces one that is there.
        resolution: r in m; without it resolutions are tried (`pointflight map import --help`).
        progress: is called now and then with what is done and the share of it, 0 to 1.

        Ctrl-C ends it, and nothing is written. Raises InputError, or FileExistsError without `force`.
        """
        if isinstance(clouds, (str, os.PathLike)):
            clouds = [clouds]
        paths = [os.fspath(cloud) for cloud in clouds]
        written = None if output is None else os.fspath(output)
        if written is not None and not written.endswith(".pfmap"):
            raise ValueError(f"output: {written} does not end in .pfmap")  # and so replaces no cloud
        if written is not None and os.path.lexists(written) and not force:
            raise FileExistsError(f"{written}: is there already; force=True replaces it")
        return Map(_pointflight.Map._import_clouds(paths, written, resolution, "a map in memory", progress))

    @staticmethod
    def from_points(
        points: ArrayLike,
        output: Optional[Path] = None,
        *,
        resolution: Optional[float] = None,
        force: bool = False,
        progress: Optional[Progress] = None,
    ) -> Map:
        """The same of points (n, 3) in m, or (n, 4) with an intensity."""
        array = numbers(points)
        if array.ndim != 2 or array.shape[1] not in (3, 4):
            raise ValueError(f"points: shape (n, 3) or (n, 4) is wanted, not {array.shape}")
        with tempfile.TemporaryDirectory(prefix="pointflight-") as folder:
            path = os.path.join(folder, "points.npy")
            np.save(path, array)
            return Map.import_clouds(path, output, resolution=resolution, force=force, progress=progress)

    @property
    def resolution(self) -> float:
        """r, m."""
        return self._handle.resolution

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3): least and greatest coordinates of the surfels' centres, m."""
        return self._handle.bounds

    @property
    def words(self) -> NDArray[np.uint64]:
        """(m,): the packed surfels with the headers of their leaves, as the file has them: a read-only view."""
        return self._handle.words

    def __reduce__(self) -> Any:
        if not os.path.isfile(self._handle.name):
            raise pickle.PicklingError(f"{self!r}: only maps in files can be pickled")
        return Map.open, (os.path.abspath(self._handle.name),)

    def __len__(self) -> int:
        """How many surfels it has."""
        return len(self._handle)

    def __repr__(self) -> str:
        return f"<Map {self._handle.name}: {len(self)} surfels of {self.resolution:.4g} m>"

    def info(self) -> MapInfo:
        """What its header says."""
        handle = self._handle
        return MapInfo(
            name=handle.name,
            resolution=handle.resolution,
            surfels=len(handle),
            bounds=handle.bounds,
            has_intensity=handle.has_intensity,
            file_size=handle.file_size,
            hash=handle.hash,
            metadata=json.loads(handle._metadata or "null"),
        )

    def verify(self) -> None:
        """Reads the whole file: checksums and structure. Raises InputError that names what is damaged."""
        self._handle.verify()

    def nearest(self, points: ArrayLike, reach: float = 10.0) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distances (n,) from points (n, 3), world, m, to the nearest surfel's box, 0 inside it, and the centres (n, 3)
        of these surfels; infinite and NaN if none is within `reach`."""
        return self._handle._nearest(numbers(points), reach)

    def tour(
        self,
        *,
        length: float = 60.0,
        radius: float = 0.3,
        margin: float = 0.4,
        start: Optional[Sequence[float]] = None,
    ) -> NDArray[np.float64]:
        """Corners (k, 3), world, m, of a way of straight legs through free space, of at least this length if the map
        allows, along which a ball of `radius` has `margin` left: what `pointflight fly MAP` flies. start: (3,), where
        it begins. Raises ValueError if no position is free."""
        found = self._handle._tour(length, radius, margin, None if start is None else [float(v) for v in start])
        if len(found) == 0:
            raise ValueError(f"{self!r}: no position is free by {radius + margin} m")
        return found

    def surfels(self) -> NDArray[Any]:
        """All surfels as a structured array (n,), unpacked:

        center (3,) float64, world, m; normal (3,) and axis (3,) float32, unit vectors, the latter along the longest
        extent; sigmas (3,) float32, m, along the normal, across, and along the axis; intensity float32; word uint32,
        its index in `words` and in `Hits.surfel`; assumed uint8, 1 if no survey saw it; class uint8 and thing uint32,
        as `labels`; opacity uint8: so many 255ths of the beams that reach it come back, but 0 is a pane, 1 water.
        """
        return self._handle._surfels()

    @property
    def classes(self) -> List[str]:
        """What the numbers of classes mean; the first is empty: not known. Maps of made-up worlds know them."""
        return self._handle.classes

    def labels(self, surfels: ArrayLike) -> Tuple[NDArray[np.uint8], NDArray[np.uint32]]:
        """Class (n,), an index in `classes`, and thing (n,) of surfels (n,) by their words: of `Hits.surfel`, say.
        Surfels of one tree or chair have one thing. Zeros where nothing is known."""
        return self._handle._labels(np.asarray(surfels, np.uint32))

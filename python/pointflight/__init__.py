"""LiDAR drones in point-cloud maps of real places: numpy in, numpy out.

Lengths are metres, angles radians, times seconds. World frames have z up; a sensor's x points ahead, y to its left, z
up. A pose is a matrix (4, 4) that maps points of the sensor to the world (`pose` makes one). What goes wrong with files
is an `InputError`, one line; arrays of a wrong shape are a `ValueError` that names them.
"""

from ._pointflight import InputError, __version__, set_threads, threads
from .lidar import Beams, Lidar, Scan
from .map import Map, MapInfo
from .poses import grid, pose
from .rays import Hits, ranges, raycast

__all__ = [
    "Beams",
    "Hits",
    "InputError",
    "Lidar",
    "Map",
    "MapInfo",
    "Scan",
    "__version__",
    "grid",
    "pose",
    "ranges",
    "raycast",
    "set_threads",
    "threads",
]

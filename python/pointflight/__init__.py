"""LiDAR drones in point-cloud maps of real places: numpy in, numpy out.

Lengths are metres, angles radians, times seconds. World frames have z up; a sensor's x points ahead, y to its left, z
up. A pose is a matrix (4, 4) that maps points of the sensor to the world (`pose` makes one). What goes wrong with files
is an `InputError`, one line; arrays of a wrong shape are a `ValueError` that names them.
"""

from ._pointflight import (
    Acceleration,
    Arm,
    Attitude,
    BodyRates,
    CollisionEvent,
    Disarm,
    Hover,
    ImuSample,
    InputError,
    Land,
    Measurement,
    ObstacleSample,
    OdometrySample,
    Position,
    RotorSpeeds,
    ScanSample,
    SimulationState,
    StateSample,
    StatusSample,
    TakeOff,
    Trajectory,
    VehicleEvent,
    Velocity,
    Waypoints,
    set_threads,
    threads,
    __version__,
)
from .lidar import Beams, Lidar, Scan
from .map import Map, MapInfo
from .poses import grid, pose
from .rays import Hits, ranges, raycast
from .runs import DataSet, Flight, Run, RunScan, Scans, columns, poses_of, read_pcd, read_table
from .settings import Scenario, Vehicle
from .simulation import Command, CommandRejected, Recording, Sample, Simulation

__all__ = [
    "Acceleration",
    "Arm",
    "Attitude",
    "Beams",
    "BodyRates",
    "CollisionEvent",
    "Command",
    "CommandRejected",
    "DataSet",
    "Disarm",
    "Flight",
    "Hits",
    "Hover",
    "ImuSample",
    "InputError",
    "Land",
    "Lidar",
    "Map",
    "MapInfo",
    "Measurement",
    "ObstacleSample",
    "OdometrySample",
    "Position",
    "Recording",
    "RotorSpeeds",
    "Run",
    "RunScan",
    "Sample",
    "Scan",
    "ScanSample",
    "Scans",
    "Scenario",
    "Simulation",
    "SimulationState",
    "StateSample",
    "StatusSample",
    "TakeOff",
    "Trajectory",
    "Vehicle",
    "VehicleEvent",
    "Velocity",
    "Waypoints",
    "__version__",
    "columns",
    "grid",
    "pose",
    "poses_of",
    "ranges",
    "raycast",
    "read_pcd",
    "read_table",
    "set_threads",
    "threads",
]

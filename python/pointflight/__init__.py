"""LiDAR drones in point-cloud maps of real places: numpy in, numpy out.

Lengths are metres, angles radians, times seconds. World frames have z up; a sensor's x points ahead, y to its left, z
up. A pose is a matrix (4, 4) that maps points of the sensor to the world (`pose` makes one). What goes wrong with files
is an `InputError`, one line; arrays of a wrong shape are a `ValueError` that names them.
"""

import os as _os

from . import _pointflight
from ._pointflight import (
    Acceleration,
    Arm,
    Attitude,
    BodyRates,
    BodyState,
    CollisionEvent,
    ControllerMemory,
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
    SensorInput,
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
from .fidelity import Comparison, Scene, compare, fidelity
from .lidar import Beams, Lidar, Scan
from .map import Map, MapInfo
from .parts import Controller, add_controller, add_renderer, add_sensor
from .poses import grid, pose
from .rays import Hits, ranges, raycast
from .runs import DataSet, Flight, Run, RunScan, Scans, columns, poses_of, read_pcd, read_table
from .settings import Scenario, Vehicle
from .simulation import Command, CommandRejected, Link, Recording, Sample, Simulation, SimulationState

_data = _os.path.join(_os.path.dirname(_os.path.abspath(__file__)), "data")
if _os.path.isdir(_data):  # a wheel has it
    _pointflight._add_data_folder(_data)

__all__ = [
    "Acceleration",
    "Arm",
    "Attitude",
    "Beams",
    "BodyRates",
    "BodyState",
    "CollisionEvent",
    "Command",
    "CommandRejected",
    "Comparison",
    "Controller",
    "ControllerMemory",
    "DataSet",
    "Disarm",
    "Flight",
    "Hits",
    "Hover",
    "ImuSample",
    "InputError",
    "Land",
    "Lidar",
    "Link",
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
    "Scene",
    "SensorInput",
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
    "add_controller",
    "add_renderer",
    "add_sensor",
    "columns",
    "compare",
    "fidelity",
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

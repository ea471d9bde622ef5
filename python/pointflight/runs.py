"""What runs have written: `Run`, and `DataSet` for odometry and SLAM programs."""

from __future__ import annotations

import csv
import dataclasses
import functools
import json
import os
from typing import Any, Dict, Iterator, List, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _pointflight
from .lidar import Scan
from .poses import rotations
from .settings import Path, Scenario

Table = NDArray[Any]


def read_table(path: Path) -> Table:
    """A table with a line of names as a structured array (n,): float64, empty cells NaN, or text if a cell of the
    column is no number. `pandas.DataFrame(table)` takes it. Raises InputError with file and line."""
    name = os.fspath(path)
    try:
        with open(name, newline="", encoding="utf-8") as file:
            lines = list(csv.reader(file))
    except OSError as error:
        raise _pointflight.InputError(f"{name}: {error.strerror}") from None
    if not lines or not lines[0]:
        raise _pointflight.InputError(f"{name}:1: a line of names is wanted")
    names, rows = lines[0], lines[1:]
    for number, row in enumerate(rows, 2):
        if len(row) != len(names):
            raise _pointflight.InputError(f"{name}:{number}: {len(row)} cells, not {len(names)} as in line 1")
    columns: List[NDArray[Any]] = []
    for i in range(len(names)):
        cells = [row[i] for row in rows]
        try:
            columns.append(np.array([cell or "nan" for cell in cells], dtype=np.float64))
        except ValueError:
            columns.append(np.array(cells, dtype=np.str_))
    table = np.empty(len(rows), dtype=[(column, values.dtype) for column, values in zip(names, columns)])
    for column, values in zip(names, columns):
        table[column] = values
    return table


def columns(table: Table, *names: str) -> NDArray[np.float64]:
    """(n, k): some columns of a table: `columns(flight.trajectory, "px", "py", "pz")`."""
    return np.stack([table[name] for name in names], axis=-1)


def read_pcd(path: Path) -> Scan:
    """The points of a binary PCD, as the program writes them. Raises InputError."""
    name = os.fspath(path)
    try:
        with open(name, "rb") as file:
            data = file.read()
    except OSError as error:
        raise _pointflight.InputError(f"{name}: {error.strerror}") from None
    head, mark, body = data.partition(b"DATA binary\n")
    words = {line.split()[0]: line.split()[1:] for line in head.decode("latin-1").splitlines() if line.split()}
    if not mark or not {"FIELDS", "SIZE", "TYPE", "POINTS"} <= words.keys():
        raise _pointflight.InputError(f"{name}: no binary PCD")
    try:
        kinds = [kind.lower() + size for kind, size in zip(words["TYPE"], words["SIZE"])]
        row = np.dtype(list(zip(words["FIELDS"], kinds)))
        count = int(words["POINTS"][0])
    except (TypeError, ValueError, IndexError):
        raise _pointflight.InputError(f"{name}: its header makes no sense") from None
    if count < 0 or len(body) < count * row.itemsize:
        raise _pointflight.InputError(f"{name}: {len(body)} bytes of points, not {count} x {row.itemsize}")
    return np.frombuffer(body, row, count).view(Scan)


def poses_of(table: Table) -> NDArray[np.float64]:
    """(n, 4, 4) of a table's columns px, py, pz, qw, qx, qy, qz."""
    poses = np.zeros((len(table), 4, 4))
    poses[:, :3, :3] = rotations(columns(table, "qx", "qy", "qz", "qw"))
    poses[:, :3, 3] = columns(table, "px", "py", "pz")
    poses[:, 3, 3] = 1
    return poses


@dataclasses.dataclass(frozen=True)
class RunScan:
    """A scan of a run."""

    points: Scan
    """(n,): as the sensor delivered them."""
    lidar: int
    """Number of the LiDAR on the vehicle."""
    index: int
    """Number of the scan since time zero; lost ones are counted."""
    start: float
    """s since the start of the run."""
    end: float
    """s"""
    pose: NDArray[np.float64]
    """(4, 4): T_world_sensor in the middle between start and end."""
    beams: int
    """How many were fired."""


class Scans(Sequence[RunScan]):
    """The scans of a flight, read when they are asked for."""

    def __init__(self, folder: str, table: Table) -> None:
        self.table = table
        """scans.csv: file, lidar, scan, start, end, beams, points, and the pose."""
        self._folder = folder
        self._poses = poses_of(table)

    def __len__(self) -> int:
        return len(self.table)

    def __getitem__(self, i: Any) -> Any:
        if isinstance(i, (slice, np.ndarray)):
            return Scans(self._folder, self.table[i])
        row = self.table[i]
        points = read_pcd(os.path.join(self._folder, str(row["file"])))
        points.beams = int(row["beams"])
        return RunScan(
            points, int(row["lidar"]), int(row["scan"]), float(row["start"]), float(row["end"]), self._poses[i],
            points.beams,
        )  # fmt: skip


class Flight:
    """What a run has of one vehicle. Tables are structured arrays, read when they are first asked for; their columns
    are those of the files (README)."""

    def __init__(self, folder: str, name: str) -> None:
        self.name = name
        """Of the vehicle."""
        self._folder = folder

    @functools.cached_property
    def trajectory(self) -> Table:
        """Truth: time, px .. pz, velocity, attitude, rates, command, clearance, rotor speeds."""
        return self.table("trajectory")

    @functools.cached_property
    def poses(self) -> NDArray[np.float64]:
        """(n, 4, 4): T_world_body of each row of `trajectory`."""
        return poses_of(self.trajectory)

    @functools.cached_property
    def imu(self) -> Table:
        """time, gyro_x .. gyro_z in rad/s, accel_x .. accel_z in m/s^2."""
        return self.table("imu")

    @functools.cached_property
    def odometry(self) -> Table:
        """What the odometry on board reported; InputError unless the scenario has `output.odometry`."""
        return self.table("odometry")

    @functools.cached_property
    def scans(self) -> Scans:
        """In the order in which they were delivered; InputError if the scenario says `output.scans: false`."""
        return Scans(self._folder, self.table("scans"))

    def table(self, name: str) -> Table:
        """Any other: "barometer", "gnss_1"."""
        return read_table(os.path.join(self._folder, name + ".csv"))

    def __repr__(self) -> str:
        return f"<Flight of {self.name}>"


class Run:
    """A run's folder, written by `pointflight fly -o` or `Simulation.record`."""

    def __init__(self, folder: Path) -> None:
        """Raises InputError if there is no complete run in it."""
        self.folder = os.fspath(folder)
        """As it was given."""
        path = os.path.join(self.folder, "summary.json")
        try:
            with open(path, encoding="utf-8") as file:
                self.summary: Dict[str, Any] = json.load(file)
        except FileNotFoundError:
            raise _pointflight.InputError(f"{self.folder}: no complete run: it has no summary.json") from None
        except (OSError, ValueError) as error:
            raise _pointflight.InputError(f"{path}: {error}") from None
        self.scenario = Scenario(os.path.join(self.folder, "scenario.yaml"))
        """As it was flown."""
        names = self.scenario.vehicles
        self.flights: Dict[str, Flight] = {
            name: Flight(self.folder if len(names) == 1 else os.path.join(self.folder, name), name) for name in names
        }
        """By the vehicle's name."""

    def flight(self, vehicle: Union[int, str] = 0) -> Flight:
        """Of a vehicle by number or name. Raises KeyError or IndexError."""
        return self.flights[vehicle] if isinstance(vehicle, str) else list(self.flights.values())[vehicle]

    @functools.cached_property
    def events(self) -> Table:
        """Collisions and what else happened: time, event, vehicle, partner, positions, penetration."""
        return read_table(os.path.join(self.folder, "events.csv"))

    @functools.cached_property
    def obstacles(self) -> Table:
        """Where each was: time, label, pose, half extents. InputError if the run had none."""
        return read_table(os.path.join(self.folder, "obstacles.csv"))

    def __repr__(self) -> str:
        return f"<Run {self.folder}: {', '.join(self.flights)}, {self.summary.get('end')}>"


class DataSet:
    """A flight's scans as data set classes of KISS-ICP and its like have them: `len`, `[i]`, `gt_poses`,
    `apply_calibration`."""

    def __init__(self, folder: Path, vehicle: Union[int, str] = 0, lidar: int = 0) -> None:
        """folder: of a run, or a `Run`'s. lidar: which on the vehicle."""
        scans = Run(folder).flight(vehicle).scans
        self._scans = scans[scans.table["lidar"] == lidar] if len(scans) else scans
        self.sequence_id = os.path.basename(os.path.normpath(os.fspath(folder)))
        """For names of results."""
        self.gt_poses: NDArray[np.float64] = self._scans._poses
        """(n, 4, 4): T_world_sensor in the middle of each scan."""

    def __len__(self) -> int:
        return len(self._scans)

    def __getitem__(self, i: int) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points (n, 3) in m, sensor frame, and times (n,) from 0, the scan's start, to 1, its end."""
        scan = self._scans[i]
        return scan.points.xyz.astype(np.float64), scan.points["time"].astype(np.float64) / (scan.end - scan.start)

    def __iter__(self) -> Iterator[Tuple[NDArray[np.float64], NDArray[np.float64]]]:
        return (self[i] for i in range(len(self)))

    def apply_calibration(self, poses: ArrayLike) -> NDArray[np.float64]:
        """Estimates of the sensor's poses in the frame of `gt_poses`: they are the same."""
        return np.asarray(poses, dtype=np.float64)

"""A room of 6 x 4 x 3 m as a map, for all tests."""

import functools
import os
import subprocess
import tempfile

import numpy as np

import pointflight as pf

PROGRAM = os.environ["POINTFLIGHT_PROGRAM"]


def room_points() -> np.ndarray:
    """(n, 4): points on the walls of a room from (-3, -2, 0) to (3, 2, 3), 4 cm apart, with the height as intensity."""
    step = 0.04
    x, y, z = np.arange(-3, 3, step) + step / 2, np.arange(-2, 2, step) + step / 2, np.arange(0, 3, step) + step / 2
    sides = []
    for a, b, at in ((x, y, 0.0), (x, y, 3.0)):
        u, v = (g.ravel() for g in np.meshgrid(a, b))
        sides.append(np.stack([u, v, np.full_like(u, at)], 1))
    for a, at in ((x, -2.0), (x, 2.0)):
        u, v = (g.ravel() for g in np.meshgrid(a, z))
        sides.append(np.stack([u, np.full_like(u, at), v], 1))
    for a, at in ((y, -3.0), (y, 3.0)):
        u, v = (g.ravel() for g in np.meshgrid(a, z))
        sides.append(np.stack([np.full_like(u, at), u, v], 1))
    points = np.concatenate(sides)
    return np.concatenate([points, points[:, 2:]], 1)


@functools.lru_cache(maxsize=None)
def folder() -> tempfile.TemporaryDirectory:
    """Removed when the tests end."""
    return tempfile.TemporaryDirectory(prefix="pointflight-test-")


def path_of(name: str) -> str:
    """In the tests' folder."""
    return os.path.join(folder().name, name)


@functools.lru_cache(maxsize=None)
def room() -> pf.Map:
    """The room as a map in a file."""
    return pf.Map.from_points(room_points(), path_of("room.pfmap"), resolution=0.1)


def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
    """Runs the program."""
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)


def read_pcd(path: str) -> np.ndarray:
    """A binary PCD as a structured array."""
    with open(path, "rb") as file:
        data = file.read()
    head, _, body = data.partition(b"DATA binary\n")
    rows = {line.split()[0]: line.split()[1:] for line in head.decode().splitlines() if not line.startswith("#")}
    kinds = [kind.lower() + size for kind, size in zip(rows["TYPE"], rows["SIZE"])]
    return np.frombuffer(body, np.dtype(list(zip(rows["FIELDS"], kinds))))

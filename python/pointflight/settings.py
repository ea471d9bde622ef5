"""Scenarios and vehicles: `Scenario`, `Vehicle`."""

from __future__ import annotations

import json
import os
import re
from typing import Any, Dict, List, Mapping, Sequence, Union

import numpy as np

from . import _pointflight

Path = Union[str, "os.PathLike[str]"]


def _plain(value: Any) -> Any:
    """What JSON cannot write, as what it can."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"{value!r}: a scenario holds numbers, text, lists and sections of these")


def _set(values: Any, key: str, value: Any) -> None:
    """Sets "vehicles[0].start" in nested values."""
    steps: List[Union[str, int]] = []
    for part in key.split("."):
        found = re.fullmatch(r"([A-Za-z_]\w*)((?:\[\d+\])*)", part)
        if found is None:
            raise ValueError(f"key {key!r}: names with dots and [numbers] are wanted, as in 'vehicles[0].start'")
        steps += [found[1], *(int(index) for index in re.findall(r"\d+", found[2]))]
    for step, following in zip(steps[:-1], steps[1:]):
        if isinstance(step, str) and isinstance(values, dict):
            values = values.setdefault(step, [] if isinstance(following, int) else {})
        elif isinstance(step, int) and isinstance(values, list) and step < len(values):
            values = values[step]
        else:
            raise ValueError(f"key {key!r}: there is no {step!r}")
    last = steps[-1]
    if isinstance(last, int) and not (isinstance(values, list) and last < len(values)):
        raise ValueError(f"key {key!r}: there is no [{last}]")
    if isinstance(last, str) and not isinstance(values, dict):
        raise ValueError(f"key {key!r}: {last!r} is of no section")
    values[last] = value


class Scenario:
    """What a scenario file says: a map, vehicles, what moves, what is measured.

    Keys are those of the files (docs/scenario.md), and they are checked in the same way: an InputError names the key
    that is wrong and what would do. A scenario does not change; `replace` makes another.
    """

    _handle: _pointflight._Scenario

    def __init__(self, values: Union[Path, Mapping[str, Any], Scenario]) -> None:
        """values: the path of a file, or its keys: `{"map": "hall.pfmap", "vehicle": {"start": [2, 3, 1.5]}}`.
        Relative paths in keys are taken from the working folder."""
        if isinstance(values, Scenario):
            self._handle = values._handle
        elif isinstance(values, Mapping):
            self._handle = _pointflight._Scenario.parse(json.dumps(values, default=_plain), "")
        else:
            self._handle = _pointflight._Scenario.load(os.fspath(values))

    @staticmethod
    def parse(text: str, path: Path = "") -> Scenario:
        """Of a file's text. path: relative paths are taken from its folder; it need not exist."""
        return Scenario._of(_pointflight._Scenario.parse(text, os.fspath(path)))

    @staticmethod
    def _of(handle: _pointflight._Scenario) -> Scenario:
        made = Scenario.__new__(Scenario)
        made._handle = handle
        return made

    @property
    def path(self) -> str:
        """Of its file; empty if it has none."""
        return self._handle.path

    @property
    def values(self) -> Dict[str, Any]:
        """A copy of all keys that have an effect, defaults included, as nested dicts and lists."""
        return dict(json.loads(self._handle.json))

    @property
    def text(self) -> str:
        """A file of its own, each key with a comment."""
        return self._handle.text

    @property
    def vehicles(self) -> Sequence[str]:
        """Names of the vehicles, copies included, by number."""
        return tuple(self._handle.names)

    def replace(self, changes: Mapping[str, Any]) -> Scenario:
        """Another with other values: `scenario.replace({"seed": 4, "vehicles[0].start": (2, 3, 1.5)})`."""
        values = self.values
        for key, value in changes.items():
            _set(values, key, value)
        return Scenario.parse(json.dumps(values, default=_plain), self.path)

    def __reduce__(self) -> Any:
        return Scenario.parse, (self.text, self.path)

    def __getitem__(self, key: str) -> Any:
        """A copy of one key's value: "seed", "vehicles"."""
        return self.values[key]

    def __repr__(self) -> str:
        return f"<Scenario {self.path or 'in memory'}: {', '.join(self.vehicles)}>"


class Vehicle:
    """A vehicle: one of those that are shipped (`pointflight vehicle list`), or a file of one's own."""

    def __init__(self, name: Path = "quad_330") -> None:
        """Raises InputError that lists the names."""
        self._handle = _pointflight._Vehicle.load(os.fspath(name))

    @staticmethod
    def _of(handle: _pointflight._Vehicle) -> Vehicle:
        made = Vehicle.__new__(Vehicle)
        made._handle = handle
        return made

    @property
    def title(self) -> str:
        """Name for people."""
        return self._handle.title

    @property
    def mass(self) -> float:
        """kg."""
        return self._handle.mass

    @property
    def weight(self) -> float:
        """N, by the gravity that the dynamics use."""
        return self._handle.weight

    @property
    def rotors(self) -> int:
        """How many it has."""
        return self._handle.rotor_count

    @property
    def hover_speed(self) -> float:
        """Of each rotor, rad/s."""
        return self._handle.hover_speed

    @property
    def thrust_max(self) -> float:
        """Of all rotors at their greatest speed, N."""
        return self._handle.thrust_max

    @property
    def values(self) -> Dict[str, Any]:
        """A copy of all keys of its file (docs/vehicles.md), as nested dicts and lists."""
        return dict(json.loads(self._handle.json))

    def __repr__(self) -> str:
        return f"<Vehicle {self.title}>"

"""Flights: `Simulation`."""

from __future__ import annotations

import json
import os
from types import TracebackType
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Type, Union, get_args

from . import _pointflight
from ._pointflight import (
    Acceleration,
    Arm,
    Attitude,
    BodyRates,
    CollisionEvent,
    Disarm,
    Hover,
    ImuSample,
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
)
from .map import Map
from .settings import Path, Scenario

Sample = Union[
    StateSample,
    OdometrySample,
    ImuSample,
    Measurement,
    ScanSample,
    CollisionEvent,
    VehicleEvent,
    ObstacleSample,
    StatusSample,
]
Command = Union[
    RotorSpeeds,
    BodyRates,
    Attitude,
    Acceleration,
    Velocity,
    Position,
    Trajectory,
    Waypoints,
    TakeOff,
    Land,
    Hover,
    Arm,
    Disarm,
]

# numbered as the compiled part's variant is
_BIT = {kind: 1 << i for i, kind in enumerate(get_args(Sample))}
_ALL = (1 << len(_BIT)) - 1


def _bits(kinds: Tuple[Type[Sample], ...]) -> int:
    bits = 0
    for kind in kinds:
        if kind not in _BIT:
            raise TypeError(f"{kind!r}: classes of samples are wanted: {', '.join(k.__name__ for k in _BIT)}")
        bits |= _BIT[kind]
    return bits


def _nanoseconds(time: float) -> int:
    if not 0 <= time <= 1e6:
        raise ValueError(f"time: 0 to 1e6 s are wanted, not {time}")
    return round(time * 1e9)


class CommandRejected(RuntimeError):
    """A vehicle does not take a command: it has crashed, or the command asks for what it has not."""


class Simulation:
    """A run: a function of its scenario, the map, and the commands with the steps that they came at.

    Steps are the scenario's `physics_step`. All that is measured comes as samples, each of a class of its own; name
    those that are wanted (`sim.step(ImuSample, ScanSample)`), others are not made into objects. One run is used by one
    thread at a time; several run side by side.
    """

    def __init__(self, scenario: Union[Scenario, Path, Mapping[str, Any]], map: Optional[Map] = None) -> None:
        """scenario: one, or what makes one: a file's path, or its keys. map: an open one, instead of opening the
        scenario's. Raises InputError if it cannot be flown."""
        self.scenario = Scenario(scenario)
        """As it was given."""
        self._handle = _pointflight._Simulation(self.scenario._handle, None if map is None else map._handle)

    @property
    def vehicles(self) -> Sequence[str]:
        """Names, by number."""
        return self.scenario.vehicles

    @property
    def time(self) -> float:
        """Start of the next step, s."""
        return self._handle.time_ns * 1e-9

    @property
    def time_ns(self) -> int:
        """The same, exact, in nanoseconds."""
        return self._handle.time_ns

    @property
    def is_running(self) -> bool:
        """False once the run has ended: steps do nothing then."""
        return self._handle.is_running

    @property
    def end(self) -> str:
        """Why it has ended: "completed", "collision", ...; "running" before."""
        return self._handle.end

    @property
    def summary(self) -> Dict[str, Any]:
        """What happened so far: what summary.json has."""
        return dict(json.loads(self._handle.summary))

    def number(self, vehicle: Union[int, str]) -> int:
        """Of a vehicle by its name. Raises KeyError or IndexError if there is none."""
        if isinstance(vehicle, str):
            if vehicle not in self.vehicles:
                raise KeyError(f"vehicle {vehicle!r}: there are {', '.join(self.vehicles)}")
            return self.vehicles.index(vehicle)
        if not 0 <= vehicle < len(self.vehicles):
            raise IndexError(f"vehicle {vehicle}: there are {len(self.vehicles)}, counted from 0")
        return vehicle

    def command(self, vehicle: Union[int, str], command: Command) -> None:
        """Tells a vehicle what to do from the next step on. Raises CommandRejected if it does not."""
        why = self._handle.command(self.number(vehicle), command)
        if why is not None:
            raise CommandRejected(why)

    def status(self, vehicle: Union[int, str] = 0) -> StatusSample:
        """How a vehicle fares now: true pose, clearance, collisions."""
        return self._handle.status(self.number(vehicle))

    def sensors(self, vehicle: Union[int, str] = 0) -> Sequence[Optional[str]]:
        """Kinds by `Measurement.sensor`; None for odometry, IMU and LiDARs, whose samples have classes of their own."""
        return tuple(self._handle.sensors(self.number(vehicle)))

    def step(self, *kinds: Type[Sample]) -> List[Sample]:
        """One step, and its samples of these kinds in the order in which they arrive; without any, of all."""
        return self._handle.advance(0, _bits(kinds) if kinds else _ALL)

    def advance_to(self, time: float, *kinds: Type[Sample]) -> List[Sample]:
        """The same of all steps until `time` (s, from the start of the run) or the end of the run. Other threads run
        meanwhile, and Ctrl-C ends it between two steps; samples of the steps before are lost then."""
        until = _nanoseconds(time)
        if until <= self.time_ns:
            return []
        return self._handle.advance(until, _bits(kinds) if kinds else _ALL)

    def samples(self, *kinds: Type[Sample], until: Optional[float] = None) -> Iterator[Sample]:
        """Steps and gives each sample as it comes; a command given meanwhile holds from the next step on. until: s;
        without it, to the end of the run."""
        last = None if until is None else _nanoseconds(until)
        bits = _bits(kinds) if kinds else _ALL
        handle = self._handle
        while handle.is_running and (last is None or handle.time_ns < last):
            yield from handle.advance(0, bits)

    def state(self) -> SimulationState:
        """All that changes, to be kept for `restore`. It holds what Python sensors and controllers remember as they
        gave it: give new objects instead of changing old ones."""
        return self._handle.state()

    def restore(self, state: SimulationState) -> None:
        """Goes on from a state of this run or of a fork: the same bytes as the first time."""
        self._handle.restore(state)

    def fork(self) -> Simulation:
        """A copy that goes its own way from here, and shares what does not change."""
        made = Simulation.__new__(Simulation)
        made.scenario = self.scenario
        made._handle = self._handle.fork()
        return made

    def record(self, folder: Path, *, replace: bool = False) -> Recording:
        """Writes the run into a folder, as `pointflight fly -o` does, from its first step on:

            with sim.record("run"):
                for sample in sim.samples(): ...

        The files appear when the block is left; after an exception nothing is left of them. replace: an earlier run
        that lies there (and only what it wrote).
        """
        self._handle.record(os.fspath(folder), replace)
        return Recording(self)

    def interrupt(self) -> None:
        """Ends the run early."""
        self._handle.interrupt()

    def __repr__(self) -> str:
        return f"<Simulation of {', '.join(self.vehicles)} at {self.time:.3f} s, {self.end}>"


class Recording:
    """A run's folder while it is written: `Simulation.record`."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self._simulation._handle.end_recording(kind is None)

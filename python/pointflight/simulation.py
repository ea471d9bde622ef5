"""Flights: `Simulation`."""

from __future__ import annotations

import copyreg
import json
import os
from types import TracebackType
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple, Type, Union, get_args

from numpy.typing import ArrayLike

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
    StateSample,
    StatusSample,
    TakeOff,
    Trajectory,
    VehicleEvent,
    Velocity,
    Waypoints,
)
from .map import Map
from .poses import numbers
from .rays import Hits
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

def _trajectory(kind: str, arguments: Tuple[Any, ...]) -> Trajectory:
    """Of what `Trajectory._parts` says."""
    made: Trajectory = getattr(Trajectory, kind)(*arguments)
    return made


copyreg.pickle(Trajectory, lambda given: (_trajectory, given._parts))

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


_Entry = Tuple[int, int, Optional[Command]]  # ns, vehicle, command; without one: it was interrupted


class _Log:
    """What a run was told: what came before, and the last."""

    def __init__(self, before: Optional[_Log], entry: _Entry) -> None:
        self.before, self.entry = before, entry


def _entries(log: Optional[_Log]) -> List[_Entry]:
    found: List[_Entry] = []
    while log is not None:
        found.append(log.entry)
        log = log.before
    return found[::-1]


class SimulationState:
    """All that changes of a run, as `Simulation.state` gives it. A pickled one is the commands that led to it: to
    restore it the run is flown again up to there."""

    def __init__(
        self, scenario: Scenario, log: Optional[_Log], time_ns: int, handle: Optional[_pointflight._State]
    ) -> None:
        """Of `Simulation.state`."""
        self._scenario, self._log, self._time_ns, self._handle = scenario, log, time_ns, handle

    @property
    def time(self) -> float:
        """Start of the next step, s."""
        return self._time_ns * 1e-9

    def __reduce__(self) -> Any:
        return _unpickled_state, (self._scenario, _entries(self._log), self._time_ns)

    def __repr__(self) -> str:
        return f"<SimulationState at {self.time:.3f} s>"


def _unpickled_state(
    scenario: Scenario, entries: List[_Entry], time_ns: int
) -> SimulationState:
    log: Optional[_Log] = None
    for entry in entries:
        log = _Log(log, entry)
    return SimulationState(scenario, log, time_ns, None)


class Link:
    """A party to a run that `Simulation.run` flies. Derive it; an exception in it ends the run and comes out of `run`.

    What it is told goes through here alone: the simulation is in use meanwhile.
    """

    kinds: Tuple[Type[Sample], ...] = ()
    """Classes of the samples that it wants; none: all."""
    answers: Tuple[Type[Sample], ...] = ()
    """Of those that it answers by a command: lockstep waits for it."""

    def open(self) -> None:
        """Before the first step."""

    def on_sample(self, sample: Sample) -> None:
        """A sample of its kinds."""

    def take_orders(self, time: float) -> Iterable[Tuple[Union[int, str], Command]]:
        """After each step: vehicles by number or name, and what each is to do from `time` (s) on."""
        return ()

    def close(self) -> None:
        """After the last step."""


class _Party:
    """A link as the compiled part calls it."""

    def __init__(self, link: Link, simulation: Simulation) -> None:
        self.open, self.on_sample, self.close = link.open, link.on_sample, link.close
        self._link, self._simulation = link, simulation
        self._idle = type(link).take_orders is Link.take_orders

    def take_orders(self, time_ns: int) -> Optional[List[Tuple[int, Command]]]:
        if self._idle:
            return None
        orders = []
        for vehicle, command in self._link.take_orders(time_ns * 1e-9):
            number = self._simulation.number(vehicle)
            self._simulation._log = _Log(self._simulation._log, (time_ns, number, command))
            orders.append((number, command))
        return orders


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
        self._map = map
        self._handle = _pointflight._Simulation(self.scenario._handle, None if map is None else map._handle)
        self._log: Optional[_Log] = None
        self._start = self._handle.state()

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
        number = self.number(vehicle)
        why = self._handle.command(number, command)
        self._log = _Log(self._log, (self._handle.time_ns, number, command))  # a rejected one is counted, too
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

    def run(self, *links: Link, rate: float = 0.0, lockstep: float = 0.0) -> str:
        """Flies to the end of the run, with links that are given samples and asked for commands; returns `end`.

        rate: simulated seconds per second of the wall clock; 0: as fast as it goes. lockstep: links are waited for so
        many seconds until they answer what they want to (`Link.answers`). Ctrl-C ends it between two steps.
        """
        if not (rate >= 0.0 and lockstep >= 0.0):
            raise ValueError(f"rate, lockstep: 0 or above are wanted, not {rate} and {lockstep}")
        given = []
        for link in links:
            if not isinstance(link, Link):
                raise TypeError(f"{link!r}: a Link is wanted")
            given.append((_Party(link, self), _bits(link.kinds) if link.kinds else _ALL, _bits(link.answers)))
        self._handle.run(given, rate, lockstep)
        return self.end

    def state(self) -> SimulationState:
        """All that changes, to be kept for `restore`. It holds what Python sensors and controllers remember as they
        gave it: give new objects instead of changing old ones. It can be pickled, and so can a simulation."""
        return SimulationState(self.scenario, self._log, self.time_ns, self._handle.state())

    def restore(self, state: SimulationState) -> None:
        """Goes on from a state of this run or of a fork: the same bytes as the first time. One that was unpickled is
        of a run of the same scenario, which is flown again up to there."""
        if state._handle is not None:
            self._handle.restore(state._handle)
            self._log = state._log
            return
        if state._scenario.text != self.scenario.text:
            raise ValueError("state: of a run of another scenario")
        self._handle.restore(self._start)
        self._fly_again(_entries(state._log), state._time_ns)

    def fork(self) -> Simulation:
        """A copy that goes its own way from here, and shares what does not change."""
        made = Simulation.__new__(Simulation)
        made.scenario, made._map, made._log, made._start = self.scenario, self._map, self._log, self._start
        made._handle = self._handle.fork()
        return made

    def __reduce__(self) -> Any:
        return _unpickled, (self.scenario, self._map, _entries(self._log), self.time_ns)

    def _fly_again(self, entries: List[_Entry], time_ns: int) -> None:
        self._log = None
        for entry in entries:
            self._fly_to(entry[0])
            if entry[2] is None:
                self._handle.interrupt()
            else:
                self._handle.command(entry[1], entry[2])
            self._log = _Log(self._log, entry)
        self._fly_to(time_ns)

    def _fly_to(self, time_ns: int) -> None:
        if time_ns > self._handle.time_ns and self._handle.is_running:
            self._handle.advance(time_ns, 0)

    def record(self, folder: Path, *, replace: bool = False) -> Recording:
        """Writes the run into a folder, as `pointflight fly -o` does, from its first step on:

            with sim.record("run"):
                for sample in sim.samples(): ...

        The files appear when the block is left; after an exception nothing is left of them. replace: an earlier run
        that lies there (and only what it wrote).
        """
        self._handle.record(os.fspath(folder), replace)
        return Recording(self)

    def raycast(self, origins: ArrayLike, directions: ArrayLike, range_max: float = 100.0) -> Hits:
        """What rays hit at `time`, as `pointflight.raycast`: the map, vehicles (their own as well) and obstacles."""
        return Hits(*self._handle.raycast(numbers(origins), numbers(directions), range_max))

    def interrupt(self) -> None:
        """Ends the run early."""
        self._log = _Log(self._log, (self._handle.time_ns, -1, None))
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


def _unpickled(scenario: Scenario, map: Optional[Map], entries: List[_Entry], time_ns: int) -> Simulation:
    made = Simulation(scenario, map)
    made._fly_again(entries, time_ns)
    return made

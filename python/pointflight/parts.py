"""Parts of runs of one's own, by name in scenarios from then on: `add_controller`, `add_sensor`, `add_renderer`."""

from __future__ import annotations

from typing import Any, Callable, Mapping, Optional, Tuple

from numpy.typing import ArrayLike, NDArray

from . import _pointflight
from ._pointflight import BodyState, SensorInput
from .settings import Vehicle

Update = Callable[[BodyState, Any, float, Any], Tuple[ArrayLike, Any]]


class Controller:
    """One of the controllers there are, "cascade" or "geometric": for controllers that are built on it."""

    def __init__(self, name: str, vehicle: Vehicle) -> None:
        """Raises InputError that lists the names."""
        self._handle = _pointflight.Controller(name, vehicle._handle)

    def update(
        self, state: BodyState, setpoint: Any, dt: float, memory: Optional[_pointflight.ControllerMemory] = None
    ) -> Tuple[NDArray[Any], _pointflight.ControllerMemory]:
        """Rotor speeds (n,) in rad/s for a period of dt seconds, and what it remembers, to be given back next."""
        return self._handle.update(state, setpoint, dt, memory)


def add_controller(
    name: str, make: Callable[[Vehicle], Update], *, help: str = "of a program's own", tilt_max_deg: float = 180.0
) -> None:
    """A controller for `controller: NAME` of vehicles.

    make: is called once for each vehicle, with it, and gives a function of (state, setpoint, dt, memory) that gives
    rotor speeds (n,) in rad/s for the next dt seconds, and its memory, None at first. The setpoint is one of
    RotorSpeeds, BodyRates, Attitude, Acceleration, Velocity, Position. Memory must not change once it was given: saved
    states of the run hold it.

    An exception ends the step and comes out of it as it is.
    """

    def made(handle: _pointflight._Vehicle) -> Update:
        return make(Vehicle._of(handle))

    _pointflight._add_controller(name, help, made, tilt_max_deg)


def add_sensor(
    name: str,
    columns: Mapping[str, str],
    measure: Callable[[SensorInput], ArrayLike],
    *,
    rate: float = 10.0,
    settings: Optional[Mapping[str, float]] = None,
    help: str = "of a program's own",
) -> None:
    """A sensor for `sensors: [{kind: NAME}]`.

    columns: names and units of what it measures: {"pressure": "Pa"}; its file and `Measurement.values` have them.
    measure: gives the numbers, one a column, at each instant. rate: in Hz, and settings: keys with their defaults,
    numbers that scenarios may change.
    """
    _pointflight._add_sensor(name, help, list(columns.items()), rate, dict(settings or {}), measure)


def add_renderer(
    name: str,
    change: Callable[[NDArray[Any], NDArray[Any], NDArray[Any]], Optional[NDArray[Any]]],
    *,
    help: str = "of a program's own",
) -> None:
    """A renderer for `renderer: NAME` of LiDARs.

    change: is called for each scan with origins (n, 3) and directions (n, 3) of its rays, world, and what the beam
    renderer hits along them: a structured array (n,) of range (m; negative: nothing), cos_incidence, intensity,
    label and surfel, to be changed, or replaced by what it gives back.
    """
    _pointflight._add_renderer(name, help, change)

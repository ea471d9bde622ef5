"""What happens around the vehicles of an environment: `Conditions`."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..settings import Scenario
from .draws import CONDITIONS, DROPS, bits, draws

Floats = NDArray[np.float64]
Numbers = NDArray[np.uint32]
_KEYS = ("seed", "obstacles", "air", "faults", "surroundings")
_FAULTS = ("rotor", "lidar", "scan_drop")
_CLOCK = 60.0  # s: episodes begin somewhere in the first minute of the obstacles


class Conditions:
    """Obstacles, wind and faults by a scenario's keys, and which of them are drawn anew for each episode.

    All environments of a map share its obstacles; each episode begins at another time of theirs.
    """

    def __init__(
        self,
        scenario: Mapping[str, Any],
        vary: Mapping[str, Tuple[ArrayLike, ArrayLike]],
        num_envs: int,
        team: int,
    ) -> None:
        """scenario: "obstacles", "air" and "faults" (rotor, lidar, scan_drop) as a scenario file has them, the "seed"
        of the obstacles, and the "surroundings" of a `Lidar` with a sensor. vary: least and greatest by key:
        "air.wind.mean" (3 each), "faults[0].from", ".until" or ".value", and "mass", a share of the vehicle file's,
        which its controller knows nothing of."""
        for key in scenario:
            if key not in _KEYS:
                raise ValueError(f"scenario: {', '.join(_KEYS)} have an effect here, {key!r} has none")
        self._given = dict(scenario)
        values = Scenario({"map": "-", **scenario}).values
        self.faults: List[Dict[str, Any]] = values.get("faults", [])
        for i, fault in enumerate(self.faults):
            if fault["kind"] not in _FAULTS:
                kind = fault["kind"]
                raise ValueError(f"faults[{i}].kind: {', '.join(_FAULTS)} have an effect here, {kind!r} has none")
        self.has_obstacles = bool(values.get("obstacles"))
        self._team = team
        wind = values["air"]["wind"]["mean"]
        plain: Dict[str, ArrayLike] = {"mass": 1.0, "air.wind.mean": wind}
        for i, fault in enumerate(self.faults):
            for key in ("from", "until", "value"):
                plain[f"faults[{i}].{key}"] = fault.get(key, 0.0)
        for key in vary:
            if key not in plain:
                raise ValueError(f"vary: {', '.join(plain)} can be drawn, not {key!r}")
        self._columns: Dict[str, slice] = {}
        low: List[float] = []
        high: List[float] = []
        for key, value in plain.items():
            ends = [np.atleast_1d(np.asarray(end, np.float64)) for end in vary.get(key, (value, value))]
            size = np.atleast_1d(np.asarray(value)).shape
            if len(ends) != 2 or any(end.shape != size or not np.isfinite(end).all() for end in ends):
                raise ValueError(f"vary: {key!r}: its least and its greatest value are wanted, {size[0]} numbers each")
            self._columns[key] = slice(len(low), len(low) + size[0])
            low += list(ends[0])
            high += list(ends[1])
        self._low, self._high = np.array(low), np.array(high)
        if min(low[0], high[0]) <= 0.0:
            raise ValueError("vary: 'mass': a share above 0 is wanted")
        self._drawn = np.zeros((num_envs, len(low)))
        self.clock = np.zeros(num_envs)
        """(n,): s on the clock of the obstacles when the episode began."""

    def scenario_in(self, path: str) -> Scenario:
        """The scenario of a map."""
        return Scenario({"map": path, **self._given})

    def begin(self, which: Numbers, seeds: NDArray[np.uint64], episodes: NDArray[np.uint64]) -> None:
        """Draws those of new episodes; vehicles of a team share them."""
        u = draws(seeds[which], episodes[which], 1 + len(self._low), CONDITIONS)
        self._drawn[which] = self._low + u[:, 1:] * (self._high - self._low)
        if self.has_obstacles:
            self.clock[which] = _CLOCK * u[:, 0]

    def starts(self, which: Numbers, positions: Floats, facing: Floats) -> Floats:
        """(m, 11): rows for the compiled part."""
        drawn, clock = self._drawn[which], self.clock[which]
        wind = drawn[:, self._columns["air.wind.mean"]]
        return np.concatenate([positions, facing, wind, drawn[:, self._columns["mass"]], clock[:, None]], 1)

    def flight_seeds(
        self, which: Numbers, seeds: NDArray[np.uint64], episodes: NDArray[np.uint64]
    ) -> NDArray[np.uint64]:
        """(m,): of each vehicle its own, for gusts and what its sensor reports."""
        found = bits(seeds[which], episodes[which], self._team, CONDITIONS + np.uint64(1 << 16))
        seed: NDArray[np.uint64] = found[np.arange(len(which)), which % self._team] >> np.uint64(1)
        return seed

    def rotor_shares(self, elapsed: Floats) -> Dict[int, Floats]:
        """By rotor that can fail: (n,), the share of its speed that is left; of several faults the least."""
        shares: Dict[int, Floats] = {}
        for i, fault in enumerate(self.faults):
            if fault["kind"] == "rotor":
                share = np.where(self._acts(i, elapsed), self._of(i, "value"), 1.0)
                shares[fault["index"]] = np.minimum(share, shares.get(fault["index"], np.ones_like(share)))
        return shares

    def dead(self, elapsed: Floats) -> Optional[NDArray[np.bool_]]:
        """(n,): whose LiDAR sees nothing; None if it always does."""
        found: Optional[NDArray[np.bool_]] = None
        for i, fault in enumerate(self.faults):
            if fault["kind"] == "lidar":
                now = self._acts(i, elapsed)
                found = now if found is None else found | now
        return found

    def dropped(
        self,
        elapsed: Floats,
        seeds: NDArray[np.uint64],
        episodes: NDArray[np.uint64],
        steps: NDArray[np.int64],
    ) -> Optional[NDArray[np.bool_]]:
        """(n,): whose image is lost, so that the one before stays; None if none ever is."""
        found: Optional[NDArray[np.bool_]] = None
        for i, fault in enumerate(self.faults):
            if fault["kind"] == "scan_drop":
                first = DROPS + (steps.astype(np.uint64) << np.uint64(8)) + np.uint64(i)
                lost = self._acts(i, elapsed) & (draws(seeds, episodes, 1, first)[:, 0] < self._of(i, "value"))
                found = lost if found is None else found | lost
        return found

    def _of(self, fault: int, key: str) -> Floats:
        values: Floats = self._drawn[:, self._columns[f"faults[{fault}].{key}"]][:, 0]
        return values

    def _acts(self, fault: int, elapsed: Floats) -> NDArray[np.bool_]:
        until = self._of(fault, "until")
        now: NDArray[np.bool_] = (elapsed >= self._of(fault, "from")) & ((until == 0.0) | (elapsed < until))
        return now

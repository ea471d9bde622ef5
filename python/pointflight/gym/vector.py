"""Many environments at once: `VectorEnv`."""

from __future__ import annotations

import enum
import math
import os
from types import MappingProxyType
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _pointflight
from ..map import Map
from ..poses import rotations
from ..settings import Path, Vehicle
from .conditions import Conditions
from .courses import TASKS
from .draws import draws
from .images import Lidar, Observation, beams_of, grid_of, measured
from .spaces import Box, batched
from .spaces import Dict as DictSpace
from .tasks import Floats, States, Task

try:
    from gymnasium.vector import AutoresetMode as AutoresetMode
    from gymnasium.vector import VectorEnv as _Base
except ImportError:
    _Base = object

    class AutoresetMode(enum.Enum):  # type: ignore[no-redef]
        """When an environment that has ended begins anew, as gymnasium names it."""

        NEXT_STEP = "NextStep"
        SAME_STEP = "SameStep"
        DISABLED = "Disabled"


_MODES = {
    "next_step": AutoresetMode.NEXT_STEP,
    "same_step": AutoresetMode.SAME_STEP,
    "disabled": AutoresetMode.DISABLED,
}


class VectorEnv(_Base):  # type: ignore[misc]
    """Vehicles, each alone in a map of a real place, that learn a task: gymnasium's vector interface.

    Observations: "range" (n, rows, columns), ranges / range_max, 1 where nothing is hit (without a LiDAR it is
    missing), and "state" (n, k), as the task says. Actions (n, a) from -1 to 1: velocity (ahead, left, up in the
    heading's frame, times `speed`) and yaw rate (times `yaw_rate`); the same of acceleration (times `acceleration`);
    body rates (times the vehicle's greatest) and thrust (-1: none, 0: its weight, 1: twice that); or a speed of each rotor
    (-1: the least, 0: hover, 1: the greatest).

    What an environment does follows from its own seed and its actions: not from how many there are, nor from threads
    or the processor. All vehicles fly by the geometric controller.
    """

    def __init__(
        self,
        map: Union[Map, Path, Sequence[Union[Map, Path]]],
        num_envs: int = 16,
        *,
        task: Union[str, Task] = "goal",
        lidar: Optional[Lidar] = Lidar(),
        action: str = "velocity",
        vehicle: Union[Vehicle, Path] = "quad_330",
        scenario: Mapping[str, Any] = MappingProxyType({}),
        vary: Mapping[str, Tuple[ArrayLike, ArrayLike]] = MappingProxyType({}),
        team: Optional[int] = None,
        speed: float = 3.0,
        yaw_rate: float = 1.0,
        acceleration: float = 5.0,
        action_period: float = 0.1,
        physics_step: float = 0.005,
        steps_per_control: int = 1,
        autoreset: str = "next_step",
        copy: bool = True,
        renderer: str = "beam",
        render_mode: Optional[str] = None,
    ) -> None:
        """map: one, or several: environments are dealt out to them in blocks. task: a name of `TASKS`, or one of your
        own. scenario, vary: what happens around, as `Conditions` takes it. team: vehicles 0 to team - 1 are in one
        place, see and hit each other and end together, and so are the next ones (1, 2, 4 or 8; without it, the
        task's). action_period: s between actions. physics_step: s; `steps_per_control` of them are flown with the same
        rotor commands (docs/learning.md: what coarser ones cost). autoreset: "next_step", "same_step" or "disabled".
        copy: False: observations are read-only views that the next step changes. renderer: of the ranges: "gpu" has the
        same bits on a GPU, all environments of a map at a time; "auto": where there is one.
        """
        if num_envs < 1:
            raise ValueError(f"num_envs: 1 or more, not {num_envs}")
        if autoreset not in _MODES:
            raise ValueError(f"autoreset: {', '.join(_MODES)}, not {autoreset!r}")
        if render_mode is not None:
            raise ValueError("render_mode: there is none; fly a policy in a Simulation to see it")
        if isinstance(task, str) and task not in TASKS:
            raise ValueError(f"task: {', '.join(TASKS)}, or a Task, not {task!r}")
        self.num_envs, self.action, self.copy = num_envs, action, copy
        self.task: Task = TASKS[task]() if isinstance(task, str) else task
        self.vehicle = vehicle if isinstance(vehicle, Vehicle) else Vehicle(vehicle)
        self.lidar, self.action_period, self.render_mode = lidar, action_period, render_mode
        self.metadata = {"render_modes": [], "render_fps": 1.0 / action_period, "autoreset_mode": _MODES[autoreset]}
        self._mode = _MODES[autoreset]
        self.team = self.task.team if team is None else team
        if self.team not in (1, 2, 4, 8) or num_envs % self.team != 0:
            raise ValueError(f"team: 1, 2, 4 or 8, and whole ones, not {self.team} of {num_envs}")
        self.conditions = Conditions(scenario, vary, num_envs, self.team)
        maps = [map] if isinstance(map, (Map, str, os.PathLike)) else list(map)
        self.maps = [one if isinstance(one, Map) else Map.open(one) for one in maps]
        if not 1 <= len(self.maps) <= num_envs // self.team:
            raise ValueError(f"map: {len(self.maps)} maps for {num_envs // self.team} environments")
        directions, shares = beams_of(lidar)
        self._directions = np.zeros((0, 3)) if lidar is None else grid_of(lidar)
        teams = num_envs // self.team
        bounds = [teams * k // len(self.maps) * self.team for k in range(len(self.maps) + 1)]
        self._blocks = [slice(begin, end) for begin, end in zip(bounds[:-1], bounds[1:])]
        greatest = math.sqrt(3.0) * speed if action == "velocity" else 0.0  # along all three axes at once
        self._flights = [
            _pointflight._Flights(
                place._handle, self.vehicle._handle, block.stop - block.start, action, action_period, physics_step,
                steps_per_control, greatest, directions, shares, 1.0 if lidar is None else lidar.range_max,
                1 if lidar is None else lidar.pool[0] * lidar.pool[1],
                "" if lidar is None or lidar.sensor is None else lidar.sensor,
                self.conditions.scenario_in(place.info().name)._handle, self.team, renderer,
            )
            for place, block in zip(self.maps, self._blocks)
        ]  # fmt: skip
        self._places: Dict[Any, List[Floats]] = {}
        self._scale = {"speed": speed, "yaw_rate": yaw_rate, "acceleration": acceleration}
        self._scale_actions(speed, yaw_rate, acceleration)
        width = self.vehicle.rotors if action == "rotor_speeds" else 4
        self.single_action_space = Box(-1.0, 1.0, (width,), np.float32)
        self.action_space = batched(self.single_action_space, num_envs)
        self.last_actions = np.zeros((num_envs, width))
        """(n, a): of the actions before."""
        self.elapsed = np.zeros(num_envs)
        """(n,): s since the start of the episode."""
        self.moved = np.zeros(num_envs, np.bool_)
        """(n,): by the last action; those that had ended stand still."""
        self.seeds = np.zeros(num_envs, np.uint64)
        """(n,)"""
        self._episodes = np.zeros(num_envs, np.uint64)
        self._steps = np.zeros(num_envs, np.int64)
        self._ended = np.ones(num_envs, np.bool_)
        self._was_reset = False
        self._all = np.arange(num_envs, dtype=np.uint32)
        self._image: Optional[NDArray[np.float32]] = None
        self.task.begin(self)
        spaces = {"state": Box(-np.inf, np.inf, (self.task.state_size,), np.float32)}
        if lidar is not None:
            spaces = {"range": Box(0.0, 1.0, (lidar.rows, lidar.columns), np.float32), **spaces}
        self.single_observation_space = DictSpace(spaces)
        self.observation_space = batched(self.single_observation_space, num_envs)

    def about(self) -> Dict[str, Any]:
        """What whoever flies a policy that has learned here needs to know: `Policy.about`."""
        kind = next((name for name, task in TASKS.items() if type(self.task) is task), type(self.task).__name__)
        scale = {name: float(value) for name, value in self._scale.items()}
        about = {"task": kind, "time_limit": self.task.time_limit, "action": self.action, **scale}
        about["action_period"] = self.action_period
        if self.lidar is not None:
            about["lidar"] = self.lidar._asdict()
        return about

    def _scale_actions(self, speed: float, yaw_rate: float, acceleration: float) -> None:
        weight = self.vehicle.weight
        rates = self.vehicle.values["controller"]["body_rate_max"]
        size = {"velocity": speed, "acceleration": acceleration}.get(self.action, 1.0)
        self._zero, self._up = np.zeros(4), np.array([size, size, size, yaw_rate])
        if self.action == "body_rates":
            self._zero, self._up = np.array([0.0, 0.0, 0.0, weight]), np.array([rates, rates, rates, weight])
        self._down = self._up
        if self.action == "rotor_speeds":
            rotor, count = self.vehicle.values["rotor"], self.vehicle.rotors
            hover = self.vehicle.hover_speed
            self._zero = np.full(count, hover)
            self._up = np.full(count, rotor["speed_max"] - hover)
            self._down = np.full(count, hover - rotor["speed_min"])

    # ---- for tasks ----

    def draws(self, which: NDArray[np.uint32], count: int) -> Floats:
        """(m, count): uniform in [0, 1), addressed by the seeds of these environments and their episodes."""
        return draws(self.seeds[which], self._episodes[which], count)

    def maps_of(self, which: NDArray[np.uint32]) -> Iterator[Tuple[int, NDArray[np.int64]]]:
        """For each map that some of these environments are in: its number in `maps`, and rows of `which`."""
        for k, rows, _ in self._parts(which):
            yield k, rows

    def places(
        self, which: NDArray[np.uint32], height: Tuple[float, float], clearance: float
    ) -> Iterator[Tuple[NDArray[np.int64], Floats]]:
        """For each map that some of these environments are in: rows of `which`, and positions (k, 3) in the map that
        are free by `clearance` and so high above ground, the same whatever the seeds."""
        key = (height, clearance)
        if key not in self._places:
            found = []
            for place, flights in zip(self.maps, self._flights):
                positions = flights.free_positions(place.bounds, clearance, *height, 4096, 1)
                if len(positions) < 2:
                    raise ValueError(
                        f"{place!r}: no positions that are free by {clearance} m, "
                        f"{height[0]} to {height[1]} m above ground"
                    )
                found.append(positions)
            self._places[key] = found
        for k, rows, _ in self._parts(which):
            yield rows, self._places[key][k]

    def positions(
        self, which: NDArray[np.uint32], u: Floats, height: Tuple[float, float], clearance: float
    ) -> Floats:
        """(m, 3): of `places`, those that draws u (m,) choose, or the next that are clear of obstacles, too."""
        chosen = np.empty((len(which), 3))
        for rows, places in self.places(which, height, clearance):
            first = (u[rows] * len(places)).astype(np.int64)
            chosen[rows] = places[first]
            if not self.conditions.has_obstacles:
                continue
            for k in range(1, 16):
                blocked = rows[~self.is_clear(which[rows], chosen[rows], clearance)]
                if len(blocked) == 0:
                    break
                chosen[blocked] = places[((u[blocked] * len(places)).astype(np.int64) + k) % len(places)]
        return chosen

    def is_clear(self, which: NDArray[np.uint32], positions: Floats, clearance: float) -> NDArray[np.bool_]:
        """(m,): whether positions (m, 3) are so far away from obstacles, m, 1.5 at most, when the episodes begin."""
        clear = np.ones(len(which), np.bool_)
        for k, rows, own in self._parts(which):
            clock = self.conditions.clock[which[rows]]
            clear[rows] = self._flights[k].clearance_of_obstacles(positions[rows], clock) >= min(clearance, 1.5)
        return clear

    def place(self, which: NDArray[np.uint32], positions: Floats, facing: Floats) -> None:
        """Vehicles begin anew, hovering at positions (m, 3) and heading for others (m, 3), world, m."""
        starts = self.conditions.starts(which, positions, facing)
        seeds = self.conditions.flight_seeds(which, self.seeds, self._episodes)
        for k, rows, own in self._parts(which):
            self._flights[k].place(own, starts[rows], seeds[rows])

    def points(self) -> Tuple[Floats, NDArray[np.bool_]]:
        """Where the beams of the last action's observation hit, (n, cells, 3), m, world, and which did, (n, cells).
        Those of a rolling LiDAR are taken as if they were measured at its end, pooled ones as if in the middle of
        their cell."""
        if self.lidar is None:
            raise ValueError("points: there is no LiDAR")
        s = self.states
        ranges = self._ranges().astype(np.float64)
        dx, dy, dz = self._directions.T
        ahead = ranges * self.lidar.range_max
        turned = rotations(s.orientation)[..., None]
        world = np.empty((*ranges.shape, 3))
        for k in range(3):
            along = turned[:, k, 0] * dx + turned[:, k, 1] * dy + turned[:, k, 2] * dz
            world[..., k] = s.position[:, k, None] + ahead * along
        return world, ranges < 1.0

    @property
    def states(self) -> States:
        """The true states of all vehicles."""
        tables = [flights.table for flights in self._flights]
        return States(tables[0] if len(tables) == 1 else np.concatenate(tables))

    # ---- gymnasium's interface ----

    def reset(
        self, *, seed: Union[None, int, Sequence[Optional[int]]] = None, options: Optional[Mapping[str, Any]] = None
    ) -> Tuple[Observation, Dict[str, Any]]:
        """Begins anew. seed: environment i gets seed + i (those of team i), or the i-th of a list; without one, each
        goes on to its next episode. options: {"reset_mask": (n,) bool}: only these, whole teams."""
        mask = np.ones(self.num_envs, np.bool_)
        if options is not None and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
                raise ValueError(f"reset_mask: bool ({self.num_envs},) with some True is wanted")
            if (self._of_teams(mask) != mask).any():
                raise ValueError(f"reset_mask: whole teams of {self.team} are wanted")
        if seed is None and not self._was_reset:
            seed = int(np.random.SeedSequence().generate_state(1)[0])
        if seed is not None:
            seeds: List[Optional[int]]
            if isinstance(seed, (int, np.integer)):
                seeds = [int(seed) + i // self.team for i in range(self.num_envs)]
            else:
                seeds = list(seed)
            if len(seeds) != self.num_envs or any(s is not None and s < 0 for s in seeds):
                raise ValueError(f"seed: 0 or above, or {self.num_envs} of them")
            if any(seeds[i] != seeds[i - i % self.team] for i in range(self.num_envs)):
                raise ValueError(f"seed: one and the same for all {self.team} of a team")
            for i, one in enumerate(seeds):
                if one is not None and mask[i]:
                    self.seeds[i], self._episodes[i] = one, 0
        self._was_reset = True
        self._begin(self._all[mask])
        self._measure(self._all[mask])
        return self._observation(), {}

    def step(
        self, actions: ArrayLike
    ) -> Tuple[Observation, Floats, NDArray[np.bool_], NDArray[np.bool_], Dict[str, Any]]:
        """Flies on by one action period. Returns observation, reward (n,), terminated (n,), truncated (n,) and infos:
        what the task tells, an array (n,) each, and with "same_step" "final_obs" and "final_info"."""
        if not self._was_reset:
            raise RuntimeError("step: reset comes first")
        asked = np.asarray(actions, dtype=np.float64)
        if asked.shape != self.last_actions.shape:
            raise ValueError(f"actions: shape {self.last_actions.shape} is wanted, not {asked.shape}")
        if not np.isfinite(asked).all():
            raise ValueError("actions: finite numbers are wanted")
        asked = np.clip(asked, -1.0, 1.0)
        moves = self.moved = ~self._ended
        commands = self._zero + asked * np.where(asked < 0, self._down, self._up)
        for rotor, left in self.conditions.rotor_shares(self.elapsed).items():
            for k, rows, own in self._parts(self._all[moves]):
                self._flights[k].set_rotor(own, rotor, left[moves][rows])
        for block, flights in zip(self._blocks, self._flights):
            flights.step(commands[block], moves[block])
        difference = asked - self.last_actions
        change = difference[:, 0] * difference[:, 0]
        for k in range(1, difference.shape[1]):
            change = change + difference[:, k] * difference[:, k]
        self.last_actions = np.where(moves[:, None], asked, self.last_actions)
        self._steps += moves
        self.elapsed = self._steps * self.action_period
        self._measure(self._all[moves])
        reward, terminated, info = self.task.judge(self, change)
        terminated = self._of_teams(terminated & moves)
        truncated = (self._steps >= round(self.task.time_limit / self.action_period)) & moves & ~terminated
        reward = np.where(moves, reward, 0.0)
        infos: Dict[str, Any] = {}
        for name, values in info.items():
            infos[name], infos["_" + name] = values, moves
        ended_before, self._ended = self._ended, (terminated | truncated) | self._ended
        again = np.zeros(0, np.uint32)
        if self._mode is AutoresetMode.NEXT_STEP:
            again = self._all[ended_before]
        elif self._mode is AutoresetMode.SAME_STEP and self._ended.any():
            infos = self._with_finals(infos)
            again = self._all[self._ended]
        self._begin(again)
        self._measure(again)
        return self._observation(), reward, terminated, truncated, infos

    def _with_finals(self, infos: Dict[str, Any]) -> Dict[str, Any]:
        ended = self._ended
        last = self._observation()
        finals = np.empty(self.num_envs, dtype=object)
        for i in np.flatnonzero(ended):
            finals[i] = {name: values[i].copy() for name, values in last.items()}
        final_info = {name: values for name, values in infos.items() if not name.startswith("_")}
        final_info.update({"_" + name: ended.copy() for name in final_info})
        return {
            **infos,
            "final_obs": finals,
            "_final_obs": ended.copy(),
            "final_info": final_info,
            "_final_info": ended.copy(),
        }

    def close(self, **kwargs: Any) -> None:
        """Nothing is open."""

    # ---- within ----

    def _parts(
        self, which: NDArray[np.uint32]
    ) -> Iterator[Tuple[int, NDArray[np.int64], NDArray[np.uint32]]]:
        """For each map that some of these environments are in: its number, rows of `which`, and their numbers there."""
        for k, block in enumerate(self._blocks):
            rows = np.flatnonzero((which >= block.start) & (which < block.stop))
            if len(rows):
                yield k, rows, which[rows] - np.uint32(block.start)

    def _begin(self, which: NDArray[np.uint32]) -> None:
        if len(which) == 0:
            return
        self._steps[which], self._ended[which] = 0, False
        self.elapsed[which] = 0.0
        self.last_actions[which] = 0.0
        self._episodes[which] += np.uint64(1)  # first: the task's later draws are of this episode too
        self.conditions.begin(which, self.seeds, self._episodes)
        self.task.reset(self, which)

    def _of_teams(self, some: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,): in whose team any is."""
        if self.team == 1:
            return some
        return np.repeat(some.reshape(-1, self.team).any(1), self.team)

    def _measure(self, which: NDArray[np.uint32]) -> None:
        if self.lidar is None:
            return
        for k, _, own in self._parts(which):
            self._flights[k].measure(own)

    def _ranges(self) -> NDArray[np.float32]:
        """(n, beams): a view if all are in one map."""
        images = [flights.ranges for flights in self._flights]
        return images[0] if len(images) == 1 else np.concatenate(images)

    def _observation(self) -> Observation:
        seen: Observation = {}
        if self.lidar is not None:
            seen["range"] = self._seen(self._ranges().reshape(self.num_envs, self.lidar.rows, self.lidar.columns))
        seen["state"] = self.task.state(self).astype(np.float32)
        return seen

    def _seen(self, whole: NDArray[np.float32]) -> NDArray[np.float32]:
        """Images (n, rows, columns) with what goes wrong."""
        lidar = self.lidar
        assert lidar is not None
        address = (self.seeds, self._episodes, self._steps)
        image = whole
        if lidar.noise > 0.0 or lidar.dropout > 0.0:
            image = measured(image, lidar, *address)
        dead = self.conditions.dead(self.elapsed)
        if dead is not None:
            image = np.where(dead[:, None, None], np.float32(1.0), image)
        lost = self.conditions.dropped(self.elapsed, *address)
        if lost is not None:
            fresh = ~lost | (self._steps == 0)
            before = np.ones_like(image) if self._image is None else self._image
            image = np.where(fresh[:, None, None], image, before)
            self._image = image.copy()
        return image.copy() if self.copy and len(self.maps) == 1 and image is whole else image

    def __repr__(self) -> str:
        names = ", ".join(map_name(place) for place in self.maps)
        return f"<VectorEnv of {self.num_envs}: {type(self.task).__name__} in {names}>"


def map_name(place: Map) -> str:
    """The last part of its path."""
    return os.path.basename(place.info().name)


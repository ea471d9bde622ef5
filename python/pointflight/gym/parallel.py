"""Several vehicles of one place, each an agent of its own: PettingZoo's parallel interface, `ParallelEnv`."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike

from .courses import TASKS
from .images import Observation
from .vector import VectorEnv

try:
    from pettingzoo import ParallelEnv as _Base
except ImportError:
    _Base = object

Infos = Dict[str, Dict[str, Any]]


class ParallelEnv(_Base):  # type: ignore[misc]
    """One team of a `VectorEnv`. pettingzoo is not needed; where it is installed, its base class is the class' own."""

    def __init__(self, map: Any, *, task: Any = "formation", team: Optional[int] = None, **arguments: Any) -> None:
        """As `VectorEnv`, but for `num_envs` and `autoreset`. team: how many vehicles; without it the task's."""
        if "num_envs" in arguments or "autoreset" in arguments:
            raise TypeError("ParallelEnv: num_envs and autoreset are VectorEnv's")
        size = team
        if size is None:
            size = (TASKS[task] if isinstance(task, str) and task in TASKS else task).team
        self._team = VectorEnv(map, size, task=task, team=size, autoreset="disabled", **arguments)
        self.metadata = {"name": f"pointflight_{type(self._team.task).__name__.lower()}", "render_modes": []}
        self.render_mode = None
        self.possible_agents = [f"drone{i}" for i in range(size)]
        """Names, as a scenario's vehicles have them."""
        self.agents: List[str] = []
        """Those that fly: all, or none once the episode has ended."""

    @property
    def vector(self) -> VectorEnv:
        """The team as environments that end together."""
        return self._team

    def observation_space(self, agent: str) -> Any:
        """The same for all."""
        return self._team.single_observation_space

    def action_space(self, agent: str) -> Any:
        """The same for all."""
        return self._team.single_action_space

    def reset(
        self, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None
    ) -> Tuple[Dict[str, Observation], Infos]:
        """Begins anew; without a seed with the next episode."""
        seen, _ = self._team.reset(seed=seed)
        self.agents = list(self.possible_agents)
        return self._each(seen), {agent: {} for agent in self.agents}

    def step(
        self, actions: Mapping[str, ArrayLike]
    ) -> Tuple[Dict[str, Observation], Dict[str, float], Dict[str, bool], Dict[str, bool], Infos]:
        """An action for each agent; gives observations, rewards, terminations, truncations and infos by agent."""
        if not self.agents:
            raise RuntimeError("step: reset comes first")
        if set(actions) != set(self.agents):
            raise ValueError(f"actions: one for each of {', '.join(self.agents)} is wanted")
        asked = np.stack([np.asarray(actions[agent]) for agent in self.agents])
        seen, reward, terminated, truncated, infos = self._team.step(asked)
        names = [name for name in infos if not name.startswith("_")]
        each: Infos = {agent: {name: infos[name][i] for name in names} for i, agent in enumerate(self.agents)}
        rewards = {agent: float(reward[i]) for i, agent in enumerate(self.agents)}
        ends = {agent: bool(terminated[i]) for i, agent in enumerate(self.agents)}
        cuts = {agent: bool(truncated[i]) for i, agent in enumerate(self.agents)}
        observations = self._each(seen)
        if terminated.any() or truncated.any():
            self.agents = []
        return observations, rewards, ends, cuts, each

    def render(self) -> None:
        """There is none; fly policies in a Simulation to see them."""

    def close(self) -> None:
        """Nothing is open."""

    def _each(self, seen: Observation) -> Dict[str, Observation]:
        return {
            agent: {name: values[i].copy() for name, values in seen.items()}
            for i, agent in enumerate(self.possible_agents)
        }

    def __repr__(self) -> str:
        return repr(self._team)

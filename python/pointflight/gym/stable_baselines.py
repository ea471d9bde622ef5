"""stable-baselines3's own vector interface: `StableBaselinesEnv`. It is not needed to import this."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple, Type

import numpy as np
from numpy.typing import NDArray

from .images import Observation
from .vector import AutoresetMode, VectorEnv

try:
    from stable_baselines3.common.vec_env import VecEnv as _Base
except ImportError:
    _Base = object


class StableBaselinesEnv(_Base):  # type: ignore[misc]
    """A `VectorEnv` with autoreset="same_step" as stable-baselines3 steps it; for MultiInputPolicy."""

    def __init__(self, env: VectorEnv) -> None:
        if env.metadata["autoreset_mode"] is not AutoresetMode.SAME_STEP:
            raise ValueError('env: autoreset="same_step" is wanted')
        self.env = env
        self._actions: Optional[NDArray[Any]] = None
        self._seed: Optional[int] = None
        self.num_envs = env.num_envs
        self.observation_space, self.action_space = env.single_observation_space, env.single_action_space
        if _Base is not object:
            super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> Observation:
        """Begins anew, with the seed that was set before, if one was."""
        seen, _ = self.env.reset(seed=self._seed)
        self._seed = None
        return seen

    def step_async(self, actions: NDArray[Any]) -> None:
        """Takes the actions of `step_wait`."""
        self._actions = actions

    def step_wait(self) -> Tuple[Observation, NDArray[np.float32], NDArray[np.bool_], List[Dict[str, Any]]]:
        """Observation, reward, whether an episode has ended, and a dict for each environment: with
        "terminal_observation" and "TimeLimit.truncated" where one has."""
        if self._actions is None:
            raise RuntimeError("step_wait: step_async comes first")
        seen, reward, terminated, truncated, infos = self.env.step(self._actions)
        self._actions = None
        names = [name for name in infos if not name.startswith("_") and not name.startswith("final_")]
        each: List[Dict[str, Any]] = [{name: infos[name][i] for name in names} for i in range(self.num_envs)]
        dones = terminated | truncated
        for i in np.flatnonzero(dones):
            each[i]["terminal_observation"] = infos["final_obs"][i]
            each[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        return seen, reward.astype(np.float32), dones, each

    def step(
        self, actions: NDArray[Any]
    ) -> Tuple[Observation, NDArray[np.float32], NDArray[np.bool_], List[Dict[str, Any]]]:
        """Both."""
        self.step_async(actions)
        return self.step_wait()

    def seed(self, seed: Optional[int] = None) -> List[Optional[int]]:
        """Of the next reset: environment i gets seed + i."""
        self._seed = seed
        return [None if seed is None else seed + i for i in range(self.num_envs)]

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, name: str, indices: Any = None) -> List[Any]:
        """The vector environment's, for each."""
        return [getattr(self.env, name) for _ in self._numbers(indices)]

    def set_attr(self, name: str, value: Any, indices: Any = None) -> None:
        """Of the vector environment."""
        setattr(self.env, name, value)

    def env_method(self, name: str, *arguments: Any, indices: Any = None, **keywords: Any) -> List[Any]:
        """The vector environment's; called once, its result for each."""
        result = getattr(self.env, name)(*arguments, **keywords)
        return [result for _ in self._numbers(indices)]

    def env_is_wrapped(self, wrapper_class: Type[Any], indices: Any = None) -> List[bool]:
        """None is."""
        return [False for _ in self._numbers(indices)]

    def _numbers(self, indices: Any) -> Sequence[int]:
        if indices is None:
            return range(self.num_envs)
        return [indices] if isinstance(indices, int) else list(indices)

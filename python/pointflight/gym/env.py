"""One environment: `Env`."""

from __future__ import annotations

from typing import Any, Dict, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .vector import VectorEnv

try:
    from gymnasium import Env as _Base
except ImportError:
    _Base = object


class Env(_Base):  # type: ignore[misc]
    """One environment of `VectorEnv`, in gymnasium's interface: arguments, observations and actions are the same,
    without the first dimension."""

    def __init__(self, map: Any, **arguments: Any) -> None:
        """As `VectorEnv`, but for `num_envs` and `autoreset`."""
        if "num_envs" in arguments or "autoreset" in arguments:
            raise TypeError("Env: num_envs and autoreset are VectorEnv's")
        self._one = VectorEnv(map, 1, autoreset="disabled", **arguments)
        self.render_mode = self._one.render_mode
        self.metadata = {"render_modes": [], "render_fps": self._one.metadata["render_fps"]}
        self.observation_space = self._one.single_observation_space
        self.action_space = self._one.single_action_space

    @property
    def task(self) -> Any:
        """What is to be learned; its arrays have one row."""
        return self._one.task

    @property
    def vector(self) -> VectorEnv:
        """The environment as one of one."""
        return self._one

    def reset(
        self, *, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None
    ) -> Tuple[Dict[str, NDArray[np.float32]], Dict[str, Any]]:
        """Begins anew; without a seed with the next episode."""
        if _Base is not object:
            super().reset(seed=seed)
        seen, _ = self._one.reset(seed=seed)
        return {name: values[0] for name, values in seen.items()}, {}

    def step(
        self, action: ArrayLike
    ) -> Tuple[Dict[str, NDArray[np.float32]], float, bool, bool, Dict[str, Any]]:
        """Flies on by one action period: observation, reward, terminated, truncated, info."""
        seen, reward, terminated, truncated, infos = self._one.step(np.asarray(action)[None])
        info = {name: values[0] for name, values in infos.items() if not name.startswith("_")}
        first = {name: values[0] for name, values in seen.items()}
        return first, float(reward[0]), bool(terminated[0]), bool(truncated[0]), info

    def close(self) -> None:
        """Nothing is open."""

    def __repr__(self) -> str:
        return repr(self._one)

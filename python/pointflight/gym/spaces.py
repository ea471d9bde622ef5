"""Spaces of gymnasium, or, where it is not installed, what of them is needed."""

from __future__ import annotations

from typing import Any, Dict as Dictionary, Iterator, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

try:
    from gymnasium.spaces import Box, Dict
except ImportError:

    class Box:  # type: ignore[no-redef]
        """Arrays between two bounds."""

        def __init__(self, low: Any, high: Any, shape: Optional[Tuple[int, ...]] = None, dtype: DTypeLike = np.float32):
            self.dtype = np.dtype(dtype)
            self.shape: Tuple[int, ...] = np.shape(low) if shape is None else tuple(shape)
            self.low: NDArray[Any] = np.broadcast_to(np.asarray(low, self.dtype), self.shape)
            self.high: NDArray[Any] = np.broadcast_to(np.asarray(high, self.dtype), self.shape)
            self._random = np.random.default_rng()

        def seed(self, seed: Optional[int] = None) -> None:
            """Of `sample`."""
            self._random = np.random.default_rng(seed)

        def sample(self) -> NDArray[Any]:
            """Any array of the space; exponential beyond where a side is open."""
            low = np.where(np.isfinite(self.low), self.low, -1.0 - self._random.exponential(size=self.shape))
            high = np.where(np.isfinite(self.high), self.high, 1.0 + self._random.exponential(size=self.shape))
            return self._random.uniform(low, high).astype(self.dtype)

        def contains(self, x: Any) -> bool:
            """True if it is an array of this shape and type within the bounds."""
            return bool(
                isinstance(x, np.ndarray)
                and x.shape == self.shape
                and np.can_cast(x.dtype, self.dtype)
                and np.all(x >= self.low)
                and np.all(x <= self.high)
            )

        __contains__ = contains

        def __repr__(self) -> str:
            return f"Box({self.low.min()}, {self.high.max()}, {self.shape}, {self.dtype})"

    class Dict:  # type: ignore[no-redef]
        """Spaces by name."""

        def __init__(self, spaces: Mapping[str, Any]):
            self.spaces: Dictionary[str, Any] = dict(spaces)

        def seed(self, seed: Optional[int] = None) -> None:
            """Of `sample`."""
            for i, space in enumerate(self.spaces.values()):
                space.seed(None if seed is None else seed + i)

        def sample(self) -> Dictionary[str, Any]:
            """One of each."""
            return {name: space.sample() for name, space in self.spaces.items()}

        def contains(self, x: Any) -> bool:
            """True if it has all of them, and each is one of its space."""
            return (
                isinstance(x, dict)
                and x.keys() == self.spaces.keys()
                and all(space.contains(x[name]) for name, space in self.spaces.items())
            )

        __contains__ = contains

        def __getitem__(self, name: str) -> Any:
            return self.spaces[name]

        def __iter__(self) -> Iterator[str]:
            return iter(self.spaces)

        def keys(self) -> Any:
            """The names."""
            return self.spaces.keys()

        def __repr__(self) -> str:
            return f"Dict({self.spaces})"


def batched(space: Any, count: int) -> Any:
    """Of `count` environments: with one more dimension in front."""
    if isinstance(space, Dict):
        return Dict({name: batched(one, count) for name, one in space.spaces.items()})
    shape = (count, *space.shape)
    return Box(np.broadcast_to(space.low, shape), np.broadcast_to(space.high, shape), shape, space.dtype)


__all__ = ["Box", "Dict", "batched"]

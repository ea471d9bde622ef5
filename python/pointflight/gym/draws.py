"""Random numbers addressed by seed, episode and number: the same on every machine."""

from __future__ import annotations

from typing import Union

import numpy as np
from numpy.typing import NDArray

# first numbers of those who draw, besides tasks, which begin at 0
CONDITIONS = np.uint64(1 << 56)
NOISE = np.uint64(2 << 56)
DROPS = np.uint64(3 << 56)


def _mixed(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """splitmix64 (Steele, Lea, Flood, Fast splittable pseudorandom number generators, OOPSLA 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def bits(
    seeds: NDArray[np.uint64],
    episodes: NDArray[np.uint64],
    count: int,
    first: Union[np.uint64, NDArray[np.uint64]] = np.uint64(0),
) -> NDArray[np.uint64]:
    """(m, count): numbers `first` and on, (m,) or one for all, of these seeds (m,) in these episodes (m,)."""
    golden = np.uint64(0x9E3779B97F4A7C15)
    with np.errstate(over="ignore"):
        keys = _mixed(_mixed(seeds * golden + golden) + episodes * golden)
        numbers = np.arange(1, count + 1, dtype=np.uint64)[None, :] + np.atleast_1d(first)[:, None]
        return _mixed(keys[:, None] + numbers * golden)


def draws(
    seeds: NDArray[np.uint64],
    episodes: NDArray[np.uint64],
    count: int,
    first: Union[np.uint64, NDArray[np.uint64]] = np.uint64(0),
) -> NDArray[np.float64]:
    """The same, uniform in [0, 1)."""
    return (bits(seeds, episodes, count, first) >> np.uint64(11)).astype(np.float64) * 2.0**-53

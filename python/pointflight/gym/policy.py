"""Policies for the task `Goal` as numpy alone flies them: what features are, and `Policy`."""

from __future__ import annotations

import json
from typing import Any, Dict, List, Mapping, Tuple

import numpy as np
from numpy.typing import NDArray

from ..settings import Path
from .vector import Observation

Floats = NDArray[np.float32]


def features(observation: Observation, range_max: float) -> Floats:
    """(n, k): 1 / (1 + range in m) of each beam, which is finest near by, and the state."""
    state = observation["state"]
    if "range" not in observation:
        return state
    near = 1.0 / (1.0 + range_max * observation["range"].reshape(len(state), -1))
    return np.concatenate([near, state], 1, dtype=np.float32)


def straight(observation: Observation) -> Floats:
    """(n, 4): the straight way to the goal at full speed, without turning."""
    s = observation["state"]
    way = np.stack([s[:, 0] * s[:, 2] * 30.0, s[:, 1] * s[:, 2] * 30.0, s[:, 3] * 3.0, 0.0 * s[:, 0]], 1)
    unit: Floats = way / np.maximum(np.sqrt((way * way).sum(1, keepdims=True)), 1e-6)
    return unit


class Policy:
    """A network of tanh layers that adds to a share of the straight way."""

    def __init__(self, layers: List[Tuple[Floats, Floats]], about: Mapping[str, Any]) -> None:
        """layers: weights (out, in) and biases (out,). about: "base", the share of the straight way, and what else is
        to be kept with it: the LiDAR, how it was trained."""
        self.layers, self.about = layers, dict(about)

    @staticmethod
    def load(path: Path) -> Policy:
        """Of a file that `save` wrote."""
        with np.load(path, allow_pickle=False) as file:
            about = json.loads(str(file["about"]))
            layers = [(file[f"weight{i}"], file[f"bias{i}"]) for i in range(int(about["layers"]))]
        return Policy(layers, about)

    def save(self, path: Path) -> None:
        """As .npz."""
        arrays: Dict[str, Any] = {"about": np.array(json.dumps({**self.about, "layers": len(self.layers)}))}
        for i, (weight, bias) in enumerate(self.layers):
            arrays[f"weight{i}"], arrays[f"bias{i}"] = weight, bias
        np.savez(path, **arrays)

    def __call__(self, observation: Observation) -> Floats:
        """Actions (n, 4), -1 to 1."""
        x = features(observation, float(self.about["range_max"]))
        for i, (weight, bias) in enumerate(self.layers):
            x = x @ weight.T + bias
            if i + 1 < len(self.layers):
                x = np.tanh(x)
        added = np.zeros((len(x), 4), np.float32)
        added[:, : x.shape[1]] = x
        return np.clip(float(self.about["base"]) * straight(observation) + added, -1.0, 1.0)

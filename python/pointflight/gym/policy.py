"""Policies as numpy alone flies them: what features are, and `Policy`."""

from __future__ import annotations

import json
from typing import Any, Dict, List, Mapping, Tuple

import numpy as np
from numpy.typing import NDArray

from ..settings import Path
from .facing import faces_all, facing_goal, turned
from .images import Lidar, Observation
from .pilots import straight

Floats = NDArray[np.float32]


def features(observation: Observation, range_max: float) -> Floats:
    """(n, k): 1 / (1 + range in m) of each beam, which is finest near by, and the state."""
    state = observation["state"]
    if "range" not in observation:
        return state
    near = 1.0 / (1.0 + range_max * observation["range"].reshape(len(state), -1))
    return np.concatenate([near, state], 1, dtype=np.float32)


class Policy:
    """A network of tanh layers; its outputs, which may be fewer than actions have numbers, add to a share of the
    straight way to the goal."""

    def __init__(self, layers: List[Tuple[Floats, Floats]], about: Mapping[str, Any]) -> None:
        """layers: weights (out, in) and biases (out,). about: `VectorEnv.about()` and "base", the share of the straight
        way that its actions add to, 0 unless the task is `Goal` or `Race`; "faces_goal": it has learned by what
        `facing_goal` gives."""
        self.layers, self.about = layers, dict(about)
        seen = self.about.get("lidar")
        as_tuples = {name: tuple(v) if isinstance(v, list) else v for name, v in (seen or {}).items()}
        self.lidar = None if seen is None else Lidar(**as_tuples)
        """What it sees by."""
        self._faces_goal = bool(self.about.get("faces_goal", False))
        if self._faces_goal:
            if not faces_all(self.lidar, str(self.about["task"]), str(self.about["action"])):
                raise ValueError("faces_goal: the full circle, goal or race, and velocities are wanted")

    @staticmethod
    def load(path: Path) -> Policy:
        """Of a file that `save` wrote."""
        with np.load(path, allow_pickle=False) as file:
            about = json.loads(file["about"].tobytes())
            layers = [(file[f"weight{i}"], file[f"bias{i}"]) for i in range(int(about["layers"]))]
        return Policy(layers, about)

    def save(self, path: Path) -> None:
        """As .npz, which `pointflight fly --policy` flies, too."""
        about = json.dumps({**self.about, "layers": len(self.layers)}).encode()
        arrays: Dict[str, Any] = {"about": np.frombuffer(about, np.uint8)}
        for i, (weight, bias) in enumerate(self.layers):
            arrays[f"weight{i}"], arrays[f"bias{i}"] = weight, bias
        np.savez(path, **arrays)

    def __call__(self, observation: Observation) -> Floats:
        """Actions (n, a), -1 to 1."""
        turn = None
        if self._faces_goal:
            observation, turn = facing_goal(observation)
        x = features(observation, 1.0 if self.lidar is None else self.lidar.range_max)
        for i, (weight, bias) in enumerate(self.layers):
            x = x @ weight.T + bias
            if i + 1 < len(self.layers):
                x = np.tanh(x)
        actions = np.zeros((len(x), max(4, x.shape[1])), np.float32)
        actions[:, : x.shape[1]] = x
        if self.about["base"] != 0.0:
            actions += np.float32(self.about["base"]) * straight(observation)
        if turn is not None:
            actions = turned(actions, turn)
        return np.clip(actions, -1.0, 1.0)

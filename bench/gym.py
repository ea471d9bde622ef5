"""Steps a second of pointflight.gym on one core, beside the rays' own time in the same run.

    gym.py MAP...   (`./dev bench gym`)
"""

import os
import sys
import time

import numpy as np

import pointflight as pf
from pointflight.gym import Lidar, VectorEnv

COUNT = 256
LEVEL = (-0.001, 0.001)
CASES = (
    ("no LiDAR, 5 ms", None, {}),
    ("no LiDAR, 1 ms", None, {"physics_step": 0.001}),
    ("64 x 16, 10 m", Lidar(16, 64), {}),
    ("64 x 16, 10 m, rolling", Lidar(16, 64, rolling=True), {}),
    ("64 x 16, 20 m", Lidar(16, 64, range_max=20.0), {}),
    ("32 x 8, 10 m", Lidar(8, 32), {}),
    ("180 beams, 10 m", Lidar(1, 180, elevation=LEVEL), {}),
    ("no LiDAR, 60 balls", None, {"scenario": "balls"}),
    ("64 x 16, 10 m, 60 balls", Lidar(16, 64), {"scenario": "balls"}),
    ("no LiDAR, gusts", None, {"scenario": {"air": {"wind": {"turbulence": "light"}}}}),
    ("no LiDAR, four together", None, {"task": "formation"}),
)


def balls(place: pf.Map) -> dict:
    """60 that fly to and fro in the lowest 5 m."""
    low, high = place.bounds
    box = {"bounds_min": [*low[:2], low[2] + 0.5], "bounds_max": [*high[:2], low[2] + 5.0]}
    motion = {"speed": 0.5, "speed_max": 2.0, "directions": "horizontal", "at_border": "bounce"}
    return {"obstacles": [{"count": 60, **motion, **box}]}


def cpu(action) -> float:
    """us of this process for each environment."""
    began = time.process_time()
    action()
    return (time.process_time() - began) / COUNT * 1e6


def main() -> None:
    pf.set_threads(1)
    print("us of CPU a step and environment, control at 10 Hz, 5 ms unless said; the least of 7 rounds")
    print("| map | case | step | rays alone | step / (1.05 rays + 6) | steps/s |")
    print("| --- | --- | --- | --- | --- | --- |")
    for path in sys.argv[1:]:
        place = pf.Map.open(path)
        for name, lidar, arguments in CASES:
            if arguments.get("scenario") == "balls":
                arguments = {**arguments, "scenario": balls(place)}
            env = VectorEnv(place, COUNT, lidar=lidar, copy=False, **arguments)
            env.reset(seed=1)
            random = np.random.default_rng(0)
            everyone = np.arange(COUNT, dtype=np.uint32)
            steps, rays = [], []
            repeats = 40 if lidar is None else 4
            for _ in range(7):
                actions = random.normal(0.0, 0.5, (repeats, COUNT, 4))
                steps.append(cpu(lambda: [env.step(a) for a in actions]) / repeats)
                if lidar is not None:
                    rays.append(cpu(lambda: [env._measure(everyone) for _ in range(repeats)]) / repeats)
            step, ray = min(steps), min(rays, default=0.0)
            ratio = step / (1.05 * ray + 6.0)
            row = (os.path.basename(path), name, f"{step:.1f}", f"{ray:.1f}", f"{ratio:.2f}", f"{1e6 / step:,.0f}")
            print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()

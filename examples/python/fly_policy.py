"""Flies a policy of train.py in the full simulation: 1 ms steps, the cascade, rolling scans of a VLP-16 with noise.

    python3 fly_policy.py policy.npz MAP...     one flight in each, from and to where an environment's would go
"""

import math
import sys

import numpy as np

import pointflight as pf
from pointflight.gym import Goal, Observer, Policy, VectorEnv, wilson

if len(sys.argv) < 3:
    sys.exit(__doc__)
policy, maps, task = Policy.load(sys.argv[1]), sys.argv[2:], Goal()
starts = VectorEnv(maps, len(maps), task=task, lidar=None, autoreset="disabled")
starts.reset(seed=30_000_000)  # no seed of train.py's
arrived = collided = 0
for i, path in enumerate(maps):
    heading = starts.states.heading[i]
    sim = pf.Simulation(
        {
            "map": path,
            "seed": i + 1,
            "duration": task.time_limit,
            "unfinished": "time_up",
            "vehicle": {
                "name": "pilot",
                "start": starts.states.position[i],
                "start_yaw_deg": math.degrees(math.atan2(heading[1], heading[0])),
                "on_collision": "stop",
            },
            "lidars": [{"model": "vlp16", "position": [0, 0, 0]}],
        },
        starts.maps[i],
    )
    observer = Observer(task.goal[i], policy.lidar, task)
    for sample in sim.samples(pf.ScanSample):
        body = sim.status("pilot")
        if np.linalg.norm(body.position - task.goal[i]) < task.radius:
            arrived += 1
            break
        ages = sim.time - sample.start - sample.scan["time"]  # points are deskewed to now
        seen = observer.of_points(body, sample.scan.xyz, ages)
        action = policy(seen)[0]
        observer.last_action, observer.elapsed = action, sim.time
        sim.command("pilot", pf.Velocity(3.0 * action[:3], yaw_rate=float(action[3]), in_body=True))
    collided += sim.end == "collision"
    print(f"{i + 1}: {arrived} arrived, {collided} collided", end="\r", file=sys.stderr, flush=True)
low, high = wilson(arrived, len(maps))
print(f"{arrived} of {len(maps)} arrive ({low:.0%} to {high:.0%}), {collided} collide")

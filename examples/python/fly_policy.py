"""Flies a policy of train.py in the full simulation: 1 ms steps, the cascade, scans of a VLP-16 with noise.

    python3 fly_policy.py forest.pfmap policy.npz [FLIGHTS]
"""

import math
import sys

import numpy as np

import pointflight as pf
from pointflight.gym import Goal, Lidar, Observer, Policy, VectorEnv, wilson

if len(sys.argv) < 3:
    sys.exit(__doc__)
place, policy = pf.Map.open(sys.argv[1]), Policy.load(sys.argv[2])
flights = int(sys.argv[3]) if len(sys.argv) > 3 else 20
lidar = Lidar(policy.about["rows"], policy.about["columns"], elevation=(-math.radians(15), math.radians(15)))
task = Goal()
starts = VectorEnv(place, flights, task=task, lidar=None, autoreset="disabled")
starts.reset(seed=list(range(10_000_000, 10_000_000 + flights)))  # where the environments' flights begin

arrived = collided = 0
for i in range(flights):
    heading = starts.states.heading[i]
    sim = pf.Simulation(
        {
            "map": sys.argv[1],
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
        place,
    )
    observer = Observer(task.goal[i], lidar, task)
    for sample in sim.samples(pf.ScanSample):
        body = sim.status("pilot")
        if np.linalg.norm(body.position - task.goal[i]) < task.radius:
            arrived += 1
            break
        seen = observer.of_points(body, sample.scan.xyz)
        action = policy(seen)[0]
        observer.last_action, observer.elapsed = action, sim.time
        sim.command("pilot", pf.Velocity(3.0 * action[:3], yaw_rate=float(action[3]), in_body=True))
    collided += sim.end == "collision"
low, high = wilson(arrived, flights)
print(f"{arrived} of {flights} arrive ({low:.0%} to {high:.0%}), {collided} collide")

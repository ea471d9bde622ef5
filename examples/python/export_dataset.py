"""Flies a sensor through a place and writes a data set as KITTI's odometry has it: scans, times, poses.

    python3 export_dataset.py forest.pfmap FOLDER [mid360]
"""

import os
import sys

import numpy as np

import pointflight as pf

if len(sys.argv) < 3:
    sys.exit(__doc__)
place, folder = pf.Map.open(sys.argv[1]), sys.argv[2]
tour = place.tour(length=15.0)
sim = pf.Simulation(
    {
        "map": sys.argv[1],
        "seed": 7,
        "vehicle": {"name": "carrier", "start": tour[0]},
        "lidars": [{"model": sys.argv[3] if len(sys.argv) > 3 else "mid360"}],
        "mission": {"speed": 1.5, "waypoints": tour[1:3]},
    },
    place,
)
run = os.path.join(folder, "run")
with sim.record(run, replace=True):
    while sim.is_running:
        sim.advance_to(sim.time + 1.0, pf.CollisionEvent)
        print(f"\r{sim.time:.0f} s", end="", file=sys.stderr, flush=True)
print(file=sys.stderr)

data = pf.DataSet(run)  # what KISS-ICP's loaders have, too
clouds = os.path.join(folder, "velodyne")
os.makedirs(clouds, exist_ok=True)
with open(os.path.join(folder, "poses.txt"), "w") as poses:
    for i in range(len(data)):
        points, times = data[i]  # (n, 3) in the sensor frame; (n,) s after the scan's start
        rows = np.concatenate([points, times[:, None]], 1).astype(np.float32)
        rows.tofile(os.path.join(clouds, f"{i:06d}.bin"))  # the time stands where KITTI has the intensity
        poses.write(" ".join(f"{value:.9g}" for value in data.gt_poses[i][:3].ravel()) + "\n")
print(f"{len(data)} scans, {sum(len(data[i][0]) for i in range(len(data)))} points, in {folder}")

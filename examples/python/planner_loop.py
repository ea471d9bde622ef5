"""A planner in the loop: it keeps a grid of what it has seen and flies where that is free. Simple: it can get stuck.

    python3 planner_loop.py forest.pfmap [FOLDER OF THE RUN]
"""

import sys

import numpy as np

import pointflight as pf

if len(sys.argv) < 2:
    sys.exit(__doc__)
place = pf.Map.open(sys.argv[1])
tour = place.tour(length=25.0)
goal, cell = tour[-1], 0.25
sim = pf.Simulation(
    {
        "map": sys.argv[1],
        "duration": 60,
        "unfinished": "time_up",
        "vehicle": {"name": "scout", "start": tour[0], "on_collision": "stop"},
        "lidars": [{"model": "mid360", "position": [0, 0, 0.1]}],
    },
    place,
)
taken = set()  # cells of the world in which points were


def free_way(near: np.ndarray, way: np.ndarray, length: float) -> float:
    """m along a unit vector with 0.5 m on all sides; near: what is there, from where it begins."""
    along = near @ way
    beside = np.linalg.norm(near - along[:, None] * way, axis=1)
    return min(length, along[(along > 0) & (beside < 0.5)].min(initial=length + 0.5) - 0.5)


with sim.record(sys.argv[2] if len(sys.argv) > 2 else "planner_run", replace=True):
    for sample in sim.samples(pf.ScanSample):
        body = sim.status("scout")
        to_goal = goal - body.position
        if np.linalg.norm(to_goal) < 0.7:
            break
        points = sample.scan.xyz[sample.scan["range"] < 8.0] + [0, 0, 0.1]
        world = points @ body.pose[:3, :3].T + body.pose[:3, 3]
        taken.update(map(tuple, np.floor(world / cell).astype(int).tolist()))
        offs = np.radians([0, 10, -10, 20, -20, 30, -30, 45, -45, 60, -60, 80, -80, 100, -100, 130, -130, 180])
        yaw = np.arctan2(to_goal[1], to_goal[0]) + offs  # nearest to the goal's direction first
        ways = np.stack([np.cos(yaw), np.sin(yaw), np.full(len(yaw), np.clip(0.3 * to_goal[2], -0.2, 0.2))], 1)
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        near = (np.array(list(taken)) + 0.5) * cell - body.position
        near = near[(np.abs(near[:, 2]) < 0.8) & (np.abs(near[:, :2]).max(1) < 5.0)]
        free = np.array([free_way(near, way, 4.0) for way in ways])
        wide = free >= min(2.0, np.linalg.norm(to_goal))
        best = int(np.argmax(wide) if wide.any() else np.argmax(free))
        speed = np.clip(0.6 * free[best], 0.2, 1.5)
        sim.command("scout", pf.Velocity(speed * ways[best], yaw=float(yaw[best])))
print(f"{np.linalg.norm(goal - sim.status('scout').position):.1f} m from its goal after {sim.time:.1f} s, {sim.end};",
      f"{sim.summary['vehicles'][0]['collisions']} collisions")  # fmt: skip

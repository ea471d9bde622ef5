"""A map of one's own cloud, and where one can fly in it: python3 own_map.py cloud.pcd [place.pfmap]"""

import os
import sys

import numpy as np

import pointflight as pf

if len(sys.argv) < 2:
    sys.exit(__doc__)
cloud = sys.argv[1]
output = sys.argv[2] if len(sys.argv) > 2 else os.path.splitext(cloud)[0] + ".pfmap"


def show(what: str, share: float) -> None:
    print(f"\r{what:<40} {share:5.0%}", end="", file=sys.stderr, flush=True)


place = pf.Map.import_clouds(cloud, output, progress=show, force=True)
print(file=sys.stderr)
info = place.info()
size = info.bounds[1] - info.bounds[0]
print(f"{output}: {info.surfels} surfels of {info.resolution:.3f} m, {size[0]:.0f} x {size[1]:.0f} x {size[2]:.0f} m")

# how much of a slice above ground is free for a vehicle of 0.3 m
x, y = (np.arange(low, high, 0.5) for low, high in info.bounds.T[:2])
floor = pf.raycast(place, [(a, b, info.bounds[1, 2] + 1.0) for a in x for b in y], (0, 0, -1), range_max=1000.0).point
floor = floor[np.isfinite(floor[:, 2])]
distance, _ = place.nearest(floor + [0, 0, 1.5], reach=2.0)
print(f"{np.mean(distance > 0.3):.0%} of what lies 1.5 m above the uppermost surface is free by 0.3 m")
tour = place.tour(length=30.0)
print(f"a way of {np.linalg.norm(np.diff(tour, axis=0), axis=1).sum():.0f} m through it:", tour.round(1).tolist())

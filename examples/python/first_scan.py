"""A scan of a LiDAR in a map, and a plot of it: python3 first_scan.py forest.pfmap [mid360 [scan.png]]

The plot needs matplotlib (python3-matplotlib of Debian).
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import pointflight as pf

if len(sys.argv) < 2:
    sys.exit(__doc__)
place = pf.Map.open(sys.argv[1])
name = sys.argv[2] if len(sys.argv) > 2 else "mid360"
output = sys.argv[3] if len(sys.argv) > 3 else "scan.png"
tour = place.tour()  # a free way through the place; its first leg says where to look
ahead = tour[1] - tour[0]
at = pf.pose(*tour[0], yaw=np.arctan2(ahead[1], ahead[0]))
scan = pf.Lidar(name).scan(place, at, seed=1)
print(f"{len(scan)} points of {scan.beams} beams, {scan['range'].mean():.1f} m on average")

points = scan.xyz @ at[:3, :3].T + at[:3, 3]
figure, (above, image) = plt.subplots(1, 2, figsize=(13, 5.5), width_ratios=(1, 1.3))
x, y, z = points.T
above.scatter(x, y, s=1.5, c=z, cmap="turbo", linewidths=0, vmax=np.percentile(z, 99))
above.plot(*tour[:2, :2].T, "r.-", linewidth=1, label="ahead")
above.set(xlabel="x, m", ylabel="y, m", title=f"one scan of {name} from above, by height", aspect="equal")
above.set(xlim=tour[0, 0] + np.array([-20, 20]), ylim=tour[0, 1] + np.array([-20, 20]))
above.legend(loc="upper right")
ranges = pf.ranges(place, at, pf.grid(120, 480, (-np.pi / 4, np.pi / 4)), range_max=20.0)[0]
shown = image.imshow(ranges, extent=(180, -180, -45, 45), aspect="auto", cmap="magma_r")
image.set(xlabel="azimuth, degrees (left is to the left)", ylabel="elevation, degrees", title="exact ranges all around")
figure.colorbar(shown, label="m")
figure.tight_layout()
figure.savefig(output, dpi=110)
print(output)

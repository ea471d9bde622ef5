"""Which LiDAR sees most of a place from the same flight: python3 sensor_study.py forest.pfmap [LIDAR ...]

With pandas (python3-pandas of Debian) the table is its own, else text.
"""

import sys

import numpy as np

import pointflight as pf

if len(sys.argv) < 2:
    sys.exit(__doc__)
place = pf.Map.open(sys.argv[1])
names = sys.argv[2:] or ["mid360", "avia", "vlp16", "os0_32"]
tour = place.tour(length=20.0)
legs = np.linalg.norm(np.diff(tour, axis=0), axis=1)
times = np.concatenate([[0.0], np.cumsum(legs)])  # at 1 m/s
rows = []
for name in names:
    lidar, cells, points = pf.Lidar(name), set(), 0
    for scan_number, when in enumerate(np.arange(0.0, times[-1], 1.0)):
        leg = int(np.searchsorted(times, when, side="right")) - 1
        way = tour[leg + 1] - tour[leg]
        at = pf.pose(*tour[leg] + way * (when - times[leg]) / legs[leg], yaw=np.arctan2(way[1], way[0]))
        scan = lidar.scan(place, at, seed=1, index=scan_number)
        world = scan.xyz @ at[:3, :3].T + at[:3, 3]
        cells.update(map(tuple, np.floor(world / 0.5).astype(int).tolist()))
        points += len(scan)
        beams = scan.beams
    scans = scan_number + 1
    rows.append(
        {"lidar": name, "beams a scan": beams, "come back": points / scans / beams, "m3 seen": len(cells) * 0.125}
    )
try:
    import pandas

    print(pandas.DataFrame(rows).round(2).to_string(index=False))
except ImportError:
    for row in rows:
        print(", ".join(f"{key} {value if isinstance(value, str) else round(value, 2)}" for key, value in row.items()))

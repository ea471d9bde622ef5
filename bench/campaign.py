#!/usr/bin/env python3
"""What a campaign itself costs: flights of the demo planner by `campaign`, beside the same commands by xargs.

campaign.py PROGRAM PLANNER MAP.pfmap [FLIGHTS]"""
import csv
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import time

program, planner, pfmap = (os.path.abspath(path) for path in sys.argv[1:4])
flights = int(sys.argv[4]) if len(sys.argv) > 4 else 1000
jobs = os.cpu_count()
work = pathlib.Path(tempfile.mkdtemp(prefix="pointflight_campaign_"))
SCENARIO = """map: {map}
duration: 1
vehicle: {{start: [28, 14, 3]}}
lidars: [{{model: mid360}}]
mission: {{waypoints: [[28, 40, 3]]}}
obstacles:
  - {{motion: random, count: 40, radius: 0.25, speed: 0.6, directions: horizontal, at_border: bounce}}
output: {{scans: false, imu: false}}
"""


def children_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


try:
    (work / "s.yaml").write_text(SCENARIO.format(map=pfmap))
    (work / "study.yaml").write_text(
        f"scenario: s.yaml\nseeds: {flights}\n"
        f"command: [{planner}, '{{scenario}}', -o, '{{output}}', --threads, '1']\n")
    begin, cpu = time.time(), children_seconds()
    subprocess.run([program, "campaign", "study.yaml", "-o", "c"], cwd=work, check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
    wall, cpu = time.time() - begin, children_seconds() - cpu
    with open(work / "c" / "runs_timing.csv") as file:
        flown = [float(row["wall_seconds"]) for row in csv.DictReader(file)]
    assert len(flown) == flights
    largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    # the same flights from the scenarios that the campaign has made, by xargs
    (work / "x").mkdir()
    lines = "".join(f"{work}/c/runs/{i:06}/scenario.yaml {work}/x/{i}\n" for i in range(flights))
    begin, plain_cpu = time.time(), children_seconds()
    subprocess.run(["xargs", "-P", str(jobs), "-L", "1", "sh", "-c",
                    f'{planner} "$0" -o "$1" --threads 1 >/dev/null 2>&1 || true'], input=lines, text=True, check=True)
    plain, plain_cpu = time.time() - begin, children_seconds() - plain_cpu
    print(f"{flights} flights, {jobs} at once: {wall:.1f} s by campaign, of processes {sum(flown) / jobs:.1f} s: "
          f"{100 * (1 - sum(flown) / jobs / wall):.1f} % of the time is the campaign's")
    print(f"by xargs {plain:.1f} s: {wall / plain:.3f} times as long; processor time {cpu:.1f} and {plain_cpu:.1f} s: "
          f"{cpu / plain_cpu:.3f} times as much")
    print(f"largest process {largest:.0f} MB, the map's pages included")
finally:
    shutil.rmtree(work, ignore_errors=True)

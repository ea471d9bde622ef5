#!/usr/bin/python3
"""What a ROS 2 reader of IMU samples gets beside clouds on a loaded machine.

imu_gaps.py PROGRAM IMU_READER [SECONDS]

Flights in real time that hover in a small forest with a LiDAR; one reader with ROS' own sensor profile (best
effort, depth 5) takes the 200 IMU samples a second, another process the clouds; alone, and beside ten times as
many busy processes as there are cores.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

LOCALHOST = (
    "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto"
    "</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex><Peers>"
    "<Peer address='127.0.0.1'/></Peers></Discovery>"
)


def main():
    program, reader = sys.argv[1:3]
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 20.0
    cores = os.cpu_count()
    folder = tempfile.mkdtemp()
    run = lambda *a: subprocess.run([program, *a], check=True, capture_output=True, text=True)
    environment = {**os.environ, "ROS_DOMAIN_ID": "92", "CYCLONEDDS_URI": LOCALHOST}
    try:
        run("map", "forest", "--size-x", "24", "--size-y", "20", "-o", f"{folder}/f.pcd")
        run("map", "import", f"{folder}/f.pcd", "-o", f"{folder}/f.pfmap")
        run("scenario", "new", f"{folder}/f.pfmap", "-o", f"{folder}/new.yaml", "--length", "1")
        start = re.search(r"start: (\[.*?\])", open(f"{folder}/new.yaml").read()).group(1)
        print(f"{'LiDAR':10} {'load':>5}  of the IMU samples   between two of them       real-time factor")
        for lidar in ("mid360", "os1_128"):
            with open(f"{folder}/hover.yaml", "w") as out:
                out.write(f"map: f.pfmap\nvehicles:\n  - {{start: {start}, lidars: [{{model: {lidar}}}]}}\n"
                          "output: {scans: false, imu: false}\n")
            for load in (0, 10 * cores):
                busy = [subprocess.Popen(["sh", "-c", "while :; do :; done"]) for _ in range(load)]
                flight = subprocess.Popen(
                    [program, "fly", f"{folder}/hover.yaml", "--ros2", "--ros2-localhost"],
                    env={**os.environ, "ROS_DOMAIN_ID": "92"}, stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL, text=True)
                time.sleep(2)
                imu = subprocess.Popen([reader, "rt/drone0/imu"], env=environment, stdout=subprocess.PIPE, text=True)
                clouds = subprocess.Popen([reader, f"rt/drone0/{lidar}/points"], env=environment,
                                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                time.sleep(seconds)
                imu.terminate()
                said = imu.communicate()[0].strip()
                clouds.kill()
                flight.terminate()
                factor = re.search(r"real-time factor\s+([\d.]+)", flight.communicate()[0])
                for process in busy:
                    process.kill()
                for process in [clouds, *busy]:
                    process.wait()
                came = re.match(r"imu (\d+) of (\d+), gaps (.*)", said)
                share = 100.0 * int(came[1]) / int(came[2]) if came else 0.0
                print(f"{lidar:10} {load:>5}  {share:6.1f} %   {came[3] if came else said}   "
                      f"{factor[1] if factor else '?'}", flush=True)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


main()

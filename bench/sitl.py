#!/usr/bin/env python3
"""What a firmware in the loop costs, with a peer that answers at once (tests/sitl/px4_peer): the CPU time of flights at the
wall clock's pace with our own autopilot and with PX4's link, in turns; and how many times faster than real time a vehicle
with a Mid-360 flies under the firmware's clock. Arguments: the program, the peer, a map (made: a warehouse at 0.05 m)."""
import os
import resource
import subprocess
import sys
import tempfile
import time

PROGRAM, PEER = sys.argv[1], sys.argv[2]


def cpu():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def fly(folder, map_path, firmware, lidar, seconds, rate, more=()):
    """CPU time of the program and wall time, both s."""
    scenario = os.path.join(folder, "scenario.yaml")
    instance = 180
    autopilot = f", autopilot: {{kind: px4, instance: {instance}}}" if firmware else ", imu_rate: 250"
    sensors = "" if firmware else "sensors: [{kind: magnetometer}, {kind: barometer}, {kind: gnss}]\n"
    with open(scenario, "w", encoding="utf-8") as file:
        file.write(f"map: {os.path.abspath(map_path)}\nduration: {seconds}\nvehicle: {{start: [10, 5, 1.5]{autopilot}}}\n"
                   f"lidars: {'[{model: mid360}]' if lidar else '[]'}\n{sensors}")
    before, start = cpu(), time.time()
    run = subprocess.Popen([PROGRAM, "fly", scenario, "-o", folder + "/run", "--force", "--no-picture", "--no-scans",
                            "--rate", rate, "--json", *more], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    peer = subprocess.Popen([PEER, str(4560 + instance)], stdout=subprocess.PIPE, text=True) if firmware else None
    run.communicate()
    used, took = cpu() - before, time.time() - start  # of the program alone: the peer is not collected yet
    if peer:
        peer.communicate()
    return used, took


with tempfile.TemporaryDirectory() as folder:
    map_path = sys.argv[3] if len(sys.argv) > 3 else os.path.join(folder, "hall.pfmap")
    if len(sys.argv) <= 3:
        subprocess.run([PROGRAM, "world", "make", "warehouse", "-o", map_path], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
    rounds, seconds = 3, 20
    own, px4 = [], []
    for _ in range(rounds):
        own.append(fly(folder, map_path, False, False, seconds, "1")[0])
        px4.append(fly(folder, map_path, True, False, seconds, "1")[0])
        print(f"{seconds} s at real time, no LiDAR: own autopilot {own[-1]:.2f} s of CPU, PX4's link {px4[-1]:.2f} s", flush=True)
    more = (sorted(px4)[rounds // 2] - sorted(own)[rounds // 2]) / seconds
    print(f"the link takes {100 * more:.1f} % of a core more than our own autopilot (medians)")
    for what, lidar, more in (("with a Mid-360, wide beams (the default)", True, ()),
                              ("with a Mid-360, --fidelity line", True, ("--fidelity", "line")),
                              ("without a LiDAR", False, ())):
        for name, firmware in (("own autopilot", False), ("PX4's link", True)):
            took = sorted(fly(folder, map_path, firmware, lidar, seconds, "max", more)[1] for _ in range(rounds))
            print(f"{seconds} s {what}, {name}: {seconds / took[rounds // 2]:.1f} times real time (median of {rounds}, start included)",
                  flush=True)

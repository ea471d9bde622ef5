#!/usr/bin/python3
"""A day under the clock of a PX4 that answers at once (tests/sitl/px4_peer), twice at a time: no message may be left out or come
twice, both clocks must stay together, and both days must be the same bytes though each is in the other's way.

usage: px4_day.py PROGRAM PEER [HOURS]
"""
import os
import subprocess
import sys
import tempfile

PROGRAM, PEER = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
HOURS = float(sys.argv[3]) if len(sys.argv) > 3 else 24.0
RATE = 250  # of HIL_SENSOR, Hz


def start(folder, instance, seconds):
    with open(f"{folder}/{instance}.yaml", "w", encoding="utf-8") as file:
        file.write(f"map: hall.pfmap\nduration: {seconds}\nlidars: []\n"
                   f"vehicle: {{start: [10, 5, 1.5], imu_rate: {RATE}, autopilot: {{kind: px4, instance: {instance}}}}}\n"
                   "output: {scans: false, imu: false, trajectory_rate: 0.1}\n")
    run = subprocess.Popen([PROGRAM, "fly", f"{instance}.yaml", "-o", f"run{instance}", "--no-picture", "--rate", "max"],
                           cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    peer = subprocess.Popen([PEER, str(4560 + instance)], stdout=subprocess.PIPE, text=True)
    return run, peer


def main():
    seconds = round(3600 * HOURS)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([PROGRAM, "world", "make", "warehouse", "-o", "hall.pfmap"], cwd=folder, check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        days = [start(folder, instance, seconds) for instance in (181, 182)]
        said = []
        for run, peer in days:
            said.append(peer.communicate()[0].strip())
            error = run.communicate()[1]
            if run.returncode != 0 or peer.returncode != 0:
                sys.exit(f"exit codes {run.returncode} and {peer.returncode}: {said[-1]}\n{error}")
        print(f"{HOURS:g} h: {said[0]}")
        words = said[0].split()
        if said[0] != said[1]:
            sys.exit(f"the other day was another: {said[1]}")
        messages, last = int(words[0]), int(words[2])
        if abs(messages - RATE * seconds) > 2 or abs(last - 1e6 * seconds) > 2e6 / RATE:
            sys.exit(f"{RATE * seconds} messages up to {seconds} s were expected")


main()

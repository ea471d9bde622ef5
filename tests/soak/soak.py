#!/usr/bin/python3
"""A long flight whose memory and open files must stay as they are after its first minute.

usage: soak.py PROGRAM [MINUTES]

Five vehicles with LiDARs among obstacles, all files written, a recording for each ROS, as fast as it goes.
"""
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

PROGRAM = sys.argv[1]
MINUTES = float(sys.argv[2]) if len(sys.argv) > 2 else 20.0
WARM = 60.0  # s; caches, pools and the first chunks of recordings fill
SLACK = 4.0  # MB of noise of an allocator

SCENARIO = """
map: forest.pfmap
duration: 900000
vehicles:
  - name: a
    start: [4, 4, 17]
    copies: 5
    copy_offset: [4, 3, 0]
    command_timeout: 0
    lidars: [{model: mid360}]
    commands:
%s
obstacles:
  - {count: 30, radius: 0.2, radius_max: 0.5, speed: 0.5, speed_max: 2}
air:
  wind: {mean: [2, 0, 0], turbulence: light}
output: {scans: false, odometry: true}
"""


def sample(process):
    """(MB in memory of its own, open files)"""
    with open(f"/proc/{process.pid}/status") as file:
        status = file.read()
    # what is mapped (the map) or written (pages of files) is the kernel's business
    anonymous = int(re.search(r"RssAnon:\s+(\d+)", status).group(1)) / 1024
    return anonymous, len(os.listdir(f"/proc/{process.pid}/fd"))


def run(*arguments, folder):
    subprocess.run([PROGRAM, *arguments], cwd=folder, check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)


def fly(folder):
    # to and fro for hours
    legs = "\n".join(f"      - {{time: {10 * i}, kind: velocity, vector: [{0.5 if i % 2 else -0.5}, 0, 0]}}"
                     for i in range(6000))
    with open(f"{folder}/s.yaml", "w") as file:
        file.write(SCENARIO % legs)
    command = [PROGRAM, "fly", "s.yaml", "-o", "run", "--record", "a.mcap"]
    if "ROS 1   yes" in subprocess.run([PROGRAM, "--version"], capture_output=True, text=True).stdout:
        command += ["--record", "a.bag"]
    with open(f"{folder}/log", "w") as log:
        process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log)
        start = time.monotonic()
        samples = []
        while time.monotonic() - start < 60 * MINUTES:
            time.sleep(2.0)
            if process.poll() is not None:
                sys.exit(f"soak: the flight ended with {process.returncode}:\n{open(log.name).read()[-2000:]}")
            samples.append((time.monotonic() - start, *sample(process)))
        process.send_signal(signal.SIGINT)
        code = process.wait()
    if code != 130:
        sys.exit(f"soak: exit code {code}:\n{open(log.name).read()[-2000:]}")
    return samples


def main():
    with tempfile.TemporaryDirectory(prefix="pointflight_soak_") as folder:
        run("map", "forest", "--size-x", "30", "--size-y", "24", "--density", "300", "-o", "forest.pcd",
            folder=folder)
        run("map", "import", "forest.pcd", "-o", "forest.pfmap", "--resolution", "0.1", folder=folder)
        samples = fly(folder)
        with open(f"{folder}/run/summary.json") as file:
            flown = float(re.search(r'"simulated_time": ([0-9.]+)', file.read()).group(1))
        recorded = sum(os.path.getsize(f"{folder}/{name}") for name in os.listdir(folder)
                       if name.startswith("a.")) / 1e9
    warm = [s for s in samples if s[0] > WARM] or samples[len(samples) // 2:]
    quarter = max(1, len(warm) // 4)
    early = max(memory for _, memory, _ in warm[:quarter])
    late = max(memory for _, memory, _ in warm[-quarter:])
    files = {count for _, _, count in warm}
    print(f"soak: {flown:.0f} s flown in {60 * MINUTES:.0f} s, {recorded:.2f} GB recorded; "
          f"{early:.1f} MB in the first quarter, {late:.1f} MB in the last, {sorted(files)} open files")
    if late > early + SLACK:
        sys.exit("soak: the memory grows")
    if len(files) > 1:
        sys.exit("soak: the number of open files changes")


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""RViz with the catkin package's configuration, on a display of its own: does it show map and scan?

rviz_test.py PROGRAM RVIZ_CONFIGURATION PICTURE.png
"""

import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

PROGRAM, CONFIGURATION, PICTURE = sys.argv[1:4]

try:
    import numpy
    from PIL import Image
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)
for needed in ("/usr/bin/rosmaster", "/usr/bin/rviz", "/usr/bin/Xvfb"):
    if not os.path.exists(needed):
        print(f"skipped: no {needed} here")
        sys.exit(77)


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def screenshot(path):
    """The frame buffer that Xvfb keeps in a file, in the format of xwd, as rows x columns x RGB."""
    with open(path, "rb") as source:
        data = source.read()
    header = struct.unpack_from(">25I", data)
    start = header[0] + 12 * header[19]  # behind the header and its colour map
    width, height, step = header[4], header[5], header[12]
    rows = numpy.frombuffer(data, numpy.uint8, height * step, start).reshape(height, step)
    return rows[:, : 4 * width].reshape(height, width, 4)[:, :, 2::-1].astype(int)


def orange(picture):
    """How many pixels have the colour of the scan."""
    return int((abs(picture - [255, 140, 0]).max(axis=2) < 12).sum())


def coloured(picture, channel):
    """How many pixels are mostly of one colour: the map's heights run from red to blue."""
    others = picture[:, :, [c for c in range(3) if c != channel]].max(axis=2)
    return int((picture[:, :, channel] > others + 25).sum())


def wait_for(condition, seconds, what):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.2)
    raise AssertionError(f"waited {seconds} s for {what}")


def main(folder, started):
    def start(arguments, **more):
        process = subprocess.Popen(
            arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **more
        )
        started.append(process)
        return process

    port = free_port()
    os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_HOME=folder,
                      HOME=folder, LIBGL_ALWAYS_SOFTWARE="1", XDG_RUNTIME_DIR=folder)
    start(["/usr/bin/rosmaster", "--core", "-p", str(port)])
    read_end, write_end = os.pipe()
    start(["/usr/bin/Xvfb", "-displayfd", str(write_end), "-fbdir", folder, "-screen", "0",
           "1200x800x24", "-nolisten", "tcp"], pass_fds=[write_end])
    os.close(write_end)
    os.environ["DISPLAY"] = ":" + os.read(read_end, 20).decode().strip()
    shown = os.path.join(folder, "Xvfb_screen0")

    def run(*arguments):
        subprocess.run([PROGRAM, *arguments], check=True, capture_output=True, cwd=folder)

    run("map", "forest", "--size-x", "24", "--size-y", "24", "--trees", "600", "-o", "f.pcd")
    run("map", "import", "f.pcd", "-o", "f.pfmap", "--resolution", "0.1")
    run("scenario", "new", "f.pfmap", "-o", "s.yaml", "--length", "15")

    start(["/usr/bin/rviz", "-d", CONFIGURATION])
    # its grid is there
    wait_for(lambda: screenshot(shown)[200:700, 200:1000].std() > 3, 60, "RViz")
    before = screenshot(shown)
    start([PROGRAM, "fly", "s.yaml", "--ros1"], cwd=folder)
    wait_for(lambda: orange(screenshot(shown)) > 1000, 60, "the scan")
    wait_for(
        lambda: all(coloured(screenshot(shown), c) > coloured(before, c) + 2000 for c in range(3)),
        30,
        "the map",
    )
    time.sleep(2.0)
    picture = screenshot(shown)
    Image.fromarray(picture.astype(numpy.uint8)).save(PICTURE)
    time.sleep(1.0)
    moved = int((abs(screenshot(shown) - picture).max(axis=2) > 20).sum())
    print(f"scan: {orange(picture)} pixels (before {orange(before)}); red, green, blue: "
          f"{[coloured(picture, c) for c in range(3)]} (before "
          f"{[coloured(before, c) for c in range(3)]}); {moved} changed in a second; {PICTURE}")
    assert orange(before) == 0
    assert moved > 5000, "the picture does not move"


folder = tempfile.mkdtemp()
processes = []
try:
    main(folder, processes)
finally:
    for process in reversed(processes):
        process.send_signal(signal.SIGINT)
    for process in reversed(processes):
        try:
            process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
    shutil.rmtree(folder, ignore_errors=True)

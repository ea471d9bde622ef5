#!/usr/bin/python3
"""What it costs to publish to ROS, and how late scans leave.

ros_bench.py PROGRAM CYCLONE_NODE [ROUNDS]

Flights of 10 s in real time that hover in a small forest with a Mid-360 (20,000 beams, 10 Hz): without
ROS, to a node of Cyclone DDS and to one of rospy, interleaved. The nodes read odometry and IMU at
200 Hz and clouds. What is printed is the processor time of the flight alone, start-up included.
"""

import os
import re
import resource
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time

SECONDS = 10
LOCALHOST = (
    "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto"
    "</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex><Peers>"
    "<Peer address='127.0.0.1'/></Peers></Discovery>"
    "<Internal><SocketReceiveBufferSize max='212992 B'/></Internal>"
)
ROSPY_NODE = """
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
rospy.init_node("reader", disable_signals=True)
nothing = lambda message: None
rospy.Subscriber("/drone0/odom", Odometry, nothing, queue_size=100)
rospy.Subscriber("/drone0/imu", Imu, nothing, queue_size=100)
rospy.Subscriber("/drone0/mid360/points", rospy.AnyMsg, nothing, queue_size=10)
rospy.spin()
"""


def flight(program, arguments, environment):
    """Processor seconds, and what it said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, "fly", *arguments], env={**os.environ, **environment},
                          capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"the flight failed: {done.stderr}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stderr


def main():
    program, node = sys.argv[1:3]
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 3
    folder = tempfile.mkdtemp()
    run = lambda *a: subprocess.run([program, *a], check=True, capture_output=True, text=True)
    os.environ["ROS_DOMAIN_ID"] = "91"
    helpers = []
    try:
        run("map", "forest", "--size-x", "24", "--size-y", "20", "-o", f"{folder}/f.pcd")
        run("map", "import", f"{folder}/f.pcd", "-o", f"{folder}/f.pfmap")
        run("scenario", "new", f"{folder}/f.pfmap", "-o", f"{folder}/new.yaml", "--length", "1")
        start = re.search(r"start: (\[.*?\])", open(f"{folder}/new.yaml").read()).group(1)
        scenario = f"{folder}/hover.yaml"
        with open(scenario, "w") as out:
            out.write(f"map: f.pfmap\nduration: {SECONDS}\nvehicles:\n  - {{start: {start}}}\n"
                      "output: {scans: false, imu: false}\n")
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        ros1 = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1",
                "ROS_HOME": f"{folder}/ros"}
        cases = {"none": (["--rate", "1.0", "-o", f"{folder}/out", "--force"], {}),
                 "ROS 2": (["--ros2", "--ros2-localhost"], {})}
        if shutil.which("rosmaster", path="/usr/bin"):
            helpers.append(subprocess.Popen(
                ["/usr/bin/rosmaster", "--core", "-p", str(port)], env={**os.environ, **ros1},
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
            time.sleep(1)
            helpers.append(subprocess.Popen(["/usr/bin/python3", "-c", ROSPY_NODE],
                                            env={**os.environ, **ros1}))
            cases["ROS 1"] = (["--ros1"], ros1)
        cost = {name: [] for name in cases}
        late = {name: [] for name in cases}
        for r in range(rounds):
            for name, (flags, environment) in cases.items():
                reader = None
                if name == "ROS 2":
                    reader = subprocess.Popen([node], env={**os.environ, "CYCLONEDDS_URI": LOCALHOST},
                                              stdout=subprocess.PIPE, text=True)
                seconds, said = flight(program, [scenario, *flags], environment)
                cost[name].append(seconds)
                found = re.search(r"scans were ready ([\d.]+) ms .*, ([\d.]+) ms at p99", said)
                if found:
                    late[name].append((float(found.group(1)), float(found.group(2))))
                if reader:
                    reader.terminate()
                    counts = reader.communicate()[0]
                    clouds = int(re.search(r"cloud (\d+)", counts).group(1))
                    if clouds < 8 * SECONDS:
                        sys.exit(f"the node got {clouds} clouds: {counts}")
                print(f"round {r + 1} {name}: {seconds:.2f} s", file=sys.stderr)
        base = statistics.median(cost["none"])
        print(f"{'':8} core      more than none  a scan leaves after its end (median, p99)")
        for name in cases:
            share = 100.0 * statistics.median(cost[name]) / SECONDS
            more = share - 100.0 * base / SECONDS
            line = f"{name:8} {share:5.1f} %   {more:+5.1f} %"
            if late[name]:
                middle = sorted(late[name])[len(late[name]) // 2]
                line += f"         {middle[0]:.1f} ms, {middle[1]:.1f} ms"
            print(line)
    finally:
        for helper in helpers:
            helper.kill()
            helper.wait()
        shutil.rmtree(folder, ignore_errors=True)


main()

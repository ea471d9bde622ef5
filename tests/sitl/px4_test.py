#!/usr/bin/env python3
"""PX4's side of `fly --px4`, imitated by a process of its own (px4_stack.py): flights, clocks, and all that goes wrong.
Arguments: the program, then names of tests."""
import csv
import hashlib
import json
import math
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from px4_stack import GPS, SENSOR, TRUTH, Peer, Stack, Vehicle, unpack

PROGRAM = sys.argv[1]
# exact enough for a stack without filters worth the name
SENSORS = """
sensors:
  - {kind: gnss, rate: 10, horizontal: 0.01, vertical: 0.01, noise: 0.01, velocity_noise: 0.02, latency: 0}
  - {kind: barometer, offset: 0, drift: 0, noise: 1}
  - {kind: magnetometer, hard_iron: 0.1, scale_error: 0, declination_deg: 0, rate: 100}
"""


def vehicle_of(name):
    """As a user would tell PX4."""
    text = subprocess.run([PROGRAM, "vehicle", "px4-params", name], check=True, capture_output=True, text=True).stdout
    parameters = {line.split("\t")[2]: float(line.split("\t")[3]) for line in text.splitlines() if line[0] != "#"}
    shown = subprocess.run([PROGRAM, "vehicle", "show", name, "--json"], check=True, capture_output=True, text=True)
    return Vehicle(parameters, json.loads(shown.stdout)["settings"]["mass"])


class Flight:
    """`fly` of a scenario in the made-up hall, and its ports."""

    def __init__(self, folder, extra="", duration=14.0, flags=(), text="", port_offset=None):
        # an instance whose ports are free
        self.instance = port_offset if port_offset is not None else free_instance()
        self.folder = folder
        scenario = os.path.join(folder, "scenario.yaml")
        with open(scenario, "w", encoding="utf-8") as file:
            file.write(text.replace("INSTANCE", str(self.instance)) or
                       f"map: {MAP}\nseed: 3\nduration: {duration}\n"
                       f"vehicle: {{start: [10, 5, 2], start_yaw_deg: 90, "
                       f"autopilot: {{kind: px4, instance: {self.instance}, wait: 2}}}}\n"
                       f"lidars: []\n{extra or SENSORS}")
        self.out = os.path.join(folder, "run")
        self.run = subprocess.Popen(
            [PROGRAM, "fly", scenario, "-o", self.out, "--rate", "max", "--no-picture", "--force", *flags],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    @property
    def port(self):
        return 4560 + self.instance

    def end(self):
        _, self.err = self.run.communicate(timeout=120)
        return self.run.returncode

    def stop(self):
        self.run.kill()
        self.run.communicate()

    def truth(self):
        with open(os.path.join(self.out, "trajectory.csv"), encoding="utf-8") as file:
            return list(csv.DictReader(file))


def free_instance():
    for instance in range(50, 150):
        with socket.socket() as s:
            try:
                s.bind(("127.0.0.1", 4560 + instance))
                return instance
            except OSError:
                continue
    raise AssertionError("no free port")


def goals(t):
    """Up 1.5 m, 3 m north, 2 m west with the heading to the north-east, and stay."""
    if t < 2.0:
        return None
    if t < 5.0:
        return (0.0, 0.0, 1.5, 0.0)
    if t < 9.0:
        return (3.0, 0.0, 1.5, 0.0)
    return (3.0, -2.0, 1.5, math.pi / 4)


class Px4Test(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def flight(self, folder="", **options):
        flight = Flight(self.folder.name + folder, **options)
        self.addCleanup(flight.stop)
        return flight

    def peer(self, flight, *arguments):
        peer = Peer(flight.port, *arguments)
        self.addCleanup(peer.socket.close)
        return peer

    def test_a_stack_of_another_make_flies_by_the_sensors_alone(self):
        flight = self.flight()
        peer = self.peer(flight, Stack(vehicle_of("quad_330"), goals))
        peer.run(100.0)
        self.assertEqual(flight.end(), 0, flight.err)
        rows = flight.truth()
        first, last = rows[0], rows[-1]
        # from where it stood: 2 m west, 3 m north, 1.5 m up, the heading 45 degrees
        self.assertAlmostEqual(float(last["px"]) - float(first["px"]), -2.0, delta=0.35)
        self.assertAlmostEqual(float(last["py"]) - float(first["py"]), 3.0, delta=0.35)
        self.assertAlmostEqual(float(last["pz"]) - float(first["pz"]), 1.5, delta=0.35)
        yaw = 2 * math.atan2(float(last["qz"]), float(last["qw"]))
        self.assertAlmostEqual(math.degrees(yaw) % 360, 45.0, delta=6.0)
        with open(os.path.join(flight.out, "summary.json"), encoding="utf-8") as file:
            self.assertEqual(json.load(file)["vehicles"][0]["collisions"], 0)
        # each 4 ms a HIL_SENSOR, from 4 ms on, each answered
        self.assertEqual(peer.times, [4000 * (i + 1) for i in range(len(peer.times))])
        self.assertGreaterEqual(len(peer.times), 3498)
        self.assertIn("0 waited for in vain", flight.err)
        self.assertAlmostEqual(peer.counts[TRUTH], 14 * 200, delta=10)
        self.assertAlmostEqual(peer.counts[GPS], 140, delta=2)

    def test_truth_and_fixes_are_in_px4s_frames(self):
        flight = self.flight(duration=3.0)
        peer = self.peer(flight)
        peer.run(100.0)
        self.assertEqual(flight.end(), 0, flight.err)
        truth, gps, sensor = peer.last[TRUTH], peer.last[GPS], peer.last[SENSOR]
        self.assertAlmostEqual(abs(truth[1]), 1.0, delta=1e-3)  # heads north, level
        self.assertAlmostEqual(truth[8] * 1e-7, 50 + 5 / 111229, delta=1e-5)  # latitude: y is north
        self.assertAlmostEqual(truth[9] * 1e-7, 8 + 10 / 71700, delta=1e-5)
        self.assertAlmostEqual(gps[1] * 1e-7, truth[8] * 1e-7, delta=2e-6)
        self.assertEqual(gps[11], 3)
        self.assertAlmostEqual(sensor[3], -9.81, delta=0.3)  # specific force at rest: up, so -z
        # the field points north and down
        self.assertGreater(sensor[7], 0.15)
        self.assertGreater(sensor[9], 0.3)
        self.assertAlmostEqual(sensor[10], 1013.25 - 0.12 * truth[10] / 1000, delta=0.6)

    def sensors_of(self, mood):
        flight = self.flight(duration=6.0)
        peer = self.peer(flight, Stack(vehicle_of("quad_330"), goals), mood)
        peer.run(100.0)
        self.assertEqual(flight.end(), 0, flight.err)
        self.assertEqual(len(peer.times), len(set(peer.times)))
        return hashlib.sha256(b"".join(peer.sensor_bytes)).hexdigest()

    def test_the_same_actuators_get_the_same_bytes_whatever_the_load(self):
        self.assertEqual(self.sensors_of(()), self.sensors_of(("late", "junk")))

    def test_one_that_stops_answering_is_said_and_gone_on_without(self):
        flight = self.flight(duration=4.0)
        peer = self.peer(flight)
        peer.run(100.0, silent=((1.0, 1.3),))
        self.assertEqual(flight.end(), 0, flight.err)
        self.assertIn("PX4 does not answer; waiting for 2 s", flight.err)
        self.assertIn("going on at the wall clock's pace", flight.err)
        self.assertIn("1 waited for in vain", flight.err)

    def test_a_new_firmware_starts_the_run_again(self):
        flight = self.flight(duration=3.0)
        first = self.peer(flight)
        first.run(1.0)
        first.socket.close()
        second = self.peer(flight)
        second.run(100.0)
        self.assertEqual(flight.end(), 0, flight.err)
        self.assertIn("PX4 is gone", flight.err)
        self.assertIn("connected again: from the start", flight.err)
        self.assertGreater(second.times[0], first.times[-1])
        self.assertEqual(second.times, sorted(set(second.times)))
        self.assertGreaterEqual(len(second.times), 740)  # all of the run

    def test_strangers_at_the_port_do_no_harm(self):
        flight = self.flight(duration=3.0)
        with socket.create_connection(("127.0.0.1", flight_port(flight)), timeout=20) as s:
            s.sendall(b"GET / HTTP/1.1\r\n\r\n" + bytes(range(256)) * 300)
        self.peer(flight).run(100.0)
        self.assertEqual(flight.end(), 0, flight.err)
        self.assertIn("bytes of junk", flight.err)

    def test_one_that_says_nothing_does_not_keep_px4_out(self):
        flight = self.flight(duration=2.0)
        with socket.create_connection(("127.0.0.1", flight_port(flight)), timeout=20):
            self.peer(flight).run(100.0)
            self.assertEqual(flight.end(), 0, flight.err)
        self.assertIn("0 waited for in vain", flight.err)

    def test_one_that_floods_is_survived(self):
        flight = self.flight(duration=2.0)
        flood = socket.create_connection(("127.0.0.1", flight_port(flight)), timeout=5)
        until = time.time() + 1.5
        while time.time() < until:
            try:
                flood.sendall(b"\xfd\xff" * 100000)
            except OSError:
                break
        flood.close()
        self.peer(flight).run(100.0)
        self.assertEqual(flight.end(), 0, flight.err)

    def test_vision_ranges_and_obstacles_are_where_they_are(self):
        """A room of 10 by 8 by 3 m; the vehicle stands at (3, 2) and heads north."""
        room = os.path.join(self.folder.name, "room.xyz")
        with open(room, "w", encoding="utf-8") as file:
            for i in range(251):
                for k in range(201):
                    x, y, z, w = 0.04 * i, 0.04 * k, 0.04 * (k % 76), 0.04 * (i % 76)
                    file.write(f"{x} {y} 0\n{x} 0 {z}\n{x} 8 {z}\n0 {y} {w}\n10 {y} {w}\n")
        subprocess.run([PROGRAM, "map", "import", room, "-o", room + ".pfmap", "--resolution", "0.1"], check=True,
                       capture_output=True)
        flight = self.flight(text=f"""map: {room}.pfmap
duration: 1.0
vehicle: {{start: [3, 2, 1], start_yaw_deg: 90, autopilot: {{kind: px4, instance: INSTANCE, vision: true, obstacles: true}}}}
lidars: [{{model: vlp16}}]
sensors: [{{kind: range_finder, rotation_rpy_deg: [0, 0, 0], range_min: 0.05}}]
""")
        offboard = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(offboard.close)
        offboard.bind(("127.0.0.1", 14580 + flight.instance))
        offboard.settimeout(20)
        peer = self.peer(flight)
        peer.run(100.0)
        self.assertEqual(flight.end(), 0, flight.err)
        vision, distance = peer.last[331], peer.last[132]
        # north, east, down; level and heading north
        for axis, wanted in enumerate((2.0, 3.0, -0.28)):
            self.assertAlmostEqual(vision[1 + axis], wanted, delta=0.05)
        self.assertAlmostEqual(abs(vision[4]), 1.0, delta=1e-3)
        self.assertEqual(vision[56:60], (1, 12, 0, 2))  # LOCAL_NED, BODY_FRD, no resets, vision
        # the range finder looks ahead, at the wall in the north
        self.assertEqual(distance[6], 0)
        self.assertAlmostEqual(distance[3] / 100, 6.0, delta=0.15)
        data = offboard.recv(1000)
        length = data[1]
        obstacles = unpack(330, data[10:10 + length])
        for direction, wanted in ((0, 6.0), (18, 7.0), (36, 2.0), (54, 3.0)):  # clockwise, each 5 degrees
            # the nearest of some noisy points
            self.assertAlmostEqual(obstacles[1 + direction] / 100, wanted, delta=0.25)

    def test_obstacles_need_a_lidar(self):
        flight = self.flight(text=f"map: {MAP}\nlidars: []\nvehicle: {{start: [10, 5, 2], autopilot: {{kind: px4, obstacles: true}}}}\n")
        self.assertEqual(flight.end(), 2)
        self.assertEqual(flight.err, "pointflight: drone0: autopilot.obstacles: is for a vehicle with a LiDAR\n")

    def test_firmwares_and_our_own_autopilot_in_one_run(self):
        flight = self.flight(text=f"""map: {MAP}
duration: 6.0
vehicles:
  - {{name: own, start: [10, 7, 2], lidars: [], mission: {{waypoints: [[10, 8, 2]]}}}}
  - {{name: first, start: [10, 5, 2], start_yaw_deg: 90, lidars: [], autopilot: {{kind: px4, instance: INSTANCE}}}}
  - {{name: second, start: [10, 3, 2], start_yaw_deg: 90, lidars: [], autopilot: {{kind: px4, instance: {free_instance() + 30}}}}}
""")
        peers = [self.peer(flight)]
        with open(os.path.join(self.folder.name, "scenario.yaml"), encoding="utf-8") as file:
            second = int(re.search(r"second.*instance: (\d+)", file.read())[1])
        peers.append(Peer(4560 + second))
        self.addCleanup(peers[1].socket.close)
        threads = [threading.Thread(target=peer.run, args=(100.0,)) for peer in peers]
        for thread in threads:
            thread.start()
        self.assertEqual(flight.end(), 0, flight.err)
        for thread in threads:
            thread.join()
        self.assertEqual(peers[0].times, peers[1].times)
        self.assertEqual(flight.err.count("0 waited for in vain"), 2)
        with open(os.path.join(flight.out, "own", "trajectory.csv"), encoding="utf-8") as file:
            self.assertAlmostEqual(float(list(csv.DictReader(file))[-1]["py"]), 8.0, delta=0.1)

    def fake_px4(self, body):
        """A program in the place of PX4's."""
        path = os.path.join(self.folder.name, "px4")
        with open(path, "w", encoding="utf-8") as file:
            file.write(f"#!{sys.executable}\nimport sys, os\nsys.path.insert(0, {os.path.dirname(os.path.abspath(__file__))!r})\n"
                       f"from px4_stack import Peer\nport = 4560 + int(sys.argv[sys.argv.index('-i') + 1])\n{body}\n")
        os.chmod(path, 0o755)
        return path

    def test_px4_is_started_and_ended(self):
        body = ("print('mass', os.environ['PX4_PARAM_CA_ROTOR_COUNT'], os.environ['PX4_SYS_AUTOSTART'], flush=True)\n"
                "Peer(port).run(100.0)\nimport time\ntime.sleep(100)")
        flight = self.flight(duration=1.0, flags=("--px4-start", self.fake_px4(body)))
        self.assertEqual(flight.end(), 0, flight.err)
        with open(os.path.join(flight.out + "_px4", str(flight.instance), "console.txt"), encoding="utf-8") as file:
            self.assertEqual(file.read(), "mass 4 10016\n")
        self.assertIn("0 waited for in vain", flight.err)

    def test_a_px4_that_ends_ends_the_flight(self):
        flight = self.flight(duration=5.0, flags=("--px4-start", self.fake_px4("Peer(port).run(0.5)\nsys.exit(3)")))
        self.assertEqual(flight.end(), 2)
        self.assertIn("PX4 has ended (exit code 3); its console:", flight.err)
        other = self.flight(flags=("--px4-start", self.folder.name + "/none"))
        self.assertEqual(other.end(), 2)
        self.assertIn("there is no such program", other.err)

    def test_a_port_in_use_is_said(self):
        flight = self.flight()
        self.peer(flight).run(0.1)
        os.mkdir(self.folder.name + "/other")
        other = self.flight("/other", port_offset=flight.instance)
        self.assertEqual(other.end(), 2)
        self.assertRegex(other.err, r"TCP port \d+ of 127\.0\.0\.1: Address already in use")
        self.assertEqual(len([line for line in other.err.splitlines() if "port" in line]), 1)


def flight_port(flight):
    """Once it listens."""
    while True:
        try:
            socket.create_connection(("127.0.0.1", flight.port), timeout=5).close()
            return flight.port
        except ConnectionRefusedError:
            continue


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as maps:
        MAP = os.path.join(maps, "hall.pfmap")
        subprocess.run([PROGRAM, "world", "make", "warehouse", "-o", MAP, "--resolution", "0.2"], check=True,
                       stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        unittest.main(argv=[sys.argv[0], *sys.argv[2:]])

#!/usr/bin/env python3
"""ArduPilot's side of `fly --ardupilot`, imitated by a process of its own: it sends servo packets, reads the JSON as
ArduPilot's own reader does (a search for keys), and flies by the loops of px4_stack.py. Argument: the program."""
import json
import math
import os
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from px4_stack import Stack
from px4_test import vehicle_of

PROGRAM = sys.argv[1]


class Client:
    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))
        self.socket.settimeout(0.2)
        self.frame = 0

    def exchange(self, outputs, rate=1000, wide=False):
        """One packet, one answer; resends as ArduPilot does. None once nobody answers."""
        pulses = [int(round(1000 + 1000 * u)) for u in outputs]
        count = 32 if wide else 16
        packet = struct.pack(f"<HHI{count}H", 29569 if wide else 18458, rate, self.frame,
                             *pulses, *([0] * (count - len(pulses))))
        self.frame += 1
        self.drain()
        for _ in range(500):
            try:
                self.socket.send(packet)
                return self.read(self.socket.recv(65536))
            except (TimeoutError, ConnectionRefusedError):
                if self.over():
                    return None
                time.sleep(0.02)
        raise AssertionError("no answer")

    def drain(self):
        """On a busy machine a packet that was sent again has two answers."""
        self.socket.setblocking(False)
        try:
            while self.socket.recv(65536):
                pass
        except (BlockingIOError, ConnectionRefusedError):
            pass
        self.socket.settimeout(1.0)

    @staticmethod
    def read(answer):
        text = answer.decode()
        assert text[0] == "\n" and text[-1] == "\n" and text.count("\n") == 2 and " " not in text, text
        numbers = {}
        for key in ("timestamp", "gyro", "accel_body", "position", "velocity", "quaternion"):
            value = re.search(rf'"{key}":\[?([-0-9.,]+)', text)[1]
            numbers[key] = [float(v) for v in value.strip(",").split(",")]
        json.loads(text)
        return numbers


class ArduPilotTest(unittest.TestCase):
    def fly(self, duration, extra="", flags=()):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = os.path.join(folder.name, "run")
        for self.instance in range(20, 90):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
                try:
                    s.bind(("127.0.0.1", 9002 + 10 * self.instance))
                    break
                except OSError:
                    continue
        scenario = os.path.join(folder.name, "scenario.yaml")
        with open(scenario, "w", encoding="utf-8") as file:
            file.write(f"map: {MAP}\nseed: 3\nduration: {duration}\nlidars: []\n"
                       f"vehicle: {{start: [10, 5, 2], start_yaw_deg: 90, autopilot: {{kind: ardupilot, "
                       f"instance: {self.instance}, wait: 2}}}}\n{extra}")
        self.run_ = subprocess.Popen([PROGRAM, "fly", scenario, "-o", self.out, "--rate", "max", "--no-picture", *flags],
                                     stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.run_.communicate)
        self.addCleanup(self.run_.kill)
        client = Client(9002 + 10 * self.instance)
        client.over = lambda: self.run_.poll() is not None
        self.addCleanup(client.socket.close)
        return client

    def end(self):
        _, err = self.run_.communicate(timeout=60)
        self.assertEqual(self.run_.returncode, 0, err)
        return err

    def test_it_flies_by_what_is_answered(self):
        client = self.fly(10.0)
        goal = (2.0, -1.0, 1.5, math.pi / 4)
        stack = Stack(vehicle_of("quad_330"), None)
        outputs, home, times, last = [0.0] * 4, None, [], None
        while (now := client.exchange(outputs, rate=500)) is not None:
            last = now
            times.append(now["timestamp"][0])
            home = home or now["position"]
            if times[-1] < 1.0:
                continue
            stack.q, stack.v = tuple(now["quaternion"]), now["velocity"]
            stack.p = [a - b for a, b in zip(now["position"], home)]
            outputs = [max(0.002, u) for u in stack.control(goal, now["gyro"])]
        err = self.end()
        for axis, wanted in enumerate((2.0, -1.0, -1.5)):
            self.assertAlmostEqual(last["position"][axis] - home[axis], wanted, delta=0.25)
        q = last["quaternion"]
        self.assertAlmostEqual(2 * math.degrees(math.atan2(q[3], q[0])) % 360, 45.0, delta=4.0)
        # a packet of 500 Hz is two steps of 1 ms
        steps = [b - a for a, b in zip(times[1:], times[2:])]
        self.assertAlmostEqual(min(steps), 0.002, delta=1e-6)
        self.assertAlmostEqual(max(steps), 0.002, delta=1e-6)
        self.assertIn("0 waited for in vain", err)

    def test_repeats_are_answered_and_do_not_step(self):
        client = self.fly(1.0)
        first = client.exchange([0.0] * 4)
        second = client.exchange([0.0] * 4, wide=True)
        client.frame -= 1
        again = client.exchange([0.0] * 4, wide=True)
        self.assertEqual(second, again)
        self.assertAlmostEqual(second["timestamp"][0] - first["timestamp"][0], 0.001, delta=1e-6)
        self.assertAlmostEqual(second["accel_body"][2], -9.81, delta=0.5)
        client.socket.send(b"nonsense")
        while client.exchange([0.0] * 4) is not None:
            pass
        self.assertRegex(self.end(), "[1-9] repeated.*1 datagrams of junk")

    def test_one_that_starts_again_starts_the_run_again(self):
        client = self.fly(1.0)
        for _ in range(300):
            before = client.exchange([0.0] * 4)
        client.frame = 0
        after = client.exchange([0.0] * 4)
        self.assertGreater(after["timestamp"][0], before["timestamp"][0])
        count = 0
        while client.exchange([0.0] * 4) is not None:
            count += 1
        self.assertGreater(count, 980)
        self.assertIn("from the start", self.end())


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as maps:
        MAP = os.path.join(maps, "hall.pfmap")
        subprocess.run([PROGRAM, "world", "make", "warehouse", "-o", MAP, "--resolution", "0.2"], check=True,
                       stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        unittest.main(argv=[sys.argv[0], *sys.argv[2:]])

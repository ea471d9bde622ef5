#!/usr/bin/python3
"""Nodes of two DDS implementations join and leave a flight over multicast, among junk.

network_test.py PROGRAM CYCLONE_NODE FAST_NODE [JOINS [JUNK_PACKETS]]

Three hosts on one switch, each a network namespace (an MTU of 1500, multicast as everywhere): the
flight and a node run on one, nodes on the other two. Rates are told by the messages' own stamps: a
busy machine makes no difference to them.
"""

import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from namespaces import Network, own_namespace  # noqa: E402

DOMAIN = 17
BASE = 7400 + 250 * DOMAIN
HOSTS = {"drone": "10.99.0.1", "left": "10.99.0.2", "right": "10.99.0.3"}
HERTZ = {"odometry": 200, "imu": 200, "cloud": 10}


class Node:
    """A node that joins; `leave` gives what it counted: {topic: (messages, seconds, gap)}."""

    def __init__(self, network, host, program, *words):
        self.kind = os.path.basename(program)
        self.process = network.on(host, [program, *words], stdout=subprocess.PIPE,
                                  stderr=subprocess.DEVNULL, text=True)

    def leave(self):
        self.process.terminate()
        out, _ = self.process.communicate(timeout=30)
        return {
            w[0]: (int(w[1]), float(w[2]), float(w[3]))
            for w in (line.split() for line in out.splitlines()) if len(w) == 4
        }

    def kill(self):
        self.process.kill()
        self.process.communicate()


def junk(packets, address):
    """Sends what is no RTPS, what only looks like it, and what was just heard with damages, to each
    port that the flight's host may listen on."""
    rng = random.Random(1)
    heard = []
    sniffer = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x0800))
    sniffer.settimeout(0.2)
    end = time.monotonic() + 3.0
    while time.monotonic() < end and len(heard) < 4000:
        try:
            frame = sniffer.recv(65535)
        except socket.timeout:
            continue
        at = frame.find(b"RTPS", 14 + 20)
        if at > 0:
            heard.append(frame[at:])
    sniffer.close()
    ports = [BASE, BASE + 1] + [BASE + 10 + i for i in range(24)]
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for i in range(packets):
        kind = rng.randrange(4)
        if kind == 0 or not heard:
            packet = rng.randbytes(rng.randrange(1, 400))
        elif kind == 1:  # a right header, then submessages of any kind and length
            packet = b"RTPS\x02\x01" + bytes([1, rng.choice([1, 15, 16])]) + rng.randbytes(12)
            for _ in range(rng.randrange(1, 6)):
                body = rng.randbytes(rng.randrange(0, 60))
                size = len(body) if rng.random() < 0.6 else rng.randrange(65536)
                submessage = rng.choice([1, 6, 7, 8, 9, 0xC, 0xD, 0xE, 0xF, 0x12, 0x13, 0x15, 0x16,
                                         rng.randrange(256)])
                packet += bytes([submessage, rng.randrange(256)]) + size.to_bytes(2, "little") + body
        else:
            packet = bytearray(rng.choice(heard))
            for _ in range(rng.randrange(1, 12)):
                at = rng.randrange(len(packet))
                packet[at] = rng.choice([0, 255, 128, rng.randrange(256), packet[at] ^ 1])
            if rng.random() < 0.3:
                packet = packet[: rng.randrange(1, len(packet) + 1)]
        sender.sendto(bytes(packet), (address, rng.choice(ports)))
        if i % 50 == 49:
            time.sleep(0.01)
    print(f"{packets} packets of junk, made of {len(heard)} that were heard")


def share(counted, name):
    """Of the messages between the first and the last, by their stamps: 1 where none is missing."""
    count, seconds, _ = counted[name]
    return (count - 1) / (seconds * HERTZ[name]) if seconds > 0 else 0.0


def main():
    if sys.argv[1] == "--junk":
        junk(int(sys.argv[2]), sys.argv[3])
        return 0
    own_namespace()
    program, cyclone, fast = sys.argv[1:4]
    joins = int(sys.argv[4]) if len(sys.argv) > 4 else 12
    packets = int(sys.argv[5]) if len(sys.argv) > 5 else 4000
    for variable in list(os.environ):
        if variable.startswith(("ROS_", "CYCLONEDDS", "FASTRTPS", "RMW_")):
            del os.environ[variable]
    os.environ["ROS_DOMAIN_ID"] = str(DOMAIN)
    folder = tempfile.mkdtemp()
    network = Network(HOSTS)
    flight = None
    log = open(f"{folder}/fly.log", "w+")
    try:
        make = lambda *a: subprocess.run([program, *a], check=True, capture_output=True)
        make("map", "forest", "--size-x", "16", "--size-y", "16", "--density", "300", "-o",
             f"{folder}/f.pcd")
        make("map", "import", f"{folder}/f.pcd", "-o", f"{folder}/f.pfmap", "--resolution", "0.1")
        flight = network.on("drone", [program, "fly", f"{folder}/f.pfmap", "--ros2"], stdout=log,
                            stderr=log)
        alive = lambda: check(flight.poll() is None, f"the flight ended with {flight.returncode}")
        kinds = {"cyclone": cyclone, "fast": fast}

        # those who stay, one of each on another host, and one that is slow
        stay = [Node(network, "left", cyclone), Node(network, "right", fast)]
        slow = Node(network, "right", cyclone, "slow")
        time.sleep(3)
        alive()
        rng = random.Random(2)
        slots = [(kind, None) for kind in ("cyclone", "fast") * 2]  # and the two that stay: three
        joined = 0
        while joined < joins:
            for i, (kind, node) in enumerate(slots):
                if node is not None:
                    if rng.random() < 0.3:
                        node.kill()
                    else:
                        node.leave()
                words = ["best_effort"] if rng.random() < 0.5 else []
                host = rng.choice(list(HOSTS))
                slots[i] = (kind, Node(network, host, kinds[kind], *words))
                joined += 1
                time.sleep(rng.uniform(0.1, 0.6))
                alive()
            if joined == 2 * len(slots):
                slow.process.send_signal(signal.SIGSTOP)
            print(f"{joined} joins", flush=True)
        slow.process.send_signal(signal.SIGCONT)
        slow.kill()
        time.sleep(2)  # the last that joined get something, too
        for kind, node in slots:
            counted = node.leave()
            check(counted.get("odometry", (0,))[0] > 0, f"a {kind} node that joined got nothing")
        for node in stay:
            counted = node.leave()
            print(node.kind, "stayed:", ", ".join(
                f"{name} {HERTZ[name] * share(counted, name):.2f} Hz" for name in counted))
            for name in ("odometry", "imu", "cloud"):
                check(counted[name][0] > 20, f"{node.kind}: {name} {counted[name]}")
                # what gets lost on a busy machine is no matter of a test: `./dev ros` asks for all
                if os.environ.get("POINTFLIGHT_QUIET"):
                    check(share(counted, name) > 0.98, f"{node.kind}: {name} {counted[name]}")
        alive()

        # junk: the flight goes on, and who comes afterwards gets all
        witness = Node(network, "left", cyclone)
        other = Node(network, "left", fast)
        time.sleep(1)
        end = network.on("left", [sys.executable, sys.argv[0], "--junk", str(packets),
                                  HOSTS["drone"]]).wait(timeout=600)
        check(end == 0, "junk could not be sent")
        alive()
        witness.kill()
        other.kill()
        after = [Node(network, "left", cyclone), Node(network, "right", fast)]
        time.sleep(5)
        for node in after:
            counted = node.leave()
            print(node.kind, "after junk:", ", ".join(
                f"{name} {HERTZ[name] * share(counted, name):.2f} Hz" for name in counted))
            for name in ("odometry", "cloud"):
                check(counted[name][0] > 20, f"{node.kind} after junk: {counted}")
        alive()

        # a reader that has stopped does not hold up the end
        stopped = Node(network, "left", cyclone)
        time.sleep(2)
        stopped.process.send_signal(signal.SIGSTOP)
        time.sleep(0.5)
        began = time.monotonic()
        flight.send_signal(signal.SIGINT)
        check(flight.wait(timeout=20) == 130, f"exit code {flight.returncode}")
        print(f"ended {time.monotonic() - began:.2f} s after Ctrl-C, beside a stopped reader")
        stopped.kill()
        log.seek(0)
        said = log.read()
        check(re.search(r"end +interrupted", said), "no summary")
        print("passed")
        return 0
    except AssertionError as error:
        log.seek(0)
        print(f"failed: {error}\nthe flight said:\n{log.read()}")
        return 1
    finally:
        if flight is not None and flight.poll() is None:
            flight.kill()
        network.close()
        shutil.rmtree(folder, ignore_errors=True)


def check(condition, words):
    if not condition:
        raise AssertionError(words)


sys.exit(main())

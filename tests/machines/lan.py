"""A network of hosts whose cable this program is: loss, delay and cuts where the kernel has no netem.

Each host is a network namespace with a TAP device; a process of its own reads the frames of all and
passes them on, as a switch does, with what a link is told to lose or hold back. Root only."""
import ctypes
import fcntl
import heapq
import multiprocessing
import os
import random
import select
import struct
import subprocess
import time

TUNSETIFF = 0x400454CA
IFF_TAP, IFF_NO_PI = 0x0002, 0x1000
libc = ctypes.CDLL(None, use_errno=True)


def tap_in(pid):
    """The end of a new device eth0 in the namespace of a process. Leaves this thread there."""
    with open(f"/proc/{pid}/ns/net") as namespace:
        assert libc.setns(namespace.fileno(), 0) == 0, os.strerror(ctypes.get_errno())
    tap = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tap, TUNSETIFF, struct.pack("16sH22x", b"eth0", IFF_TAP | IFF_NO_PI))
    return tap


def damaged(frame, rng):
    """A packet of DDS with a few of its bytes changed behind the name of its sender; None for other frames."""
    payload = 14 + 4 * (frame[14] & 15) + 8
    is_udp = frame[12:14] == b"\x08\x00" and frame[23] == 17
    is_whole = struct.unpack("!H", frame[20:22])[0] & 0x3FFF == 0
    if not is_udp or not is_whole or frame[payload:payload + 4] != b"RTPS" or len(frame) < payload + 24:
        return None
    copy = bytearray(frame)
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        at = rng.randrange(payload + 20, len(copy))
        copy[at] = rng.choice([copy[at] ^ 1 << rng.randrange(8), 0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
    copy[payload - 2:payload] = b"\0\0"  # no checksum
    return bytes(copy)


def relay(pids, orders, counted):
    taps = [tap_in(pid) for pid in pids]
    orders.send("ready")
    rng = random.Random(1)
    loss, delay, group, damage = 0.0, 0.0, [0] * len(taps), 0.0
    where = {}  # host by hardware address
    held = []  # (due, number, host, frame)
    number = 0

    def put(host, frame):
        try:
            os.write(taps[host], frame)
        except OSError:
            pass  # its queue is full, or it is down: lost

    while True:
        wait = max(0.0, held[0][0] - time.monotonic()) if held else 1.0
        ready, _, _ = select.select([*taps, orders], [], [], wait)
        now = time.monotonic()
        while held and held[0][0] <= now:
            _, _, host, frame = heapq.heappop(held)
            put(host, frame)
        for file in ready:
            if file is orders:
                try:
                    loss, delay, group, damage = orders.recv()
                except EOFError:
                    return
                continue
            source = taps.index(file)
            for _ in range(64):
                try:
                    frame = os.read(file, 65536)
                except BlockingIOError:
                    break
                counted[source] += len(frame)
                where[frame[6:12]] = source
                if frame[0] & 1:
                    targets = [host for host in range(len(taps)) if host != source]
                else:
                    target = where.get(frame[0:6])
                    targets = [] if target in (None, source) else [target]
                for host in targets:
                    if group[host] != group[source] or (loss > 0.0 and rng.random() < loss):
                        continue
                    if delay > 0.0:
                        number += 1
                        heapq.heappush(held, (now + delay, number, host, frame))
                    else:
                        put(host, frame)
                    if damage > 0.0 and rng.random() < damage:
                        changed = damaged(frame, rng)
                        if changed:
                            put(host, changed)


class Lan:
    """Hosts 0, 1, ... with addresses 10.98.0.1, ..."""

    def __init__(self, hosts):
        own = os.readlink("/proc/self/ns/net")
        self.holders = [subprocess.Popen(["unshare", "--net", "sleep", "1000000"]) for _ in range(hosts)]
        for holder in self.holders:
            while os.readlink(f"/proc/{holder.pid}/ns/net") == own:
                time.sleep(0.005)
        self.counted = multiprocessing.Array("Q", hosts, lock=False)
        self.orders, theirs = multiprocessing.Pipe()
        self.cable = multiprocessing.Process(
            target=relay, args=([h.pid for h in self.holders], theirs, self.counted), daemon=True)
        self.cable.start()
        theirs.close()
        assert self.orders.recv() == "ready"
        for i, holder in enumerate(self.holders):
            subprocess.run(
                ["nsenter", "-t", str(holder.pid), "--net", "sh", "-c",
                 f"ip link set lo up && ip addr add 10.98.0.{i + 1}/24 dev eth0 && ip link set eth0 up &&"
                 " ip route add default dev eth0"], check=True)
        self.state = [0.0, 0.0, [0] * hosts, 0.0]

    def set(self, loss=None, delay=None, groups=None, damage=None):
        """Share of frames lost, s of delay each way, which hosts hear each other (a number each), and the share of
        DDS' packets that come once more, with other bytes."""
        for i, value in enumerate((loss, delay, groups, damage)):
            if value is not None:
                self.state[i] = value
        self.orders.send(tuple(self.state))

    def on(self, host, words, **options):
        pid = str(self.holders[host].pid)
        return subprocess.Popen(["nsenter", "-t", pid, "--net", *words], **options)

    def close(self):
        self.orders.close()
        self.cable.join(5)
        self.cable.kill()
        for holder in self.holders:
            holder.kill()
            holder.wait()

#!/usr/bin/env python3
"""What viewers cost a flight in real time: processor time of the program with none, one and ten of them, one of which
does not read. bench/view.py PROGRAM MAP [SECONDS]; prints shares of a core, a viewer's share, the real-time factor."""
import base64
import json
import os
import re
import socket
import struct
import subprocess
import sys
import threading
import time

PROGRAM, MAP = sys.argv[1], sys.argv[2]
SECONDS = float(sys.argv[3]) if len(sys.argv) > 3 else 20.0


class Viewer(threading.Thread):
    """Subscribes to what the page wants and reads it, or does not."""

    def __init__(self, port, reads=True):
        super().__init__(daemon=True)
        self.socket = socket.create_connection(("127.0.0.1", port))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
                             "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n").encode())
        while not self.socket.recv(4096, socket.MSG_PEEK).count(b"\r\n\r\n"):
            pass
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.socket.recv(1)
        self.reads, self.bytes, self.frames = reads, 0, 0

    def exactly(self, size):
        data = b""
        while len(data) < size:
            chunk = self.socket.recv(size - len(data))
            if not chunk:
                raise ConnectionError
            data += chunk
        return data

    def run(self):
        try:
            while True:
                first, second = self.exactly(2)
                size = second & 127
                if size == 126:
                    size = struct.unpack(">H", self.exactly(2))[0]
                elif size == 127:
                    size = struct.unpack(">Q", self.exactly(8))[0]
                data = self.exactly(size)
                self.bytes += size
                self.frames += 1
                if first & 15 == 1:
                    message = json.loads(data)
                    if message["op"] != "advertise":
                        continue
                    wanted = [c["id"] for c in message["channels"] if c["topic"].startswith("/pointflight/")]
                    text = json.dumps({"op": "subscribe",
                                       "subscriptions": [{"id": i, "channelId": i} for i in wanted]}).encode()
                    size = len(text)
                    head = bytes([0x81, 0x80 | size]) if size < 126 else b"\x81\xfe" + struct.pack(">H", size)
                    self.socket.sendall(head + b"\0\0\0\0" + text)
                    if not self.reads:
                        return
        except (ConnectionError, OSError):
            pass


def fly(viewers):
    run = subprocess.Popen([PROGRAM, "fly", MAP, "--view", "127.0.0.1:0", "--rate", "1", "--json", "--no-stay",
                            "--duration", str(SECONDS)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    watchers = []
    for line in run.stderr:
        found = re.search(r"watch it: http://127\.0\.0\.1:(\d+)/", line)
        if found:
            watchers = [Viewer(int(found[1]), i > 0 or viewers < 10) for i in range(viewers)]
            for w in watchers:
                w.start()
            break
    threading.Thread(target=run.stderr.read, daemon=True).start()
    start = time.monotonic()
    result = json.loads(run.stdout.read())
    _, _, usage = os.wait4(run.pid, 0)
    return {"cpu": usage.ru_utime + usage.ru_stime, "wall": time.monotonic() - start,
            "factor": result["real_time_factor"], "memory": usage.ru_maxrss / 1024,
            "bytes": sum(w.bytes for w in watchers)}


def main():
    print(f"{'viewers':>8} {'core':>8} {'per viewer':>11} {'rate':>6} {'memory':>9} {'sent':>10}")
    base = None
    for viewers in (0, 1, 10):
        r = fly(viewers)
        share = r["cpu"] / SECONDS
        base = share if base is None else base
        each = (share - base) / viewers if viewers else 0.0
        print(f"{viewers:>8} {100 * share:>6.1f} % {100 * each:>9.2f} % {r['factor']:>6.2f} {r['memory']:>6.0f} MB "
              f"{1e-6 * r['bytes'] / SECONDS:>5.1f} MB/s")


main()

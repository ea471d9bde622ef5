#!/usr/bin/env python3
"""What strangers may try at the port of --view, over bare sockets: twenty attacks, what came back, and that the flight
went on. Arguments: the program, a map."""
import base64
import json
import os
import re
import socket
import struct
import subprocess
import sys
import time

PROGRAM, MAP = sys.argv[1], sys.argv[2]


class Server:
    def __init__(self, *flags):
        self.run = subprocess.Popen(
            [PROGRAM, "fly", MAP, "--view", "127.0.0.1:0", "--rate", "1", *flags],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        for line in self.run.stderr:
            found = re.search(r"watch it: http://127\.0\.0\.1:(\d+)/(?:\?token=(\w+))?", line)
            if found:
                self.port, self.token = int(found[1]), found[2]
                return
        raise AssertionError("it said no address")

    def connect(self):
        s = socket.create_connection(("127.0.0.1", self.port), timeout=5)
        return s

    def host(self):
        return f"127.0.0.1:{self.port}"

    def end(self):
        self.run.send_signal(2)
        return self.run.wait(20)


def answer(s, seconds=5.0):
    """What comes until the other end closes or nothing comes any more."""
    s.settimeout(seconds)
    data = b""
    try:
        while chunk := s.recv(65536):
            data += chunk
            head, _, body = data.partition(b"\r\n\r\n")
            length = re.search(rb"Content-Length: (\d+)", head)
            if length and len(body) >= int(length[1]):
                break
    except TimeoutError:
        pass
    except ConnectionError:
        pass
    return data


def ask(server, text):
    with server.connect() as s:
        s.sendall(text if isinstance(text, bytes) else text.encode("latin1"))
        return answer(s)


def status(reply):
    return reply.split(b"\r\n")[0].decode("latin1") or "closed"


def upgrade(server, origin=None, protocol="foxglove.sdk.v1", token=None, host=None):
    s = server.connect()
    key = base64.b64encode(os.urandom(16)).decode()
    lines = [f"GET /{'?token=' + token if token else ''} HTTP/1.1", f"Host: {host or server.host()}",
             "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}",
             "Sec-WebSocket-Version: 13"]
    if protocol:
        lines.append(f"Sec-WebSocket-Protocol: {protocol}")
    if origin:
        lines.append(f"Origin: {origin}")
    s.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
    s.settimeout(5)
    head = b""
    while b"\r\n\r\n" not in head:
        chunk = s.recv(1)
        if not chunk:
            break
        head += chunk
    return s, head


def frame(payload, opcode=1, mask=True):
    size = len(payload)
    head = bytes([0x80 | opcode])
    flag = 0x80 if mask else 0
    if size < 126:
        head += bytes([flag | size])
    elif size < 65536:
        head += bytes([flag | 126]) + struct.pack(">H", size)
    else:
        head += bytes([flag | 127]) + struct.pack(">Q", size)
    if not mask:
        return head + payload
    return head + b"\0\0\0\0" + payload


def read_frame(s):
    def exactly(n):
        data = b""
        while len(data) < n:
            chunk = s.recv(n - len(data))
            if not chunk:
                raise ConnectionError("closed")
            data += chunk
        return data
    first, second = exactly(2)
    size = second & 127
    if size == 126:
        size = struct.unpack(">H", exactly(2))[0]
    elif size == 127:
        size = struct.unpack(">Q", exactly(8))[0]
    return first & 15, exactly(size)


def until_status(s):
    """The next status of level error, or how it was closed."""
    try:
        for _ in range(400):
            opcode, data = read_frame(s)
            if opcode == 8:
                return f"closed with {struct.unpack('>H', data[:2])[0] if len(data) >= 2 else 'no code'}"
            if opcode == 1:
                message = json.loads(data)
                if message["op"] == "status" and message["level"] == 2:
                    return "told: " + message["message"]
                if message["op"] == "serviceCallFailure":
                    return "failed: " + message["message"]
    except (ConnectionError, TimeoutError):
        return "closed"
    return "nothing"


def info_of(s):
    opcode, data = read_frame(s)
    assert opcode == 1
    return json.loads(data)


def get(server, path, *headers):
    return "\r\n".join([f"GET {path} HTTP/1.1", f"Host: {server.host()}", *headers, "", ""])


def main():
    server = Server()
    results = []

    def note(name, came, wanted):
        results.append((name, came))
        assert re.search(wanted, came), f"{name}: {came}; wanted {wanted}"

    for path in ("/../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd"):
        note(f"traversal {path}", status(ask(server, get(server, path))), "404|400")
    note("a host that a page pointed here", status(ask(server, "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n")), "403")
    note("no host", status(ask(server, "GET / HTTP/1.1\r\n\r\n")), "403")
    note("two hosts", status(ask(server, f"GET / HTTP/1.1\r\nHost: {server.host()}\r\nHost: evil\r\n\r\n")), "40[03]")
    note("another method", status(ask(server, get(server, "/").replace("GET", "PUT"))), "405")
    note("a body of 1 GB", status(ask(server, f"POST / HTTP/1.1\r\nHost: {server.host()}\r\nContent-Length: 1000000000\r\n\r\n")), "4(13|05)")
    note("a header of 64 KiB", status(ask(server, get(server, "/", "X: " + "x" * 65536))), "413|400|closed")
    note("noise", status(ask(server, os.urandom(4000) + b"\r\n\r\n")), "400|closed")
    note("many ranges", status(ask(server, get(server, "/map/index", "Range: bytes=0-1,4-5"))), "416")
    note("a range beyond the end", status(ask(server, get(server, "/map/index", "Range: bytes=99999999999-"))), "416")
    note("a range of 2^64", status(ask(server, get(server, "/map/index", "Range: bytes=0-18446744073709551616"))), "416")

    s, head = upgrade(server, origin="https://evil.example")
    note("a page from elsewhere", status(head), "403")
    s, head = upgrade(server, host="evil.example", origin="http://evil.example")
    note("rebinding by WebSocket", status(head), "403")
    s, head = upgrade(server, protocol="chat")
    note("another subprotocol", status(head), "400")

    order = {"op": "advertise", "channels": [{"id": 1, "topic": "/pointflight/order", "encoding": "json",
                                              "schemaName": "pointflight.Order"}]}
    s, head = upgrade(server, origin=f"http://{server.host()}")
    assert "clientPublish" not in info_of(s)["capabilities"]
    s.sendall(frame(json.dumps(order).encode()))
    note("our page without its token", until_status(s), "may watch and not command")
    s, head = upgrade(server, origin="https://app.foxglove.dev", token=server.token)
    s.sendall(frame(json.dumps(order).encode()))
    note("Foxglove's page that commands", until_status(s), "may watch and not command")
    s.sendall(frame(b"\x02" + struct.pack("<II", 1, 1) + struct.pack("<I", 3) + b"cdr", opcode=2))
    note("its call of a service", until_status(s), "may watch and not command")

    s, head = upgrade(server, origin=f"http://{server.host()}", token=server.token)
    assert "clientPublish" in info_of(s)["capabilities"]
    s.sendall(frame(b"\x81" * 10))
    note("text that is no UTF-8", until_status(s), "closed|no JSON")
    s, head = upgrade(server)
    s.sendall(frame(b"{" * 100000))
    note("nested JSON", until_status(s), "no JSON object")
    s.sendall(frame(b"\x01", opcode=2))
    note("a cut frame", until_status(s), "cut off")
    s.sendall(frame(b"\x63" * 50, opcode=2))
    note("an opcode that is none", until_status(s), "opcode 99")
    s.sendall(frame(json.dumps({"op": "subscribe", "subscriptions": [
        {"id": i, "channelId": 1} for i in range(9000)]}).encode()))
    note("9,000 subscriptions", until_status(s), "too many")
    s, head = upgrade(server)
    s.sendall(b"\x81\xff" + struct.pack(">Q", 1 << 40) + b"\0\0\0\0")
    note("a frame of 1 TB", until_status(s), "closed")
    s, head = upgrade(server)
    s.sendall(frame(b"{}", mask=False))
    note("an unmasked frame", until_status(s), "closed")

    # half-open and slow ones, held while the others work
    held = [server.connect() for _ in range(100)]
    for s in held:
        s.sendall(b"GET / HT")
    reply = ask(server, get(server, "/map/index"))
    note("a hundred half requests", status(reply), "200")
    for s in held:
        s.close()
    held = [server.connect() for _ in range(400)]
    note("400 idle connections", status(ask(server, get(server, "/map/index"))), "200")
    for s in held:
        s.close()

    flood, head = upgrade(server)
    for _ in range(4):
        flood.sendall(frame(b"[" * ((4 << 20) - 100)))
    note("16 MB of brackets", status(ask(server, get(server, "/map/index"))), "200")

    assert server.run.poll() is None, "the flight has ended"
    s, head = upgrade(server)
    assert info_of(s)["op"] == "serverInfo"
    state = None
    s.sendall(frame(json.dumps({"op": "subscribe", "subscriptions": [
        {"id": i, "channelId": i} for i in range(1, 30)]}).encode()))
    end = time.monotonic() + 10
    while state is None and time.monotonic() < end:
        opcode, data = read_frame(s)
        if opcode == 2 and data[0] == 1 and data[13:14] == b"{" and b'"vehicles"' in data and b'"doing"' in data:
            state = json.loads(data[13:])
    assert state is not None and state["t"] > 0, "the run goes on"
    assert server.end() in (0, 130)

    # where nobody may command, natives may not either
    closed = Server("--no-view-control")
    assert closed.token is None
    s, head = upgrade(closed)
    assert "clientPublish" not in info_of(s)["capabilities"]
    closed.end()
    for name, came in results:
        print(f"{name:<34} {came}")
    print(f"{len(results)} attacks; the flight went on")


main()

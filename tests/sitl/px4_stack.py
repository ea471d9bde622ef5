"""A flight controller that imitates PX4 at its simulator interface, written from MAVLink's definitions and from nothing of
the program: it decodes and encodes the messages itself, estimates attitude, position and velocity from the sensors alone,
in PX4's frames, and flies by its own loops. A wrong sign anywhere makes it crash."""
import math
import random
import socket
import struct
import time

SENSOR, GPS, TRUTH, ACTUATORS, HEARTBEAT, COMMAND = 107, 113, 115, 93, 0, 76
EXTRA = {SENSOR: 108, GPS: 124, TRUTH: 4, ACTUATORS: 47, HEARTBEAT: 50, COMMAND: 152, 132: 85, 331: 91, 330: 23}
FORMATS = {
    SENSOR: "<Q3f3f3fffffIB", GPS: "<Qiii3H3hH3BH", TRUTH: "<Q4f3fiii3hHH3h",
    132: "<I3H4B2f4fB", 331: "<Q3f4f3f3f21f21f4Bb", 330: "<Q72H2HBBffB",
}
G = 9.80665


def crc(data, value=0xFFFF):
    for byte in data:
        t = byte ^ (value & 0xFF)
        t = (t ^ (t << 4)) & 0xFF
        value = ((value >> 8) ^ (t << 8) ^ (t << 3) ^ (t >> 4)) & 0xFFFF
    return value


def frame(number, payload, sequence):
    payload = payload.rstrip(b"\0") or b"\0"
    head = struct.pack("<6B", len(payload), 0, 0, sequence & 255, 1, 1) + struct.pack("<I", number)[:3]
    return b"\xfd" + head + payload + struct.pack("<H", crc(bytes([EXTRA[number]]), crc(head + payload)))


def unpack(number, payload):
    size = struct.calcsize(FORMATS[number])
    return struct.unpack(FORMATS[number], payload.ljust(size, b"\0"))


def multiply(a, b):
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def rotate(q, v):
    w = multiply(multiply(q, (0, *v)), (q[0], -q[1], -q[2], -q[3]))
    return w[1:]


def back(q, v):
    return rotate((q[0], -q[1], -q[2], -q[3]), v)


def unit(v):
    n = math.sqrt(sum(x * x for x in v))
    return tuple(x / n for x in v)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


class Vehicle:
    """A quadrotor in an X as PX4's parameters have it."""

    def __init__(self, parameters, mass):
        self.mass, self.p = mass, parameters
        self.rotors = [tuple(parameters[f"CA_ROTOR{i}_{key}"] for key in ("PX", "PY", "KM"))
                       for i in range(int(parameters["CA_ROTOR_COUNT"]))]
        self.thrust_max = mass * G / parameters["MPC_THR_HOVER"]

    def outputs(self, thrust, torque):
        """Of a thrust (N) and of torques in PX4's units: the columns of its allocation are +-1 / sqrt(2)."""
        f = self.p["THR_MDL_FAC"]
        controls = []
        for x, y, turn in self.rotors:
            share = thrust / self.thrust_max
            for part, side in zip(torque, (-y, x, turn)):
                share += math.copysign(math.sqrt(0.5), side) * part
            share = min(max(share, 0.0), 1.0)
            # f u^2 + (1 - f) u = share
            u = share if f < 1e-6 else (-(1 - f) + math.sqrt((1 - f) ** 2 + 4 * f * share)) / (2 * f)
            controls.append(u)
        return controls

    def torque(self, error, rates):
        """By the cascade's gains; error: the turn that is left (rad), body."""
        torque = []
        for axis, e, w in zip(("ROLL", "PITCH", "YAW"), error, rates):
            torque.append(self.p[f"MC_{axis}RATE_P"] * (self.p[f"MC_{axis}_P"] * e - w))
        torque[2] = max(-0.3, min(0.3, torque[2]))
        return torque


class Stack:
    """Estimates and flies. `goal_at(time)`: north, east, height (m, from where it was switched on) and heading (rad); None:
    disarmed."""

    def __init__(self, vehicle, goal_at):
        self.vehicle, self.goal_at = vehicle, goal_at
        self.q = None
        self.bias, self.still = [0.0] * 3, 0
        self.p, self.v = [0.0] * 3, [0.0] * 3
        self.home, self.base = None, None
        self.last = None
        self.field_down = 0.0

    def on_gps(self, m):
        lat, lon, vn, ve = m[1] * 1e-7, m[2] * 1e-7, m[7] / 100, m[8] / 100
        self.home = self.home or (lat, lon)
        radius = 6371000.0
        north = math.radians(lat - self.home[0]) * radius
        east = math.radians(lon - self.home[1]) * radius * math.cos(math.radians(lat))
        for axis, (at, speed) in enumerate(((north, vn), (east, ve))):
            self.p[axis] += 0.15 * (at - self.p[axis])
            self.v[axis] += 0.3 * (speed - self.v[axis])

    def on_sensor(self, m):
        """Returns (armed, outputs)."""
        t, acc, gyro, mag = m[0] * 1e-6, m[1:4], m[4:7], m[7:10]
        dt = t - self.last if self.last is not None else 0.0
        self.last = t
        if m[14] & 0x1C0 == 0x1C0:
            self.mag = mag
        if m[14] & 0x1A00 == 0x1A00:
            height = m[12]
            self.base = height if self.base is None else self.base
            self.p[2] += 0.06 * (-(height - self.base) - self.p[2])
            self.v[2] += 0.06 * (-(height - self.base) - self.p[2])
        if self.q is None:
            if not hasattr(self, "mag"):
                return False, [0.0] * 4
            self.q = self.first_attitude(acc)
        goal = self.goal_at(t)
        if goal is None:
            self.still += 1
            self.bias = [b + (w - b) / self.still for b, w in zip(self.bias, gyro)]
            self.p, self.v = [0.0, 0.0, self.p[2]], [0.0] * 3
            if self.base is not None:
                self.base = m[12] if m[14] & 0x1A00 == 0x1A00 else self.base
                self.p[2] = 0.0
        rates = [w - b for w, b in zip(gyro, self.bias)]
        self.integrate(rates, acc, dt)
        if goal is None:
            return False, [0.0] * 4
        return True, self.control(goal, rates)

    def first_attitude(self, acc):
        """Level and heading by gravity and the field (declination left out, as the test's field has none)."""
        down = unit(tuple(-a for a in acc))
        east = unit(cross(down, self.mag))
        north = cross(east, down)
        # rows are the world's axes in the body: a matrix from body to world
        m = (north, east, down)
        w = math.sqrt(max(0.0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2
        if w < 0.1:
            raise AssertionError("starts with a heading near south: not of this test")
        return (w, (m[2][1] - m[1][2]) / (4 * w), (m[0][2] - m[2][0]) / (4 * w), (m[1][0] - m[0][1]) / (4 * w))

    def integrate(self, rates, acc, dt):
        turn = list(rates)
        size = math.sqrt(sum(a * a for a in acc))
        if abs(size - G) < 1.0:  # towards gravity
            error = cross(unit(tuple(-a for a in acc)), back(self.q, (0, 0, 1)))
            turn = [w + 0.1 * e for w, e in zip(turn, error)]
        field = rotate(self.q, self.mag)
        heading_error = -math.atan2(field[1], field[0])
        turn = [w + 0.3 * heading_error * d for w, d in zip(turn, back(self.q, (0, 0, 1)))]
        half = [0.5 * dt * w for w in turn]
        q = multiply(self.q, (1.0, *half))
        n = math.sqrt(sum(x * x for x in q))
        self.q = tuple(x / n for x in q)
        a = rotate(self.q, acc)
        for axis in range(3):
            self.p[axis] += dt * self.v[axis]
            self.v[axis] += dt * (a[axis] + (G if axis == 2 else 0.0))

    def control(self, goal, rates):
        target = (goal[0], goal[1], -goal[2])
        wanted = []
        for axis in range(3):
            speed = max(-1.5, min(1.5, 0.9 * (target[axis] - self.p[axis])))
            wanted.append(max(-3.0, min(3.0, 2.2 * (speed - self.v[axis]))))
        force = (wanted[0], wanted[1], wanted[2] - G)  # per mass, of the rotors
        up = unit(tuple(-f for f in force))          # body's down axis
        thrust = self.vehicle.mass * -sum(f * d for f, d in zip(force, rotate(self.q, (0, 0, 1))))
        heading = (math.cos(goal[3]), math.sin(goal[3]), 0.0)
        right = unit(cross(up, heading))
        front = cross(right, up)
        mine = [rotate(self.q, e) for e in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
        error = [0.0] * 3  # world: half the sum of cross products of axes as they are and as they should be
        for have, want in zip(mine, (front, right, up)):
            c = cross(have, want)
            error = [e + 0.5 * x for e, x in zip(error, c)]
        error = back(self.q, error)
        torque = self.vehicle.torque(error, rates)
        return self.vehicle.outputs(max(thrust, 0.0), torque)


class Peer:
    """Speaks PX4's side of the link. `stack` answers; None: zeros. Disturbances by `mood`: late, junk."""

    def __init__(self, port, stack=None, mood=(), seed=1):
        self.stack, self.mood = stack, mood
        self.random = random.Random(seed)
        until = time.time() + 60
        while True:
            try:
                self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
                break
            except ConnectionRefusedError:
                if time.time() > until:
                    raise
                time.sleep(0.02)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.sequence = 0
        self.buffer = b""
        self.counts, self.times, self.last = {}, [], {}
        self.sensor_bytes = []
        self.send(COMMAND, struct.pack("<7fHBBB", 115, 5000, 0, 0, 0, 0, 0, 511, 1, 1, 0))
        self.send(HEARTBEAT, struct.pack("<I5B", 0, 0, 12, 0, 0, 3))

    def send(self, number, payload):
        data = frame(number, payload, self.sequence)
        self.sequence += 1
        if "junk" in self.mood and self.random.random() < 0.3:
            data = bytes(self.random.randrange(256) for _ in range(self.random.randrange(1, 20))) + data
        try:
            self.socket.sendall(data)
        except (BrokenPipeError, ConnectionResetError):
            pass  # `messages` ends

    def messages(self):
        """Whole frames that have come; none once the link is closed."""
        while True:
            while len(self.buffer) >= 12:
                assert self.buffer[0] == 0xFD, self.buffer[:20]
                length = self.buffer[1]
                if len(self.buffer) < length + 12:
                    break
                head, payload = self.buffer[1:10], self.buffer[10:10 + length]
                number = int.from_bytes(head[6:9], "little")
                assert struct.unpack("<H", self.buffer[10 + length:12 + length])[0] == \
                    crc(bytes([EXTRA[number]]), crc(head + payload)), number
                self.raw = self.buffer[:12 + length]
                self.buffer = self.buffer[12 + length:]
                self.counts[number] = self.counts.get(number, 0) + 1
                yield number, payload
            try:
                chunk = self.socket.recv(65536)
            except ConnectionResetError:  # it was closed before our last answer was read
                return
            if not chunk:
                return
            self.buffer += chunk

    def answer(self, t, armed, outputs):
        self.send(ACTUATORS, struct.pack("<QQ16fB", t, 1, *outputs, *([0.0] * (16 - len(outputs))), 128 if armed else 0))

    def run(self, until, silent=()):
        """Answers until a time (s) of the link's clock, but not at `silent` ones (from, to)."""
        for number, payload in self.messages():
            values = unpack(number, payload)
            self.last[number] = values
            if number == GPS and self.stack:
                self.stack.on_gps(values)
            if number != SENSOR:
                continue
            self.times.append(values[0])
            self.sensor_bytes.append(payload)
            armed, outputs = self.stack.on_sensor(values) if self.stack else (False, [0.0] * 4)
            t = values[0] * 1e-6
            if t > until:
                return True
            if any(a <= t < b for a, b in silent):
                continue
            if "late" in self.mood and self.random.random() < 0.02:
                time.sleep(self.random.random() * 0.05)
            self.answer(values[0], armed, outputs)
        return False

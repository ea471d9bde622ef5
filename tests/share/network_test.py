#!/usr/bin/python3
"""A run that three hosts share over multicast: the bytes of one process, who is refused, strangers.

network_test.py PROGRAM MAP.pfmap [STRANGER]. The faults of networks are for ./dev machines."""
import filecmp
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from namespaces import Network, own_namespace  # noqa: E402

HOSTS = {"one": "10.97.0.1", "two": "10.97.0.2", "three": "10.97.0.3"}
NAMES = ["a", "b", "c"]
SCENARIO = """map: {map}
duration: {duration}
vehicles:
  - {{name: a, start: [8, 6, 12], mission: {{waypoints: [[8, 9, 12]]}}, lidars: [{{model: marsim_grid}}]}}
  - {{name: b, start: [9.5, 7, 12], mission: {{waypoints: [[9.5, 4, 12]]}}, lidars: [{{model: mid360}}]}}
  - {{name: c, start: [11, 6, 12.3], mission: {{waypoints: [[8, 7, 12]]}}, lidars: []}}
obstacles:
  - {{motion: random, count: 6, radius: 0.2, speed: 1, bounds_min: [4, 2, 10], bounds_max: [14, 14, 15]}}
share: {{time: {time}, lease: 5}}
"""


def check(condition, words):
    if not condition:
        raise AssertionError(words)


class Swarm:
    def __init__(self, network, program, pfmap, folder):
        self.network, self.program, self.pfmap, self.folder = network, program, pfmap, pathlib.Path(folder)
        self.running = []

    def scenario(self, name, duration, how):
        path = self.folder / name
        path.write_text(SCENARIO.format(map=self.pfmap, duration=duration, time=how))
        return path

    def fly(self, host, scenario, output, run, vehicles, *flags):
        log = self.folder / f"{output}.log"
        with log.open("w") as stderr:
            process = self.network.on(host, [self.program, "fly", str(scenario), "-o", str(self.folder / output),
                                             "--share", run, "--vehicles", vehicles, "--no-picture", *flags],
                                      stdout=subprocess.DEVNULL, stderr=stderr)
        process.log = log
        self.running.append(process)
        return process

    def wait_for(self, process, words):
        """Until it has said so; for a hang, not for a slow machine."""
        until = time.monotonic() + 120
        while words not in process.log.read_text():
            check(process.poll() is None and time.monotonic() < until,
                  f"never said '{words}': {process.log.read_text()[-2000:]}")
            time.sleep(0.02)

    def end(self, process, codes=(0, 1)):
        try:
            process.wait(timeout=120)
        except subprocess.TimeoutExpired:
            process.kill()
            raise AssertionError("hangs: " + process.log.read_text()[-2000:])
        said = process.log.read_text()
        check(process.returncode in codes, f"exit {process.returncode}: {said}")
        return said

    def lockstep(self, stranger):
        scenario = self.scenario("lockstep.yaml", 1.5, "lockstep")
        alone = subprocess.run([self.program, "fly", str(scenario), "-o", str(self.folder / "one"), "--no-picture",
                                "--record", str(self.folder / "one.mcap")], capture_output=True, text=True)
        check(alone.returncode in (0, 1), alone.stderr)
        noise = None
        if stranger:
            noise = self.network.on("three", [stranger, "50", "steps", "60", "1"])
            self.running.append(noise)
            time.sleep(1)
        # any order, any host, two vehicles or one
        c = self.fly("one", scenario, "c", "steps", "c", "--record", str(self.folder / "c.mcap"))
        time.sleep(0.3)
        ab = self.fly("two", scenario, "ab", "steps", "0-1", "--record", str(self.folder / "ab.mcap"))
        said = self.end(c) + self.end(ab)
        if noise:
            noise.kill()
            noise.wait()
            check(2 <= said.count("somebody sends") <= 10, "strangers are said once each: " + said)
        files = 0
        for name in NAMES:
            there = self.folder / ("c" if name == "c" else "ab") / name
            for file in sorted((self.folder / "one" / name).rglob("*")):
                if file.is_file():
                    files += 1
                    same = filecmp.cmp(file, there / file.relative_to(self.folder / "one" / name), shallow=False)
                    check(same, f"{file} is another")
        check(not (self.folder / "ab" / "c").exists(), "a vehicle of another process was written")
        # what ROS gets: the topics of one process, each from who flies the vehicle
        topics = [self.topics(name) for name in ("one", "ab", "c")]
        together = {**topics[1], **topics[2]}
        shared = set(topics[1]) & set(topics[2])
        check(set(together) == set(topics[0]), f"topics: {sorted(set(together) ^ set(topics[0]))}")
        check(shared <= {"/tf", "/tf_static", "/collisions", "/diagnostics"}, f"twice: {shared}")
        for topic, messages in topics[0].items():
            if topic not in shared:
                check(together[topic] == messages, f"{topic}: {together[topic]} messages, alone {messages}")
        print(f"lockstep: {files} files of three vehicles as of one process, {len(topics[0])} topics, "
              f"{sorted(shared)} from both")

    def topics(self, name):
        info = subprocess.run([self.program, "bag", "info", str(self.folder / f"{name}.mcap"), "--json"],
                              capture_output=True, text=True, check=True)
        return {topic["name"]: topic["messages"] for topic in json.loads(info.stdout)["topics"]}

    def free(self):
        scenario = self.scenario("free.yaml", 600, "free")  # nobody ends by itself
        a = self.fly("one", scenario, "fa", "free", "a")
        self.wait_for(a, "hears nobody else")
        time.sleep(1.5)  # so that who comes now comes late
        thief = self.fly("two", scenario, "thief", "free", "a,b")
        said = self.end(thief, (2,))
        check("flies a (vehicle 0) too" in said and not (self.folder / "thief").exists(), said)
        world = self.fly("three", scenario, "world", "free", "b", "--seed", "5")
        check("another seed (1 there, 5 here)" in self.end(world, (2,)), "another seed flies")
        other = self.scenario("lease.yaml", 600, "free")
        other.write_text(other.read_text().replace("lease: 5", "lease: 1"))
        lease = self.fly("three", other, "lease", "free", "b")
        check("another scenario" in self.end(lease, (2,)), "another lease flies")
        b = self.fly("two", scenario, "fb", "free", "b")
        c = self.fly("three", scenario, "fc", "free", "c")
        for process in (a, c):
            self.wait_for(process, "flies b")
        for process in (a, b):
            self.wait_for(process, "flies c")
        self.wait_for(c, "flying")
        c.send_signal(signal.SIGINT)
        self.end(c, (130,))
        for process in (a, b):
            self.wait_for(process, "has left")
            process.send_signal(signal.SIGINT)
            self.end(process, (130,))
        summary = json.loads((self.folder / "fa" / "summary.json").read_text())
        others = {other["name"]: other for other in summary["others"]}
        check(set(others) == {"b", "c"} and others["b"]["losses"] == 0, f"{others}")
        check([v["name"] for v in summary["vehicles"]] == ["a"], "others' vehicles in the summary")
        late = json.loads((self.folder / "fb" / "summary.json").read_text())
        check(late["skipped_time"] > 1.0, "who came late began at zero")
        # what a process leaves can be looked at
        subprocess.run([self.program, "picture", str(self.folder / "fb"), "-o", str(self.folder / "b.png")], check=True,
                       capture_output=True)
        print("free: a late joiner, a leaver, a second a and another seed refused")


def main():
    own_namespace()
    program, pfmap = (os.path.abspath(path) for path in sys.argv[1:3])
    stranger = sys.argv[3] if len(sys.argv) > 3 else None
    for variable in list(os.environ):
        if variable.startswith(("ROS_", "CYCLONEDDS", "POINTFLIGHT_DOMAIN")):
            del os.environ[variable]
    folder = tempfile.mkdtemp(prefix="pointflight_share_")
    network = Network(HOSTS)
    swarm = Swarm(network, program, pfmap, folder)
    try:
        swarm.lockstep(stranger)
        swarm.free()
        print("passed")
        return 0
    except AssertionError as error:
        print(f"failed: {error}")
        return 1
    finally:
        for process in swarm.running:
            if process.poll() is None:
                process.kill()
                process.wait()
        network.close()
        shutil.rmtree(folder, ignore_errors=True)


sys.exit(main())

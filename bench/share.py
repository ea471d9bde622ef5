#!/usr/bin/python3
"""What vehicles of another process cost: one process with and without eight of them, in turn.

share.py PROGRAM MAP.pfmap [PAIRS [SECONDS]]: processor time of a process in real time that flies one
vehicle (a Mid-360 on it), the median of differences; what a host with one vehicle and one with eight
put on the cable (all of it: Ethernet, discovery, clocks)."""
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "tests"))
from namespaces import Network, own_namespace  # noqa: E402

own_namespace()
program, pfmap = (os.path.abspath(path) for path in sys.argv[1:3])
pairs = int(sys.argv[3]) if len(sys.argv) > 3 else 5
seconds = int(sys.argv[4]) if len(sys.argv) > 4 else 12
work = pathlib.Path(tempfile.mkdtemp(prefix="pointflight_bench_share_"))
scenario = work / "s.yaml"
vehicles = "\n".join(
    f"  - {{start: [{8 + 3 * (i % 3)}, {6 + 3 * (i // 3)}, {24 + 0.3 * i}], lidars: {'[{model: mid360}]' if i == 0 else '[]'}}}"
    for i in range(9))
scenario.write_text(f"map: {pfmap}\nduration: {seconds}\nvehicles:\n{vehicles}\noutput: {{scans: false}}\n")
network = Network({"one": "10.96.0.1", "eight": "10.96.0.2"})


def sent(host):
    table = network.on(host, ["cat", "/proc/net/dev"], stdout=subprocess.PIPE, text=True).communicate()[0]
    return int(next(line for line in table.splitlines() if "eth0" in line).split(":")[1].split()[8])


def fly(host, which):
    return network.on(host, [program, "fly", str(scenario), "-o", str(work / which), "--force", "--no-picture",
                             "--share", "bench", "--vehicles", which], stdout=subprocess.DEVNULL,
                      stderr=subprocess.DEVNULL)


def cost(with_others):
    """Processor seconds of the process with one vehicle; kB/s of both hosts."""
    others = fly("eight", "1-8") if with_others else None
    before, began = [sent(host) for host in ("one", "eight")], time.monotonic()
    own = fly("one", "0")
    _, status, usage = os.wait4(own.pid, 0)
    assert os.waitstatus_to_exitcode(status) in (0, 1), "the process with one vehicle did not fly"
    passed = time.monotonic() - began
    rates = [1e-3 * (sent(host) - b) / passed for host, b in zip(("one", "eight"), before)]
    if others:
        assert others.wait() in (0, 1), "the process with eight did not fly"
    return usage.ru_utime + usage.ru_stime, rates


differences = []
try:
    for _ in range(pairs):
        alone, _ = cost(False)
        together, rates = cost(True)
        differences.append((together - alone) / seconds / 8)
        print(f"alone {alone:.2f} s of processor time in {seconds} s, with eight of another process {together:.2f} s: "
              f"{100 * differences[-1]:.2f} % of a core per vehicle; {rates[0]:.1f} kB/s from the host with one vehicle, "
              f"{rates[1] / 8:.1f} kB/s per vehicle from that with eight", flush=True)
    print(f"median: {100 * statistics.median(differences):.2f} % of a core per vehicle")
finally:
    network.close()
    shutil.rmtree(work, ignore_errors=True)

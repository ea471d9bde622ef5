"""Hosts on one switch, each a network namespace (an MTU of 1500, multicast as everywhere). As root, or
as a user where users may have namespaces."""
import os
import shutil
import subprocess
import sys
import time

SKIPPED = 77


def sh(command):
    subprocess.run(command, shell=True, check=True)


def own_namespace():
    """Goes on in a network of its own; as a user's root where this one is none."""
    if os.environ.get("POINTFLIGHT_OWN_NETWORK"):
        return
    for tool in ("unshare", "nsenter", "ip"):
        if not shutil.which(tool, path="/usr/sbin:/sbin:" + os.environ["PATH"]):
            print(f"skipped: no {tool} here")
            sys.exit(SKIPPED)
    flags = ["--net"] if os.getuid() == 0 else ["--user", "--map-root-user", "--net"]
    if subprocess.run(["unshare", *flags, "true"], stderr=subprocess.DEVNULL).returncode != 0:
        print("skipped: no network namespaces here")
        sys.exit(SKIPPED)
    os.environ["POINTFLIGHT_OWN_NETWORK"] = "1"
    os.execvp("unshare", ["unshare", *flags, sys.executable, *sys.argv])


class Network:
    """`hosts`: address by name."""

    def __init__(self, hosts):
        os.environ["PATH"] += ":/usr/sbin:/sbin"
        self.holders = {}
        sh("ip link add switch type bridge && ip link set switch up")
        for i, (name, address) in enumerate(hosts.items()):
            holder = subprocess.Popen(["unshare", "--net", "sleep", "1000000"])
            own = os.readlink("/proc/self/ns/net")
            while os.readlink(f"/proc/{holder.pid}/ns/net") == own:
                time.sleep(0.01)
            self.holders[name] = holder
            sh(f"ip link add port{i} type veth peer name eth0 netns {holder.pid}")
            sh(f"ip link set port{i} master switch up")
            sh(f"nsenter -t {holder.pid} --net sh -c 'ip link set lo up; ip addr add {address}/24"
               " dev eth0; ip link set eth0 up; ip route add default dev eth0'")

    def on(self, host, command, **arguments):
        pid = str(self.holders[host].pid)
        return subprocess.Popen(["nsenter", "-t", pid, "--net", *command], **arguments)

    def close(self):
        for holder in self.holders.values():
            holder.kill()
            holder.wait()

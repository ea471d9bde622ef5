"""What each shipped LiDAR costs as it is shipped, with everything on.

    ./dev bench defaults [NAME=MAP.pfmap@X,Y,Z ...] [--sensors os1_128,...] [--into docs/performance.md]

Flies each sensor of `lidar list` for two simulated seconds in each map, hovering at X,Y,Z: physics, odometry,
IMU, scans with noise, written as PCD. On one thread and on two; once more with beams as lines. Without maps: in the
demo's forest. Prints a Markdown table; with --into it replaces the one in a file. Times are
processor time per simulated second ("cores") but for the real-time factors, which are wall clock:
those want a machine on which nothing else runs.
"""

import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

from tables import put_into

SECONDS = 2


def program(path, *words):
    done = subprocess.run([path, *words], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(f"defaults: {' '.join(words)}: {done.stderr.strip()}")
    return done.stdout


def forest(path, folder):
    cloud, pfmap = folder / "forest.pcd", folder / "forest.pfmap"
    program(path, "map", "forest", "--trees", "1000", "-o", str(cloud))
    program(path, "map", "import", str(cloud), "-o", str(pfmap))
    return f"forest={pfmap}@12,10,2.5"


def fly(path, folder, pfmap, at, sensor, *words):
    """The end of a flight's --json."""
    scenario = folder / "s.yaml"
    scenario.write_text(
        f"map: {pfmap}\nduration: {SECONDS}\nlidars: [{{model: {sensor}}}]\n"
        f"vehicle: {{start: [{at}]}}\n"
    )
    words = ("fly", str(scenario), "-o", str(folder / "run"), "--force", "--no-picture", "--json", *words)
    return json.loads(program(path, *words))


def row(path, folder, pfmap, at, sensor):
    """Real-time factor on one thread and on two, cores in all, for rendering, with beams as lines."""
    alone = fly(path, folder, pfmap, at, sensor, "--threads", "1")
    two = fly(path, folder, pfmap, at, sensor, "--threads", "2")
    line = fly(path, folder, pfmap, at, sensor, "--threads", "1", "--fidelity", "line")
    return (
        alone["real_time_factor"],
        two["real_time_factor"],
        alone["cost"]["cores"],
        alone["cost"]["lidars"][0]["rendering"],
        line["cost"]["cores"],
        line["cost"]["lidars"][0]["rendering"],
    )


def table(path, maps, sensors, folder):
    lines = [
        "| sensor | " + " | ".join(f"{name}: 1, 2 threads | cores: all, rendering | as lines" for name, _, _ in maps) + " |",
        "| --- |" + " --- | --- | --- |" * len(maps),
    ]
    for sensor in sensors:
        cells = []
        for _, pfmap, at in maps:
            one, two, cores, rendering, line, line_rendering = row(path, folder, pfmap, at, sensor)
            cells.append(f"{one:.2f}, {two:.2f} | {cores:.2f}, {rendering:.2f} | {line:.2f}, {line_rendering:.2f}")
        lines.append(f"| `{sensor}` | " + " | ".join(cells) + " |")
        print(lines[-1], file=sys.stderr, flush=True)
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description="What each shipped LiDAR costs")
    parser.add_argument("program")
    parser.add_argument("maps", nargs="*", help="NAME=MAP.pfmap@X,Y,Z")
    parser.add_argument("--sensors", default="")
    parser.add_argument("--into", default="")
    flags = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        maps = []
        for word in flags.maps or [forest(flags.program, folder)]:
            match = re.fullmatch(r"([^=]+)=(.+)@([-0-9.,e]+)", word)
            if not match:
                sys.exit(f"defaults: '{word}'; give NAME=MAP.pfmap@X,Y,Z")
            pfmap = pathlib.Path(match[2]).resolve()
            if not pfmap.is_file():
                sys.exit(f"defaults: {match[2]}: there is no such map; import one first")
            maps.append((match[1], pfmap, match[3]))
        listed = json.loads(program(flags.program, "lidar", "list", "--json"))
        sensors = flags.sensors.split(",") if flags.sensors else [sensor["name"] for sensor in listed]
        text = table(flags.program, maps, sensors, folder)
    print(text)
    if flags.into:
        put_into(flags.into, "defaults", text)


if __name__ == "__main__":
    main()

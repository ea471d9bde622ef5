"""The MARSIM paper's evaluation of its ten maps (figures 10 and 11, table II) in our worlds.

    ./dev bench worlds [NAME ...] [--all] [--resolutions 0.2,0.05] [--into docs/validation.md] [--png FILE]

Makes the map of each world (`world make`), draws ten positions and yaws in its free space, and renders one frame of a
Livox Avia (385 x 350 pixels over 77 x 70 degrees, 30 m) from each by `beam`, by `beam` without the surfels' opacities (which
`paper` has none of either) and by `paper`, in turns in one process, the least of five times counting: processor time on one thread, wall clock on two. Memory is the most that a process of its
own had that opens the map and renders these frames. Prints a Markdown table; --into puts it into a file between its
marks; --png draws it (python3-matplotlib). Without names: the ten that are named as the paper's are; --all: all.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from tables import put_into

PAPER = (
    "historical_building large_office indoor_2 common_forest simple_garage "
    "simple_forest indoor_1 complex_garage dense_forest indoor_3"
).split()
FRAME_MS = 100.0  # 10 Hz


def run(*words):
    """Standard output, wall seconds and the most memory (MB) of a program."""
    start = time.monotonic()
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen(words, stdout=out, stderr=subprocess.PIPE)
        fault = process.stderr.read().decode()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            sys.exit(f"worlds: {' '.join(words)}: {fault.strip()}")
        out.seek(0)
        return out.read().decode(), time.monotonic() - start, usage.ru_maxrss / 1024


def measured(program, bench, name, resolution, folder):
    pfmap = folder / "world.pfmap"
    words = ("world", "make", name, "-o", pfmap, "--resolution", str(resolution), "--force")
    _, seconds, megabytes = run(program, *map(str, words))
    times = json.loads(run(bench, str(pfmap), "--world", name)[0])
    poses = folder / "poses.json"
    poses.write_text(json.dumps({"poses": times["poses"]}))
    row = {"world": name, "resolution": resolution, "surfels": times["surfels"]}
    row |= {"make_s": seconds, "make_mb": megabytes, "map_mb": pfmap.stat().st_size / 2**20}
    for frame in times["frames"]:
        row[f"{frame['renderer']}_{frame['threads']}"] = frame
    for renderer in ("beam", "paper"):
        alone = (str(pfmap), "--poses", str(poses), "--renderers", renderer, "--one-thread", "--repeats", "1")
        row[f"{renderer}_mb"] = json.loads(run(bench, *alone)[0])["peak_mb"]
    return row


def line(row):
    beam, beam2, opaque, paper, paper2 = (row[key] for key in ("beam_1", "beam_2", "opaque_1", "paper_1", "paper_2"))
    worst = max(beam["most_ms"], beam2["most_ms"], paper["most_ms"], paper2["most_ms"])
    return (
        f"| {row['world']} | {row['resolution']} | {row['surfels'] / 1e6:.2f} | {row['make_s']:.0f}, {row['make_mb']:.0f} "
        f"| {beam['mean_ms']:.1f} ({beam['most_ms']:.1f}) | {opaque['mean_ms']:.1f} | {paper['mean_ms']:.1f} ({paper['most_ms']:.1f}) "
        f"| {paper['mean_ms'] / opaque['mean_ms']:.2f} | {beam2['mean_ms']:.1f}, {paper2['mean_ms']:.1f} "
        f"| {row['beam_mb']:.0f}, {row['paper_mb']:.0f} | {'yes' if worst < FRAME_MS else 'no'} |"
    )


HEAD = (
    "| world | r, m | surfels, M | made: s, MB | `beam`, ms (most) | opaque | `paper`, ms (most) | paper : opaque "
    "| 2 threads: beam, paper, ms | memory: beam, paper, MB | 10 Hz |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def draw(rows, file):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(row["world"] for row in rows))
    bars = [(res, renderer) for res in sorted({row["resolution"] for row in rows}, reverse=True) for renderer in ("beam", "paper")]
    colors = ("#86bbe0", "#f2b880", "#1f6fa8", "#c9650a")
    figure, axes = plt.subplots(figsize=(9.0, 3.6), dpi=110)
    width = 0.8 / len(bars)
    for i, (resolution, renderer) in enumerate(bars):
        of = {row["world"]: row[f"{renderer}_1"]["mean_ms"] for row in rows if row["resolution"] == resolution}
        at = [k - 0.4 + (i + 0.5) * width for k in range(len(names))]
        axes.bar(at, [of[name] for name in names], width, color=colors[i % 4], label=f"{renderer}, {resolution} m")
    axes.set_xticks(range(len(names)), [name.replace("_", "\n") for name in names], fontsize=8)
    axes.set_ylabel("ms a frame, one thread")
    axes.axhline(FRAME_MS, color="#999999", linewidth=0.8, linestyle="--")
    axes.text(len(names) - 0.5, FRAME_MS, "10 Hz ", ha="right", va="bottom", fontsize=8, color="#666666")
    axes.legend(frameon=False, fontsize=8, ncols=2, loc="upper left", bbox_to_anchor=(0.0, 0.95))
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.tight_layout()
    figure.savefig(file)


def main():
    parser = argparse.ArgumentParser(description="The paper's evaluation of its ten maps, in our worlds")
    parser.add_argument("program")
    parser.add_argument("bench")
    parser.add_argument("worlds", nargs="*")
    parser.add_argument("--all", action="store_true", help="All worlds, not the paper's ten")
    parser.add_argument("--resolutions", default="0.2,0.05", help="m")
    parser.add_argument("--into", default="")
    parser.add_argument("--png", default="")
    flags = parser.parse_args()
    listed = [world["name"] for world in json.loads(run(flags.program, "world", "list", "--json")[0])]
    names = flags.worlds or (listed if flags.all else PAPER)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for resolution in map(float, flags.resolutions.split(",")):
            for name in names:
                rows.append(measured(flags.program, flags.bench, name, resolution, pathlib.Path(folder)))
                print(line(rows[-1]), file=sys.stderr, flush=True)
    text = "\n".join([HEAD] + [line(row) for row in rows])
    print(text)
    if flags.into:
        put_into(flags.into, "worlds", text)
    if flags.png:
        draw(rows, flags.png)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Tables and pictures of docs/performance.md from the benchmarks' JSON.

    ./dev bench render --resolution 0.2,0.05,0.02 --patterns avia_grid,... --json > render.json
    ./dev bench scale MAP.. --json > scale.json
    tools/performance_report.py render.json scale.json docs/images

The tables go to standard output; the pictures need python3-matplotlib.
"""
import json
import sys


def scan_ms(case, name):
    for result in case["results"]:
        if result["name"] == name:
            return result["scan_ms"]
    return float("nan")


def render_table(cases):
    print("| scene, r, pattern (beams) | beam | single | embree1 | embree8 | paper | beam : embree8 "
          "| single : embree1 | beam : paper | beam, 2 threads | p50, p99 of beam |")
    print("| --- |" + " --- |" * 10)
    for case in cases:
        ratios = case["ratios"]
        beam = next(r for r in case["results"] if r["name"] == "beam")
        cells = [f"{case['scene']} {case['resolution']:g} m, {case['pattern']} ({case['beams']})"]
        cells += [f"{scan_ms(case, name):.1f}"
                  for name in ("beam", "single", "embree1", "embree8", "paper")]
        cells += [f"{ratios[name]:.2f}" for name in
                  ("beam_to_embree8", "single_to_embree1", "beam_to_paper", "beam_2_threads")]
        cells.append(f"{beam['scan_ms_p50']:.1f}, {beam['scan_ms_p99']:.1f}")
        print("| " + " | ".join(cells) + " |")


def scale_table(rows):
    print("| map: surfels, bytes each | open, ms: cold, warm | first scan, ms: cold, warm "
          "| scan, one thread, ms: p50, p99 | 1 process: resident, its own, MB "
          "| 10 processes: each with shared pages divided, its own, MB |")
    print("| --- |" + " --- |" * 5)
    for row in rows:
        one, ten = row["memory"]
        times = row["scan_ms_one_thread"]
        print(f"| {1e-6 * row['surfels']:.1f} M, {row['bytes_per_surfel']:.1f} "
              f"| {row['cold']['open_ms']:.2f}, {row['warm']['open_ms']:.3f} "
              f"| {row['cold']['first_scan_ms']:.0f}, {row['warm']['first_scan_ms']:.1f} "
              f"| {times['p50']:.1f}, {times['p99']:.1f} "
              f"| {one['resident_mb']:.0f}, {one['own_mb']:.1f} "
              f"| {ten['proportional_mb']:.0f}, {ten['own_mb']:.1f} |")


def draw_render(cases, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    names = ["beam", "single", "embree1", "embree8", "paper"]
    patterns = list(dict.fromkeys(case["pattern"] for case in cases))
    scenes = list(dict.fromkeys((case["scene"], case["resolution"]) for case in cases))
    figure, axes = pyplot.subplots(len(patterns), 1, figsize=(9, 2.3 * len(patterns)),
                                   layout="constrained", sharex=True)
    for axis, pattern in zip(axes, patterns):
        for k, name in enumerate(names):
            rates = []
            for scene, resolution in scenes:
                case = next(c for c in cases if (c["scene"], c["resolution"], c["pattern"])
                            == (scene, resolution, pattern))
                rates.append(case["beams"] / scan_ms(case, name) * 1e-3)
            axis.bar([i + 0.16 * (k - 2) for i in range(len(scenes))], rates, 0.15, label=name)
        axis.set_ylabel("million beams / s")
        axis.set_title(pattern, loc="left", fontsize=10)
        axis.set_xticks(range(len(scenes)), [f"{s} {r:g} m" for s, r in scenes])
        axis.grid(axis="y", linewidth=0.3)
    axes[0].legend(ncols=5, fontsize=8, loc="lower center", bbox_to_anchor=(0.6, 1.0))
    figure.savefig(path, dpi=100)


def draw_scale(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    rows = sorted(rows, key=lambda row: row["surfels"])
    surfels = [row["surfels"] for row in rows]
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    left.loglog(surfels, [row["cold"]["first_scan_ms"] for row in rows], "o-",
                label="first scan, cold, 2 threads")
    left.loglog(surfels, [row["scan_ms_one_thread"]["p50"] for row in rows], "o-",
                label="scan, warm, 1 thread")
    left.loglog(surfels, [row["cold"]["open_ms"] for row in rows], "o-", label="open, cold")
    left.set_ylabel("ms")
    right.loglog(surfels, [row["memory"][0]["resident_mb"] for row in rows], "o-",
                 label="one process, resident")
    right.loglog(surfels, [row["memory"][1]["proportional_mb"] for row in rows], "o-",
                 label="each of ten, shared pages divided")
    right.loglog(surfels, [row["memory"][1]["own_mb"] for row in rows], "o-",
                 label="each of ten, its own")
    right.set_ylabel("MB")
    for axis in (left, right):
        axis.set_xlabel("surfels")
        axis.grid(linewidth=0.3)
        axis.legend(fontsize=8)
    figure.savefig(path, dpi=100)


def main():
    render = json.load(open(sys.argv[1], encoding="utf-8"))["cases"]
    scale = json.load(open(sys.argv[2], encoding="utf-8"))
    render_table(render)
    print()
    scale_table(scale)
    if len(sys.argv) > 3:
        draw_render(render, sys.argv[3] + "/render_speed.png")
        draw_scale(scale, sys.argv[3] + "/map_scale.png")


main()

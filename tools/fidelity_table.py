#!/usr/bin/env python3
"""Markdown tables of docs/fidelity.md from `pointflight fidelity ... --json` on standard input."""
import json
import sys


def percent(part, key):
    return f"{100 * part[key + '_fraction']:.2f}"


def main():
    cases = json.load(sys.stdin)["cases"]
    print("| scene, r, noise | renderer | interior early / leak / false % "
          "| silhouette early / leak / false % | median, p95 mm |")
    print("| --- | --- | --- | --- | --- |")
    for case in cases:
        cells = [f"{case['scene']} {case['resolution']:g}"
                 + (f", {1e3 * case['noise']:g} mm" if case["noise"] else ""),
                 case["renderer"]]
        for kind in ("interior", "silhouette"):
            part = case[kind]
            cells.append(" / ".join(percent(part, key) for key in ("early", "leak", "false")))
        every = case["all"]
        cells.append(f"{1e3 * every['median_abs_error']:.1f}, {1e3 * every['p95_abs_error']:.1f}")
        print("| " + " | ".join(cells) + " |")


main()

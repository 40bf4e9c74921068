#!/usr/bin/env python3
"""Tables and a plot of the fits that `cargo test --release -p biscale-fit --test coverage -- --ignored` has written.

usage: scripts/coverage.py FOLDER... [--plot FILE.svg]

A FOLDER is `OUT/seed-SEED` of that test.

Each FOLDER has fits.csv and numbers.csv. Tables are Markdown, for docs/fit.md.
"""

import argparse
import csv
import math
from collections import defaultdict
from pathlib import Path

CONFIDENT = 4.0


def read(folders):
    """Fits by number, each with its rows of numbers."""
    fits = {}
    for folder in folders:
        with open(folder / "fits.csv", newline="") as file:
            for row in csv.DictReader(file):
                fits[folder, int(row["fit"])] = dict(row, numbers=[])
        with open(folder / "numbers.csv", newline="") as file:
            for row in csv.DictReader(file):
                if (folder, int(row["fit"])) in fits:
                    if not float(row["sigma"]) > 0:
                        raise SystemExit(f"{folder}/numbers.csv: fit {row['fit']}: sigma of {row['name']} is {row['sigma']}")
                    z = (float(row["value"]) - float(row["truth"])) / float(row["sigma"])
                    fits[folder, int(row["fit"])]["numbers"].append((row["name"], z, row["flagged"] == "1"))
    return list(fits.values())


def unflagged(fits):
    return [abs(z) for fit in fits for _, z, flagged in fit["numbers"] if not flagged]


def share(values, limit):
    return f"{100 * sum(v <= limit for v in values) / len(values):.0f} %" if values else "-"


def kind(name):
    """What sort of number this is."""
    if name.startswith("geometry"):
        return "lengths and angles"
    if "specular" in name or "alpha" in name:
        return "gloss"
    return "diffuse colours"


def table(head, rows):
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print()


def coverage_row(name, fits):
    passed = [fit for fit in fits if fit["verdict"] == "pass"]
    values = unflagged(passed)
    worst = f"{max(values):.1f}" if values else "-"
    over = sum(not float(fit["worst"]) <= CONFIDENT for fit in passed)
    return [name, len(fits), len(passed), len(values), share(values, 1), share(values, 2), worst, over]


def coverage_tables(fits):
    head = ["fault", "fits", "pass", "numbers of these", "within 1", "within 2", "farthest", f"fits over {CONFIDENT:.0f}"]
    groups = defaultdict(list)
    for fit in fits:
        groups[fit["fault"]].append(fit)
    table(head, [coverage_row(name, groups[name]) for name in groups] + [coverage_row("**all**", fits)])
    surfaces = defaultdict(list)
    for fit in fits:
        surfaces[fit["surface"]].append(fit)
    table(["surface"] + head[1:], [coverage_row(name, surfaces[name]) for name in surfaces])
    sorts = defaultdict(list)
    for fit in fits:
        if fit["verdict"] == "pass":
            for name, z, flagged in fit["numbers"]:
                sorts[kind(name)].append((abs(z), flagged))
    rows = []
    for name, values in sorts.items():
        told = [z for z, flagged in values if not flagged]
        rows.append([name, len(values), len(values) - len(told), share(told, 1), share(told, 2), share(told, 3)])
    table(["numbers of fits that pass", "all", "flagged", "within 1", "within 2", "within 3"], rows)


def cause_table(fits):
    """How often a failure names the fault that was made, first or at all."""
    groups = defaultdict(list)
    for fit in fits:
        if fit["verdict"] == "fail" and fit["has_cause"] == "1":
            groups[fit["fault"]].append(int(fit["cause_place"]))
    rows = [[name, len(p), sum(v == 0 for v in p), sum(v >= 0 for v in p)] for name, p in groups.items()]
    total = [place for places in groups.values() for place in places]
    rows.append(["**all**", len(total), sum(v == 0 for v in total), sum(v >= 0 for v in total)])
    table(["fault", "failures", "named first", "named"], rows)


def plot(fits, file):
    """Share of numbers within k standard deviations against that of a normal distribution."""
    values = sorted(unflagged([fit for fit in fits if fit["verdict"] == "pass"]))
    width, height, left, top = 520, 320, 56, 16
    x = lambda k: left + k / 4 * (width - left - 16)
    y = lambda p: top + (1 - p) * (height - top - 48)
    observed = [(0, 0)] + [(v, (i + 1) / len(values)) for i, v in enumerate(values) if v <= 4]
    normal = [(k / 50, math.erf(k / 50 / math.sqrt(2))) for k in range(201)]
    line = lambda points: " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in points)
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
             f'<rect width="{width}" height="{height}" fill="#fff"/>']
    for k in range(5):
        parts.append(f'<path d="M{x(k):.1f} {y(0):.1f}V{y(1):.1f}" stroke="#ddd"/><text x="{x(k):.1f}" y="{y(0) + 16:.1f}" text-anchor="middle">{k}</text>')
    for p in (0, 0.25, 0.5, 0.683, 0.954):
        parts.append(f'<path d="M{x(0):.1f} {y(p):.1f}H{x(4):.1f}" stroke="#ddd"/><text x="{x(0) - 6:.1f}" y="{y(p) + 4:.1f}" text-anchor="end">{100 * p:.0f} %</text>')
    parts += [f'<polyline points="{line(normal)}" fill="none" stroke="#888" stroke-dasharray="5 4"/>',
              f'<polyline points="{line(observed)}" fill="none" stroke="#0a58a8" stroke-width="2"/>',
              f'<text x="{x(2):.1f}" y="{height - 8}" text-anchor="middle">distance from the truth, standard deviations</text>',
              f'<text x="{x(2.1):.1f}" y="{y(0.62):.1f}" fill="#0a58a8">{len(values)} numbers of fits that pass</text>',
              f'<text x="{x(2.1):.1f}" y="{y(0.54):.1f}" fill="#666">normal distribution (dashed)</text>', "</svg>"]
    file.write_text("\n".join(parts) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--plot", type=Path)
    arguments = parser.parse_args()
    fits = read(arguments.folders)
    coverage_tables(fits)
    cause_table(fits)
    if arguments.plot:
        plot(fits, arguments.plot)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""The tables of docs/performance.md: one interleaved run on this machine, medians, with the machine's load beside them.

Builds the benchmarks and the command in release mode, then runs all measurements one after another, and that several times over:
a burst of other work then falls on some rounds of all tables and not on all rounds of one. Cells are medians over the rounds.

usage: scripts/performance.py [--rounds N] [--against FOLDER] [--write] [NAME...]
       --rounds N         rounds, 3 if not said
       --against FOLDER   another checkout: its measurements are made in turn with those of this one, and CPU seconds are compared
       --write            put the tables into docs/performance.md, in the place of those there
       NAME               only these: table, matrix, render, budget, bake, fit, fold
"""

import argparse
import json
import os
import platform
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent

# Name, benchmark (or None for the command), arguments, and what the table shows.
MEASUREMENTS = [
    ("table", "table", [], "A table of 132 x 132 directions"),
    ("matrix", "paper_matrix", ["grooves", "pyramids", "weave", "bumpy"], "1,725,153 pairs, nothing precomputed"),
    ("render", "render", [], "Pictures"),
    ("budget", "budget", [], "Budgets"),
    ("bake", None, ["bake", "samples/shot-silk.toml", "--tolerance", "0.02", "-o", "{out}/silk.exr", "--quiet"], "A baked table"),
    ("fit", None, ["fit", "samples/fit/fit.toml", "-o", "{out}/fit", "--seed", "0", "--quiet"], "A fit"),
    ("fold", None, ["fold", "samples/pyramids.toml", "-o", "{out}/p.pdf", "--scale", "400", "--periods", "6x4", "--quiet"], "A folding pattern"),
]
PAGE = HERE / "docs/performance.md"
MARKS = ["<!-- figures: scripts/performance.py --write -->\n", "<!-- end of figures -->\n"]
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def say(text):
    print(f"performance: {text}", file=sys.stderr, flush=True)


class Build:
    """The programs of one checkout, in release mode."""

    def __init__(self, root, benches):
        self.root = root
        environment = {**os.environ, "CARGO_NET_OFFLINE": "true"}
        self.command = root / "target/release/biscale"
        self.run_cargo(["build", "--release", "--locked", "--package", "biscale-cli"], environment)
        self.benches = {}
        for bench in benches:
            lines = self.run_cargo(["bench", "--no-run", "--locked", "--package", "biscale", "--bench", bench, "--message-format=json"], environment)
            found = [m["executable"] for m in map(json.loads, lines.splitlines()) if m.get("executable") and m["target"]["name"] == bench]
            self.benches[bench] = found[0]

    def run_cargo(self, arguments, environment):
        return subprocess.run(["cargo", *arguments], cwd=self.root, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout


class Result:
    """What one run printed, and what it cost."""

    def __init__(self, build, bench, arguments):
        with tempfile.TemporaryDirectory() as out:
            program = [build.benches[bench], "--bench"] if bench else [build.command]
            before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
            done = subprocess.run([*program, *(a.replace("{out}", out) for a in arguments)], cwd=build.root, stdout=subprocess.PIPE, text=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            if done.returncode != 0:
                sys.exit(f"{program[0]} {' '.join(arguments)} ended with status {done.returncode}")
            self.wall = time.monotonic() - start
            self.cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            self.lines = done.stdout.splitlines()


def merged(lines):
    """One line out of the same line of all rounds: the median of each number that differs, with the digits of the first."""
    first = lines[0]
    if any(NUMBER.sub("#", line) != NUMBER.sub("#", first) for line in lines):
        return first
    numbers = zip(*(NUMBER.findall(line) for line in lines))

    def middle(words):
        if len(set(words)) == 1:
            return words[0]
        digits = max(len(word.partition(".")[2]) for word in words)
        return f"{statistics.median(map(float, words)):.{digits}f}"

    found = iter([middle(words) for words in numbers])
    return NUMBER.sub(lambda _: next(found), first)


def machine():
    model = next((l.split(":")[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), platform.processor())
    rustc = subprocess.run(["rustc", "--version"], stdout=subprocess.PIPE, text=True).stdout.strip()
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=HERE, stdout=subprocess.PIPE, text=True).stdout.strip()
    return f"{model}, {os.cpu_count()} cores; {platform.system()}; {rustc}; commit {commit}"


def report(arguments, chosen, loads, results, roots):
    """The tables, as Markdown."""
    lines = [machine() + ".", ""]
    lines.append(f"{arguments.rounds} rounds, interleaved; medians. Load (one minute) before a measurement: {min(loads):.1f} to {max(loads):.1f}, median {statistics.median(loads):.1f}.")
    for name, bench, _, title in chosen:
        if bench:
            lines += ["", f"### {title}", ""]
            lines += [merged(list(same)) for same in zip(*(r.lines for r in results[name, 0]))]
    columns = ["measurement", "CPU s", "wall s"] + (["CPU s, the other", "this over the other"] if len(roots) > 1 else [])
    lines += ["", "### Whole commands", "", f"| {' | '.join(columns)} |", f"|{'---|' * len(columns)}"]
    for name, bench, options, title in chosen:
        command = " ".join(o for o in options if o != "--quiet").replace("{out}/", "")
        shown = f"`cargo bench --bench {bench}`" if bench else f"`biscale {command}`"

        def middle(k, of):
            return statistics.median(getattr(r, of) for r in results[name, k])

        row = [f"{title}: {shown}", f"{middle(0, 'cpu'):.2f}", f"{middle(0, 'wall'):.2f}"]
        if len(roots) > 1:
            # Pairs of one round met the same load.
            ratios = [a.cpu / b.cpu for a, b in zip(results[name, 0], results[name, 1])]
            row += [f"{middle(1, 'cpu'):.2f}", f"{statistics.median(ratios):.3f}"]
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    chosen = [m for m in MEASUREMENTS if not arguments.names or m[0] in arguments.names]
    benches = [bench for _, bench, _, _ in chosen if bench]
    roots = [HERE] + ([arguments.against.resolve()] if arguments.against else [])
    builds = []
    for root in roots:
        say(f"building {root}")
        builds.append(Build(root, benches))

    loads, results = [], {}
    for turn in range(arguments.rounds):
        for name, bench, options, _ in chosen:
            # Who goes first changes from round to round.
            for k in range(len(builds)) if turn % 2 == 0 else reversed(range(len(builds))):
                say(f"round {turn + 1} of {arguments.rounds}: {name}" + (f" of {builds[k].root}" if len(builds) > 1 else ""))
                loads.append(os.getloadavg()[0])
                results.setdefault((name, k), []).append(Result(builds[k], bench, options))

    text = report(arguments, chosen, loads, results, roots)
    print(text, end="")
    if arguments.write:
        before, rest = PAGE.read_text().split(MARKS[0])
        PAGE.write_text(before + MARKS[0] + "\n" + text + "\n" + MARKS[1] + rest.split(MARKS[1])[1])


if __name__ == "__main__":
    main()

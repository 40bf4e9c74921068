#!/usr/bin/env python3
"""Makes the samples that are data and not recipes: hammered.png, studs.obj, and the scan reduced to half its resolution.

usage: scripts/make_samples.py FOLDER [SCAN.tmd]

Needs nothing but Python. FOLDER is usually samples; SCAN.tmd is the original GelSight scan (samples/README.md says where it is from).
"""
import array
import math
import struct
import sys
import zlib


def png(path, width, height, values):
    """Writes an 8-bit grey PNG."""
    rows = b"".join(b"\0" + bytes(values[j * width:(j + 1) * width]) for j in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def hammered(path, size=128, dents=60):
    """Hammered metal: the lowest of round dents of 60 blows, periodic."""
    state = 7
    def draw():  # a linear congruential generator (Park and Miller), the same everywhere
        nonlocal state
        state = state * 48271 % 2147483647
        return state / 2147483647
    blows = [(draw() * size, draw() * size, 0.6 + 0.4 * draw()) for _ in range(dents)]
    near = lambda a, b: (a - b + size / 2) % size - size / 2
    heights = []
    for j in range(size):
        for i in range(size):
            # A ball of radius 40 pixels leaves a spherical cap; where caps meet there is a ridge.
            caps = (near(i, x) ** 2 / 80 + near(j, y) ** 2 / 80 - 3 * depth for x, y, depth in blows)
            heights.append(min(0, min(caps)))
    low = min(heights)
    png(path, size, size, [round(255 * (1 - h / low)) for h in heights])


def studs(path):
    """An octagonal stud on a square plate of 1 x 1, faces of 4 and 8 corners."""
    ring = lambda r, z: [(0.5 + r * math.cos(a), 0.5 + r * math.sin(a), z) for a in (math.radians(22.5 + 45 * k) for k in range(8))]
    edge = [(1, 0.75), (0.75, 1), (0.25, 1), (0, 0.75), (0, 0.25), (0.25, 0), (0.75, 0), (1, 0.25)]
    corners = {1: (1, 1), 3: (0, 1), 5: (0, 0), 7: (1, 0)}
    rows = ["# An octagonal stud with sloping sides on a plate; one period is 1 x 1. Made by scripts/make_samples.py"]
    vertices = ring(0.34, 0.0) + ring(0.26, 0.2) + [(x, y, 0) for x, y in edge] + [(*corners[k], 0) for k in (1, 3, 5, 7)]
    rows += ["v " + " ".join(f"{c:.9g}" for c in v) for v in vertices]
    face = lambda places: rows.append("f " + " ".join(str(p + 1) for p in places))
    rows.append("usemtl plate")
    for k in range(8):
        face([k, 16 + k, 16 + (k + 1) % 8, (k + 1) % 8])
    for n, k in enumerate((0, 2, 4, 6)):
        face([16 + k, 24 + n, 16 + k + 1])
    rows.append("usemtl stud")
    for k in range(8):
        face([k, (k + 1) % 8, 8 + (k + 1) % 8, 8 + k])
    face(range(8, 16))
    with open(path, "w") as out:
        out.write("\n".join(rows) + "\n")


def reduced_scan(source, path):
    """Means of 2 x 2 heights; the extent stays."""
    data = open(source, "rb").read()
    start = data.index(b"\0", data.index(b"\0") + 1) + 1
    columns, rows, x, y = struct.unpack("<IIff", data[start:start + 16])
    heights = array.array("f", data[start + 24:start + 24 + 4 * columns * rows])
    half = array.array("f")
    for j in range(0, rows - 1, 2):
        for i in range(0, columns - 1, 2):
            at = j * columns + i
            half.append((heights[at] + heights[at + 1] + heights[at + columns] + heights[at + columns + 1]) / 4)
    with open(path, "wb") as out:
        out.write(b"Binary TrueMap Data File v2.0\r\n\0" + b"means of 2 x 2 heights of a GelSight scan\0")
        out.write(struct.pack("<IIffff", columns // 2, rows // 2, x, y, 0, 0))
        out.write(half.tobytes())


if __name__ == "__main__":
    folder = sys.argv[1]
    hammered(f"{folder}/hammered.png")
    studs(f"{folder}/studs.obj")
    if len(sys.argv) > 2:
        reduced_scan(sys.argv[2], f"{folder}/gelsight-groove.tmd")

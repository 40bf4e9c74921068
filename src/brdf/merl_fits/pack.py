#!/usr/bin/env python3
"""Packs the neural fits of the MERL materials into weights.f32 and names.txt, beside this script.

    pack.py FITS.json

FITS.json maps a material's name to its network: w1 [6][21], b1 [21], w2 [21][21], b2 [21], w3 [21][3], b3 [3], row = input.
weights.f32 holds, in the order of names.txt, 675 little-endian f32 each: w1, b1, w2, b2, w3, b3. Standard library only.
"""
import json
import pathlib
import struct
import sys

SHAPES = {"w1": (6, 21), "b1": (21,), "w2": (21, 21), "b2": (21,), "w3": (21, 3), "b3": (3,)}


def flat(values, shape):
    if not shape:
        return [float(values)]
    assert len(values) == shape[0], f"{len(values)} values where {shape[0]} belong"
    return [x for v in values for x in flat(v, shape[1:])]


def main(source):
    fits = json.loads(pathlib.Path(source).read_text())
    here = pathlib.Path(__file__).parent
    names = sorted(fits)
    weights = [x for name in names for key, shape in SHAPES.items() for x in flat(fits[name][key], shape)]
    (here / "weights.f32").write_bytes(struct.pack(f"<{len(weights)}f", *weights))
    (here / "names.txt").write_text("".join(name + "\n" for name in names))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])

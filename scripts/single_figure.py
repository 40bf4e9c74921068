#!/usr/bin/env python3
"""One photograph and what it tells, for README.md: the photograph, the surface of a material that may look so, and a pillow in that material.

usage: scripts/single_figure.py BISCALE SAMPLES GALLERY     run in the root of the repository; usually target/release/biscale samples docs/gallery

The photograph is samples/fit/close-up.exr as a screen shows it (8 bits, sRGB): the first panel of what `biscale compare` draws. Needs nothing but Python.
"""
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

# Stops by which the picture is shown darker: its highlights are not cut then.
EXPOSURE = -0.3


def chunks(data):
    """The chunks of a PNG: their kinds and contents."""
    at = 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        yield kind, data[at + 8:at + 8 + length]
        at += 12 + length


def rows(data):
    """Width and rows of a PNG of 8-bit RGB that is not interlaced (PNG specification, section 9: filters)."""
    parts = list(chunks(data))
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", dict(parts)[b"IHDR"])
    assert (depth, colour, interlaced) == (8, 2, 0), "not 8-bit RGB"
    raw = zlib.decompress(b"".join(content for kind, content in parts if kind == b"IDAT"))
    stride, above, decoded = 3 * width, bytes(3 * width), []
    for j in range(height):
        kind, row = raw[j * (stride + 1)], bytearray(raw[j * (stride + 1) + 1:(j + 1) * (stride + 1)])
        for i in range(stride):
            left, up, corner = (row[i - 3], above[i], above[i - 3]) if i >= 3 else (0, above[i], 0)
            estimate = left + up - corner
            paeth = min((left, up, corner), key=lambda v: abs(estimate - v))
            row[i] = (row[i] + (0, left, up, (left + up) // 2, paeth)[kind]) % 256
        decoded.append(bytes(row))
        above = row
    return width, decoded


def write(path, width, lines):
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    # Each byte less the one above: half as large as without a filter.
    above, raw = bytes(3 * width), b""
    for line in lines:
        raw += b"\x02" + bytes((a - b) % 256 for a, b in zip(line, above))
        above = line
    head = struct.pack(">IIBBBBB", width, len(lines), 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__.split("\n\n")[1])
    biscale, samples, gallery = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    run = lambda *arguments: subprocess.run([biscale, *map(str, arguments)], check=True)
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        run("compare", samples / "fit/close-up.exr", samples / "fit/close-up.exr", "-o", work / "panels.png", "--exposure", EXPOSURE)
        width, lines = rows((work / "panels.png").read_bytes())
        # Three panels with 4 pixels between them.
        panel = (width - 8) // 3
        write(samples / "cloth.png", panel, [line[:3 * panel] for line in lines])
        run("capture", samples / "cloth.png", "-o", work / "seen")
        run("plot", work / "seen/guess.toml", "-o", work)
        (gallery / "one-photograph-view.png").write_bytes((work / "guess-view.png").read_bytes())
        run("render", samples / "scenes/pillow.toml", "--material", work / "seen/guess.toml", "-o", gallery / "one-photograph-pillow.png", "--tolerance", 0.02, "--exposure", -1.8, "--force")


if __name__ == "__main__":
    main()

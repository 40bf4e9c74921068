#!/usr/bin/env python3
"""Makes what the sample scenes are made of: meshes of large-scale objects, masks, height fields, and an environment map reduced.

usage: scripts/make_scenes.py FOLDER [PANORAMA.hdr]

Needs nothing but Python. FOLDER is usually samples; PANORAMA.hdr is the original studio.hdr (samples/README.md says where it is from).
"""
import math
import sys

from make_samples import png


class Mesh:
    """Vertices, texture coordinates and quads or triangles in named parts."""

    def __init__(self, what):
        self.rows = [f"# {what}. Made by scripts/make_scenes.py"]
        self.count = 0

    def part(self, name):
        self.rows.append(f"usemtl {name}")

    def grid(self, rows, columns, place, wrap=False, uv=None):
        """A sheet of rows x columns places; outward where place(i, j+1) x place(i+1, j) points; uv(i, j) in 0..1."""
        at = lambda i, j: self.count + i * columns + (j % columns if wrap else j) + 1
        for i in range(rows):
            for j in range(columns):
                self.rows.append("v " + " ".join(f"{c:.5g}" for c in place(i, j)))
                if uv:
                    self.rows.append("vt " + " ".join(f"{c:.5g}" for c in uv(i, j)))
        for i in range(rows - 1):
            for j in range(columns if wrap else columns - 1):
                corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]
                points = [place(*divmod_place(c, self.count, columns)) for c in corners]
                corners = [c for k, c in enumerate(corners) if math.dist(points[k], points[k - 1]) > 1e-9]
                if len(corners) > 2:
                    self.rows.append("f " + " ".join(f"{c}/{c}" if uv else str(c) for c in corners))
        self.count += rows * columns

    def write(self, path):
        with open(path, "w") as out:
            out.write("\n".join(self.rows) + "\n")


def divmod_place(corner, first, columns):
    return divmod(corner - first - 1, columns)


def curve(points, steps):
    """A smooth line (Catmull and Rom) through points, `steps` places between neighbours."""
    out = []
    for k in range(len(points) - 1):
        p = [points[max(k - 1, 0)], points[k], points[k + 1], points[min(k + 2, len(points) - 1)]]
        for s in range(steps):
            t = s / steps
            weights = [-t + 2 * t * t - t**3, 2 - 5 * t * t + 3 * t**3, t + 4 * t * t - 3 * t**3, t**3 - t * t]
            out.append(tuple(sum(w * q[c] for w, q in zip(weights, p)) / 2 for c in range(2)))
    return out + [points[-1]]


def turned(mesh, profile, segments=64, flat_uv=False):
    """The surface of revolution of a profile (radius, height), bottom first outside; with `flat_uv` u and v are x and y."""
    angle = lambda j: math.tau * j / segments
    place = lambda i, j: (profile[i][0] * math.cos(angle(j)), profile[i][0] * math.sin(angle(j)), profile[i][1])
    mesh.grid(len(profile), segments, place, wrap=True, uv=(lambda i, j: place(i, j)[:2]) if flat_uv else None)


def rim(centre, radius, steps=8):
    """The profile of a round edge, from outside over the top; as fine as this, it casts no shadows of its corners on itself."""
    return [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in (math.pi * k / steps for k in range(steps + 1))]


def cup(path):
    mesh = Mesh("A cup with a handle")
    mesh.part("cup")
    foot = [(0, 0), (0.45, 0), (0.5, 0.03)]
    wall = curve([(0.5, 0.03), (0.56, 0.2), (0.66, 0.6), (0.72, 1.1), (0.74, 1.3)], 5)
    inside = curve([(0.696, 1.3), (0.67, 1.1), (0.61, 0.6), (0.5, 0.2), (0.4, 0.08), (0, 0.06)], 4)
    turned(mesh, foot + wall[1:-1] + rim((0.718, 1.31), 0.022) + inside, segments=128)
    mesh.part("handle")
    line = curve([(0.66, 1.08), (0.92, 1.16), (1.1, 0.95), (1.08, 0.62), (0.88, 0.4), (0.6, 0.38)], 8)

    def tube(i, j):
        (x, z), (a, b) = line[i], (line[max(i - 1, 0)], line[min(i + 1, len(line) - 1)])
        length = math.hypot(b[0] - a[0], b[1] - a[1])
        out = (-(b[1] - a[1]) / length, (b[0] - a[0]) / length)
        turn = -math.tau * j / 20
        return (x + 0.075 * math.cos(turn) * out[0], 0.075 * math.sin(turn), z + 0.075 * math.cos(turn) * out[1])

    mesh.grid(len(line), 20, tube, wrap=True)
    mesh.write(path)


def vase(path):
    mesh = Mesh("A vase")
    mesh.part("vase")
    outside = [(0.35, 0), (0.42, 0.05), (0.62, 0.4), (0.78, 0.9), (0.66, 1.45), (0.36, 1.85), (0.28, 2.1), (0.36, 2.3)]
    inside = curve([(0.329, 2.3), (0.25, 2.1), (0.2, 1.9), (0, 1.8)], 4)
    turned(mesh, [(0, 0)] + curve(outside, 6)[:-1] + rim((0.345, 2.305), 0.016) + inside, segments=128)
    mesh.write(path)


def plate(path):
    mesh = Mesh("A shallow bowl; u and v run along x and y")
    mesh.part("plate")
    bowl = lambda r, base: (r, base + 0.5 * (r / 1.4) ** 2)
    under = [bowl(1.4 * k / 24, 0) for k in range(25)]
    over = [bowl(1.4 * k / 24, 0.05) for k in range(24, -1, -1)]
    turned(mesh, under + over, flat_uv=True)
    mesh.write(path)


def skirt(path):
    mesh = Mesh("A skirt of twelve folds, open at both ends")
    mesh.part("skirt")
    rows, columns = 25, 216

    def place(i, j):
        t, turn = i / (rows - 1), math.tau * j / columns
        fold = 0.16 * t**1.3 * math.cos(12 * turn + 0.7 * math.sin(2 * turn))
        radius = 0.42 + 0.75 * t**0.85 + fold
        return (radius * math.cos(turn), radius * math.sin(turn), 1.6 * (1 - t))

    # Rows run downwards here, columns counter-clockwise: turned round so that the outside is out.
    mesh.grid(rows, columns, lambda i, j: place(rows - 1 - i, j), wrap=True)
    mesh.write(path)


def plinth(path):
    mesh = Mesh("A low round plinth, its top at z = 0")
    mesh.part("plinth")
    radius, rounding = 1.5, 0.05
    edge = [(radius - rounding + rounding * math.cos(a), rounding * (math.sin(a) - 1)) for a in (math.pi * k / 16 for k in range(9))]
    turned(mesh, [(0, -0.3), (radius, -0.3)] + edge + [(0, 0)], segments=96)
    mesh.write(path)


def pillow(path):
    mesh = Mesh("A pillow; u and v run along its sides")
    mesh.part("pillow")
    n = 41

    def place(side):
        def of(i, j):
            # Rows along y, columns along x; denser towards the seam.
            x, y = (math.sin(0.5 * math.pi * (2 * k / (n - 1) - 1)) for k in (j, i))
            puff = ((1 - x * x) * (1 - y * y)) ** 0.45
            pinch = 1 - 0.09 * (1 - y * y) * abs(x) ** 3
            pinch_y = 1 - 0.09 * (1 - x * x) * abs(y) ** 3
            wrinkle = 0.012 * math.sin(9 * x * y + 4 * x) * puff
            return (x * pinch, y * pinch_y, side * (0.42 * puff + wrinkle))
        return of

    uv = lambda i, j: (j / (n - 1), i / (n - 1))
    mesh.grid(n, n, place(1), uv=uv)
    lower = place(-1)
    mesh.grid(n, n, lambda i, j: lower(i, n - 1 - j), uv=lambda i, j: (1 - j / (n - 1), i / (n - 1)))
    mesh.write(path)


def logo(path):
    mesh = Mesh("A domed disc, part field, with a star, part star")
    columns, inner, outer = 160, 8, 8

    def star(turn):
        """Radius of a five-pointed star's border."""
        sector = math.tau / 10
        k, into = divmod(turn + sector, 2 * sector)
        into = abs(into - sector)
        (x0, y0), (x1, y1) = (0.75, 0.0), (0.32 * math.cos(sector), 0.32 * math.sin(sector))
        c, s = math.cos(into), math.sin(into)
        return (x0 * y1 - x1 * y0) / (c * (y1 - y0) - s * (x1 - x0))

    def dome(radius, turn):
        return (radius * math.cos(turn), radius * math.sin(turn), 0.35 * (1 - radius * radius))

    angle = lambda j: math.tau * j / columns
    mesh.part("field")
    mesh.grid(outer, columns, lambda i, j: dome(1 + (star(angle(j)) - 1) * i / (outer - 1), angle(j)), wrap=True)
    mesh.part("star")
    mesh.grid(inner, columns, lambda i, j: dome(star(angle(j)) * (1 - i / (inner - 1)), angle(j)), wrap=True)
    mesh.write(path)


def segment_distance(p, a, b):
    """Distance of a point from the line between two."""
    ab, ap = (b[0] - a[0], b[1] - a[1]), (p[0] - a[0], p[1] - a[1])
    t = max(0, min(1, (ab[0] * ap[0] + ab[1] * ap[1]) / (ab[0] ** 2 + ab[1] ** 2)))
    return math.hypot(ap[0] - t * ab[0], ap[1] - t * ab[1])


def emblem(path, n=512):
    """A mask: a ring around a "b" whose bowl is cut from a row of grooves; shares of pixels from distances, x and y in -1..1."""
    grooves = [(-0.04 + 0.11 * k, 0.16 if k % 2 else -0.16) for k in range(5)]
    zigzag = list(zip(grooves, grooves[1:]))

    def distance(p):
        """To the border, below 0 inside."""
        r = math.hypot(*p)
        ring = abs(r - 0.86) - 0.08
        stem = segment_distance(p, (-0.34, 0.58), (-0.34, -0.5)) - 0.1
        bowl = abs(math.hypot(p[0] - 0.08, p[1] + 0.14) - 0.4) - 0.1
        line = min(segment_distance((p[0] + 0.1, p[1] + 0.14), a, b) for a, b in zigzag) - 0.035
        return min(ring, stem, bowl, line)

    pixel = 2 / n
    place = lambda i, j: (pixel * (i + 0.5) - 1, 1 - pixel * (j + 0.5))
    share = lambda d: max(0, min(1, 0.5 - d / pixel))
    png(path, n, n, [round(255 * share(distance(place(i, j)))) for j in range(n) for i in range(n)])


def board(path, n=512, squares=8):
    """A mask: the dark squares of a chess board; the lower left one is dark."""
    square = lambda k: k * squares // n
    png(path, n, n, [255 * ((square(i) + square(n - 1 - j)) % 2 == 0) for j in range(n) for i in range(n)])


def lathe(path, what, profile, segments=40):
    """A surface of revolution with u around and v along the profile (radius, height), bottom first outside."""
    mesh = Mesh(what)
    lengths = [0]
    for p, q in zip(profile, profile[1:]):
        lengths.append(lengths[-1] + math.dist(p, q))
    # The seam has two columns at exactly the same places, for u = 0 and u = 1.
    angle = lambda j: math.tau * (j % segments) / segments
    place = lambda i, j: (profile[i][0] * math.cos(angle(j)), profile[i][0] * math.sin(angle(j)), profile[i][1])
    mesh.part("piece")
    mesh.grid(len(profile), segments + 1, place, uv=lambda i, j: (j / segments, lengths[i] / lengths[-1]))
    mesh.write(path)


def chess(folder):
    """Pieces that are surfaces of revolution, on bases of radius .5 and less; a unit is a square of the board."""
    foot = lambda r: [(0, 0), (0.85 * r, 0), (0.98 * r, 0.03), (r, 0.08), (0.98 * r, 0.14), (0.86 * r, 0.18), (0.8 * r, 0.24)]
    ball = lambda r, z, begin: [(r * math.sin(a), z - r * math.cos(a)) for a in (begin + (math.pi - begin) * k / 10 for k in range(10))] + [(0, z + r)]
    collar = lambda r, z: [(r - 0.04, z - 0.03), (r, z), (r - 0.04, z + 0.03)]
    stem = lambda points: curve(points, 5)
    pieces = {
        "pawn": foot(0.34) + stem([(0.27, 0.24), (0.17, 0.4), (0.12, 0.68)]) + collar(0.21, 0.73) + ball(0.185, 0.92, 0.75),
        "rook": foot(0.38) + stem([(0.3, 0.24), (0.22, 0.45), (0.2, 0.78)]) + collar(0.27, 0.82)
        + [(0.28, 0.88), (0.29, 1.08), (0.27, 1.1), (0.2, 1.1), (0.185, 1.08), (0.18, 0.97), (0.12, 0.95), (0, 0.95)],
        "bishop": foot(0.38) + stem([(0.3, 0.24), (0.17, 0.5), (0.12, 0.92)]) + collar(0.23, 0.97) + collar(0.18, 1.04)
        + stem([(0.1, 1.08), (0.19, 1.24), (0.14, 1.42), (0.045, 1.54)]) + ball(0.055, 1.59, 0.9),
        "king": foot(0.42) + stem([(0.33, 0.24), (0.2, 0.55), (0.15, 1.16)]) + collar(0.28, 1.22) + collar(0.21, 1.3)
        + stem([(0.13, 1.34), (0.19, 1.5), (0.25, 1.68)]) + [(0.245, 1.71), (0.2, 1.75), (0.07, 1.8)] + ball(0.085, 1.86, 0.9),
    }
    for name, profile in pieces.items():
        lathe(f"{folder}/{name}.obj", f"A {name} of chess, turned; u around, v along the profile", profile)
    board(f"{folder}/board.png")


def heights(folder):
    """Four height fields of 128 x 128, periodic, after Fig. 8 of Wu et al. 2011."""
    n = 128
    near = lambda a: (a + n / 2) % n - n / 2

    def image(name, value):
        rows = [value(i, j) for j in range(n) for i in range(n)]
        low, high = min(rows), max(rows)
        png(f"{folder}/{name}.png", n, n, [round(255 * (v - low) / (high - low)) for v in rows])

    wave = lambda x, k: math.cos(math.tau * k * x / n)
    image("waves", lambda i, j: wave(i + 6 * math.sin(math.tau * j / n), 4))
    image("bumps", lambda i, j: max(0, 1 - (near(i % 32 - 16) ** 2 + near(j % 32 - 16) ** 2) / 180) ** 0.5)
    state = 11

    def draw():
        nonlocal state
        state = state * 48271 % 2147483647
        return state / 2147483647

    scratches = [(draw() * n, draw() * n, 0.35 * (draw() - 0.5), 0.5 + draw()) for _ in range(70)]
    image("brushed", lambda i, j: -sum(d * math.exp(-near(i - x - a * near(j - y)) ** 2 / 3) for x, y, a, d in scratches))
    centres = [(draw() * n, draw() * n) for _ in range(40)]

    def cells(i, j):
        first, second = sorted(math.hypot(near(i - x), near(j - y)) for x, y in centres)[:2]
        return min(second - first, 7)

    image("cells", cells)


def reduced_panorama(source, path, factor=4):
    """Means of factor x factor pixels of a Radiance picture, weighted by solid angle nearly alike within a block."""
    data = open(source, "rb").read()
    at = data.index(b"\n\n") + 2
    end = data.index(b"\n", at)
    _, height, _, width = data[at:end].split()
    height, width, at = int(height), int(width), end + 1
    scanlines = []
    for _ in range(height):
        assert data[at:at + 2] == b"\2\2" and data[at + 2] << 8 | data[at + 3] == width, "run-length encoded scan lines are expected"
        at += 4
        planes = []
        for _ in range(4):
            plane = bytearray()
            while len(plane) < width:
                length = data[at]
                if length > 128:
                    plane += data[at + 1:at + 2] * (length - 128)
                    at += 2
                else:
                    plane += data[at + 1:at + 1 + length]
                    at += 1 + length
            planes.append(plane)
        scanlines.append([[c * math.ldexp(1, e - 136) if e else 0.0 for c in rgb] for *rgb, e in zip(*planes)])
    out = bytearray(f"#?RADIANCE\n# reduced {factor} x {factor} by scripts/make_scenes.py\nFORMAT=32-bit_rle_rgbe\n\n"
                    f"-Y {height // factor} +X {width // factor}\n".encode())
    for j in range(0, height, factor):
        for i in range(0, width, factor):
            block = [scanlines[j + y][i + x] for y in range(factor) for x in range(factor)]
            rgb = [sum(p[c] for p in block) / len(block) for c in range(3)]
            brightest = max(rgb)
            if brightest < 1e-32:
                out += bytes(4)
                continue
            _, exponent = math.frexp(brightest)
            out += bytes([min(255, int(c * math.ldexp(256, -exponent))) for c in rgb] + [exponent + 128])
    open(path, "wb").write(out)


if __name__ == "__main__":
    folder = sys.argv[1]
    for make in cup, vase, plate, skirt, pillow, logo:
        make(f"{folder}/scenes/{make.__name__}.obj")
    plinth(f"{folder}/scenes/gallery/plinth.obj")
    emblem(f"{folder}/scenes/emblem.png")
    chess(f"{folder}/scenes/chess")
    heights(f"{folder}/figures")
    if len(sys.argv) > 2:
        reduced_panorama(sys.argv[2], f"{folder}/scenes/studio.hdr")

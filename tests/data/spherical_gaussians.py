#!/usr/bin/env python3
"""Integrals of products of two spherical Gaussians with 60 digits, for src/sg/lobe.rs.

usage: tests/data/spherical_gaussians.py > tests/data/spherical_gaussians.csv      (needs mpmath)

Sharpness and axes are f32 numbers; axes are made unit vectors with 60 digits before they are used, since no f32 vector is one.
    4 pi exp(-l1 - l2) sinh(L) / L,   L = |l1 x1 + l2 x2|          (Iwasaki et al. 2012, eq. 4)
"""

import math
import random
import struct

from mpmath import exp, log, mp, mpf, pi, sinh, sqrt

mp.dps = 60


def unit(v):
    exact = [mpf(float(c)) for c in v]
    length = sqrt(sum(c * c for c in exact))
    return [c / length for c in exact]


def integral(l1, l2, x1, x2):
    l1, l2 = mpf(float(l1)), mpf(float(l2))
    length = sqrt(sum((l1 * a + l2 * b) ** 2 for a, b in zip(unit(x1), unit(x2))))
    return 4 * pi * exp(-l1 - l2) * (sinh(length) / length if length > mpf(10) ** -50 else 1)


def f32(x):
    return struct.unpack("f", struct.pack("f", x))[0]


def normalised(v):
    length = math.sqrt(sum(c * c for c in v))
    return [c / length for c in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def main():
    draw = random.Random(1)
    print("# 4 pi exp(-l1 - l2) sinh(L) / L with 60 digits, by tests/data/spherical_gaussians.py")
    print("l1,l2,x1,y1,z1,x2,y2,z2,integral")
    sharpness = [0.0] + [10.0**e for e in range(-8, 9)]
    for l1 in sharpness:
        for l2 in [l for l in sharpness if l >= l1]:
            # Angles about as wide as the product, wider, and any.
            width = 1.0 / math.sqrt(max(1.0, l1 * l2 / max(l1 + l2, 1e-30)))
            for angle in [0.0, 0.3 * width, width, 3.0 * width, 8.0 * width, draw.uniform(0.0, math.pi), math.pi]:
                x1 = normalised([draw.gauss(0.0, 1.0) for _ in range(3)])
                side = normalised(cross(x1, [draw.gauss(0.0, 1.0) for _ in range(3)]))
                x2 = [math.cos(angle) * a + math.sin(angle) * b for a, b in zip(x1, side)]
                x1, x2 = [[f32(c) for c in x] for x in (x1, x2)]
                value = integral(f32(l1), f32(l2), x1, x2)
                text = "0" if value == 0 or log(value) < -700 else f"{float(value):.17g}"
                print(",".join([*(f"{n:.9g}" for n in [f32(l1), f32(l2), *x1, *x2]), text]))


main()

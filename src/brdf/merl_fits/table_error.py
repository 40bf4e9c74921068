#!/usr/bin/env python3
"""How far a table of a neural fit is from the network: why the program evaluates the network.

    table_error.py FITS.json       (needs numpy; FITS.json as for pack.py)

Trilinear tables of the sum before the exponential, over theta_h (square spacing), theta_d and phi_d, at 100,000 random pairs.
Prints the relative error (floor: a thousandth of the largest value): median, 99 % quantile, largest.
"""
import json
import sys

import numpy as np

NAMES = ["chrome", "gold-metallic-paint", "pink-felt", "red-fabric", "specular-black-phenolic", "steel", "white-paint"]


def network(fit, th, td, pd):
    x = np.stack([np.sin(th), 0 * th, np.cos(th), np.sin(td) * np.cos(pd), np.sin(td) * np.sin(pd), np.cos(td)], -1)
    a = np.maximum(x @ fit["w1"] + fit["b1"], 0)
    a = np.maximum(a @ fit["w2"] + fit["b2"], 0)
    return np.maximum(a @ fit["w3"] + fit["b3"], 0)


def interpolate(table, th, td, pd):
    sizes = table.shape[:3]
    at = [u * (n - 1) for u, n in zip((np.sqrt(th / (np.pi / 2)), td / (np.pi / 2), pd / np.pi), sizes)]
    cell = [np.minimum(a.astype(int), n - 2) for a, n in zip(at, sizes)]
    out = 0
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod([(a - c) if k else 1 - (a - c) for k, a, c in zip(corner, at, cell)], axis=0)
        out = out + weight[:, None] * table[tuple(c + k for k, c in zip(corner, cell))]
    return out


fits = json.load(open(sys.argv[1]))
rng = np.random.default_rng(1)
th, td, pd = rng.random(100_000) ** 2 * np.pi / 2, rng.random(100_000) * np.pi / 2, rng.random(100_000) * np.pi
z = -np.sin(td) * np.cos(pd) * np.sin(th) + np.cos(td) * np.cos(th)
keep = (z > 0.01) & (2 * np.cos(td) * np.cos(th) - z > 0.01)
th, td, pd = th[keep], td[keep], pd[keep]
for name in NAMES:
    fit = {key: np.array(value) for key, value in fits[name].items()}
    true = np.expm1(network(fit, th, td, pd))
    for size in [(91, 91, 91), (181, 91, 91), (181, 181, 91)]:
        u, v, w = (np.linspace(0, 1, n) for n in size)
        nodes = np.meshgrid(u**2 * np.pi / 2, v * np.pi / 2, w * np.pi, indexing="ij")
        got = np.expm1(interpolate(network(fit, *nodes), th, td, pd))
        error = np.abs(got - true) / np.maximum(true, 1e-3 * true.max())
        print(f"{name} {size}: {np.median(error):.1e} {np.quantile(error, 0.99):.1e} {error.max():.1e}")

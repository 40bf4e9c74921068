#!/usr/bin/env python3
"""Values of the neural fits at random pairs of directions, for the tests of the built-in fits.

    merl_fits_numpy.py FITS.json > merl_fits_numpy.csv       (needs numpy; FITS.json as for src/brdf/merl_fits/pack.py)

Half and difference angles by rotations, as Rusinkiewicz 1998 defines them, and phi_d folded into 0..pi as in MERL files: another
way than the program's. Columns: name, wi, wo, fr in 1/sr by channel, normal z.
"""
import json
import sys

import numpy as np

NAMES = ["alum-bronze", "chrome", "gold-metallic-paint", "pink-felt", "red-fabric", "specular-black-phenolic", "white-paint", "yellow-plastic"]
rng = np.random.default_rng(7)


def about(axis, angle, v):
    return v * np.cos(angle) + axis * (axis @ v) * (1 - np.cos(angle)) + np.cross(axis, v) * np.sin(angle)


def network(fit, x):
    a = np.maximum(x @ fit["w1"] + fit["b1"], 0)
    a = np.maximum(a @ fit["w2"] + fit["b2"], 0)
    return np.maximum(np.exp(a @ fit["w3"] + fit["b3"]) - 1, 0)


def direction():
    z, phi = rng.uniform(0.02, 1), rng.uniform(0, 2 * np.pi)
    return np.array([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])


fits = json.load(open(sys.argv[1]))
print("name,wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,r,g,b")
for name in NAMES:
    fit = {key: np.array(value) for key, value in fits[name].items()}
    for k in range(8):
        wi, wo = direction(), direction()
        if k % 2:  # near the mirror direction
            wi = wo * [-1, -1, 1] + rng.normal(0, 0.05, 3)
            wi[2] = abs(wi[2])
            wi /= np.linalg.norm(wi)
        h = (wi + wo) / np.linalg.norm(wi + wo)
        theta_h, phi_h = np.arccos(h[2]), np.arctan2(h[1], h[0])
        d = about(np.array([0, 1.0, 0]), -theta_h, about(np.array([0, 0, 1.0]), -phi_h, wi))
        theta_d, phi_d = np.arccos(d[2]), np.arctan2(d[1], d[0]) % np.pi
        s = np.sin(theta_d)
        x = np.array([np.sin(theta_h), 0, np.cos(theta_h), s * np.cos(phi_d), s * np.sin(phi_d), np.cos(theta_d)])
        print(name + "," + ",".join(f"{v:.12g}" for v in [*wi, *wo, *network(fit, x)]))

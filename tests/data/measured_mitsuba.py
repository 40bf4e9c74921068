#!/usr/bin/env python3
"""Values of RGL tables as Mitsuba 3 reads them, for the tests of `measured`.

    measured_mitsuba.py FILE_rgb.bsdf... > measured_mitsuba.csv       (needs mitsuba and numpy from PyPI)

Columns: file, wi (to the light), wo (to the viewer), value = fr (n.wi) in 1/sr by channel, normal z. The table's own direction
is the viewer's: Mitsuba's si.wi is our wo. The first file gets 50 pairs, the others 10. The values in the repository are of
Mitsuba 3.9.1, variant scalar_rgb (single precision).
"""
import os
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
rng = np.random.default_rng(20)


def direction():
    # A third near grazing.
    z = rng.uniform(0.003, 0.2) if rng.random() < 0.33 else rng.uniform(0.0, 1.0)
    phi = rng.uniform(0, 2 * np.pi)
    r = np.sqrt(1 - z * z)
    return np.array([r * np.cos(phi), r * np.sin(phi), z])


print("file,wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,r,g,b")
for place, path in enumerate(sys.argv[1:]):
    bsdf = mi.load_dict({"type": "measured", "filename": path})
    for k in range(50 if place == 0 else 10):
        light, viewer = direction(), direction()
        if k % 3 == 0:  # near the mirror direction, where the lobe is
            light = viewer * [-1, -1, 1] + rng.normal(0, 0.1, 3)
            light[2] = abs(light[2])
            light /= np.linalg.norm(light)
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(viewer)
        value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(light))
        numbers = [*light, *viewer, *(float(v) for v in value)]
        print(os.path.basename(path) + "," + ",".join(f"{v:.9g}" for v in numbers))

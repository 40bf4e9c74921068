#!/usr/bin/env python3
"""Column means of the photographs: columns.py FOLDER > columns.csv; FOLDER holds b_cylinder_direct.exr and c_cylinder_otherlight_direct.exr.

Needs the packages numpy and OpenEXR.
"""
import sys

import numpy
import OpenEXR

print("photo,column,r,g,b,se_r,se_g,se_b")
for photo, name in ("b", "b_cylinder_direct"), ("c", "c_cylinder_otherlight_direct"):
    pixels = OpenEXR.File(f"{sys.argv[1]}/{name}.exr").channels()["RGB"].pixels.astype(float)
    rows = pixels.shape[0]
    for column, (mean, error) in enumerate(zip(pixels.mean(0), pixels.std(0, ddof=1) / rows**0.5)):
        print(f"{photo},{column}," + ",".join(f"{v:.6g}" for v in (*mean, *error)))

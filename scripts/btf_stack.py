#!/usr/bin/env python3
"""Writes a stack of 8-bit images of numpy as a BTF that `biscale btf` reads (docs/btf.md says what the file holds).

usage: scripts/btf_stack.py STACK.npz OUT.btf.npz

STACK.npz has `code`, uint8 [row][column][view][light][rgb] with values (code/255)^2 scale, `scale`, `directions` of views and lights, and `front`,
the share of front faces times 255, [row][column][view]. The codes are the data: errors are 0.
"""

import io
import json
import sys
import zipfile

import numpy as np


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    stack = np.load(sys.argv[1])
    radiance = ((stack["code"] / 255.0) ** 2 * float(stack["scale"])).transpose(2, 3, 0, 1, 4)
    views, lights, rows, columns, _ = radiance.shape
    mean = radiance.mean((2, 3))
    cover = stack["front"].transpose(2, 0, 1)[..., None] / 255.0
    arrays = {
        "radiance": radiance.astype("<f2"),
        "mean": np.stack([mean, np.zeros_like(mean)], 2).astype("<f4"),
        "error": np.zeros((views, lights), "<f4"),
        "cover": np.repeat(cover, 2, 3).astype("<f2"),
        "views": stack["directions"].astype("<f8"),
        "lights": stack["directions"].astype("<f8"),
    }
    about = dict(format="biscale BTF", version=1, program="numpy", name="stack", material="", plane_z=0.0, period=[1.0, 1.0])
    about |= dict(texels=[columns, rows], tolerance=0.0, relative_rms=0.0, samples=0, seed=0, notes=["cover[1] is cover[0]"])
    with zipfile.ZipFile(sys.argv[2], "w") as out:
        for name, array in arrays.items():
            written = io.BytesIO()
            np.lib.format.write_array(written, np.ascontiguousarray(array), version=(1, 0))
            out.writestr(f"{name}.npy", written.getvalue())
        out.writestr("about.json", json.dumps(about))


if __name__ == "__main__":
    main()

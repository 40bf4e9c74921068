#!/usr/bin/env python3
"""Checks folding patterns with other people's geometry: solids and exact polygon booleans of the Manifold library.

usage: validate.py PATTERN.fold ... [--design-volume MM3]

Reads FOLD files that `biscale fold` wrote (any program's, where it has foldAngles), folds them up from their flat form and their
angles alone, and checks:

- the net: no two faces overlap (area of the union against the sum of areas, with manifold3d's CrossSection);
- the folded form in the file is the same shape (distances between corners, to 1e-4 mm);
- every facet, thickened to a solid, is a manifold, and no two solids of facets without a common corner intersect, unless those
  of the folded form do;
- the volume between the surface and its base (a surface with a border), or inside it (a closed one), refolded, is that of the
  design, where the file or --design-volume tells it, to 1e-6.

Exit status: 0 all is well; 1 something is wrong (said on standard error); 2 bad input.
"""

import argparse
import json
import sys
from collections import defaultdict

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold, Mesh

THICKNESS = 0.02  # mm, of the solids
POSITION = 1e-4  # mm
OVERLAP = 1e-2  # mm2 of a whole sheet: Clipper2 rounds to 1e-8 of its extent
SOLID_OVERLAP = 1e-4  # mm3 of one pair of facets


def rotation(axis, angle):
    """Rotation matrix about a unit vector (Rodrigues)."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def components(n, links):
    """Connected parts of 0..n, each a list of (face, parent link or None) in the order of a walk."""
    around = defaultdict(list)
    for link in links:
        around[link[0]].append(link)
        around[link[1]].append((link[1], link[0], link[3], link[2], link[4]))
    seen, parts = set(), []
    for start in range(n):
        if start in seen:
            continue
        seen.add(start)
        part = [(start, None)]
        for face, _ in part:
            for link in around[face]:
                if link[1] not in seen:
                    seen.add(link[1])
                    part.append((link[1], link))
        parts.append(part)
    return parts


def refold(flat, faces, edges, sides, assignment, angles):
    """Corners of every face in space, folded up piece by piece from the first face of each."""
    links = []
    for (a, b), pair, letter, angle in zip(edges, sides, assignment, angles):
        if len(pair) == 2 and None not in pair and letter in "MVF":
            # The face to the left of the edge a -> b first; a valley lifts the other one.
            links.append((pair[0], pair[1], a, b, np.radians(angle or 0.0)))
    lifted = np.c_[flat, np.zeros(len(flat))]
    motion, parts = {}, components(len(faces), links)
    for part in parts:
        for face, link in part:
            if link is None:
                motion[face] = (np.eye(3), np.zeros(3))
                continue
            parent, _, a, b, angle = link
            p, axis = lifted[a], lifted[b] - lifted[a]
            r = rotation(axis / np.linalg.norm(axis), -angle)
            turn, shift = motion[parent]
            motion[face] = (turn @ r, turn @ (p - r @ p) + shift)
    corners = [lifted[f] @ motion[k][0].T + motion[k][1] for k, f in enumerate(faces)]
    return corners, [[face for face, _ in part] for part in parts]


def fit(source, target):
    """The motion that brings points nearest to others (Kabsch 1976)."""
    s0, t0 = source.mean(0), target.mean(0)
    u, _, vt = np.linalg.svd((source - s0).T @ (target - t0))
    d = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    r = (u @ d @ vt).T
    return r, t0 - r @ s0


def triangles_of(polygon):
    """Ear clipping of a planar polygon in space."""
    normal = sum(np.cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0]) for k in range(1, len(polygon) - 1))
    rest, out = list(range(len(polygon))), []

    def turn(a, b, c):
        return np.dot(np.cross(polygon[b] - polygon[a], polygon[c] - polygon[a]), normal)

    while len(rest) > 3:
        for k in range(len(rest)):
            a, b, c = rest[k - 1], rest[k], rest[(k + 1) % len(rest)]
            if turn(a, b, c) <= 0:
                continue
            if all(min(turn(a, b, d), turn(b, c, d), turn(c, a, d)) < 0 for d in rest if d not in (a, b, c)):
                break
        out.append((rest[k - 1], rest[k], rest[(k + 1) % len(rest)]))
        del rest[k]
    return out + [tuple(rest)]


def solid(polygon):
    """A facet of THICKNESS, half of it on each side."""
    tris = triangles_of(polygon)
    normal = sum(np.cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0]) for k in range(1, len(polygon) - 1))
    normal /= np.linalg.norm(normal)
    n, half = len(polygon), 0.5 * THICKNESS * normal
    points = np.vstack([polygon + half, polygon - half])
    faces = [t for t in tris] + [(c + n, b + n, a + n) for a, b, c in tris]
    for k in range(n):
        j = (k + 1) % n
        faces += [(k, k + n, j), (j, k + n, j + n)]
    # 32-bit corners are enough at a tenth of a micrometre.
    return Manifold(Mesh(vert_properties=points.astype(np.float32), tri_verts=np.array(faces, np.uint32)))


def check(path, design_volume):
    """Returns what is wrong with one file, and a line of figures."""
    with open(path, encoding="utf-8") as file:
        fold = json.load(file)
    flat = np.array(fold["vertices_coords"], float)[:, :2]
    faces = fold["faces_vertices"]
    wrong, facets = [], len(faces)
    corners, parts = refold(flat, faces, fold["edges_vertices"], fold["edges_faces"], fold["edges_assignment"], fold["edges_foldAngle"])
    folded = fold["file_frames"][0]["vertices_coords"]
    folded = np.array(folded, float)

    # The net.
    polygons = [flat[f] for f in faces]
    areas = [0.5 * float(np.sum(p[:, 0] * np.roll(p[:, 1], -1) - p[:, 1] * np.roll(p[:, 0], -1))) for p in polygons]
    if min(areas) <= 0:
        wrong.append(f"{sum(a <= 0 for a in areas)} faces do not run counter-clockwise")
    union = CrossSection(polygons, FillRule.NonZero).area()
    net_overlap = sum(areas) - union
    if abs(net_overlap) > OVERLAP:
        wrong.append(f"faces of the net overlap by {net_overlap:.4f} mm2")

    # The refolded pieces against the folded form, each moved as a whole.
    worst, placed = 0.0, [None] * facets
    for part in parts:
        source = np.vstack([corners[f] for f in part])
        target = np.vstack([folded[faces[f]] for f in part])
        r, t = fit(source, target)
        worst = max(worst, float(np.abs(source @ r.T + t - target).max()))
        for f in part:
            placed[f] = corners[f] @ r.T + t
    if not worst <= POSITION:
        wrong.append(f"the folded form differs from the refolded one by {worst:.3g} mm")

    # Solids.
    low = np.array([p.min(0) - THICKNESS for p in placed])
    high = np.array([p.max(0) + THICKNESS for p in placed])
    solids = [solid(p) for p in placed]
    bad = sum(s.is_empty() or s.volume() <= 0 for s in solids)
    if bad:
        wrong.append(f"{bad} facets make no manifold solid")
    places = [set(map(tuple, np.round(p, 3))) for p in placed]
    order = np.argsort(low[:, 0])
    pairs, crossing = 0, []
    for at, i in enumerate(order):
        for j in order[at + 1 :]:
            if low[j, 0] > high[i, 0]:
                break
            if (low[j] > high[i]).any() or (low[i] > high[j]).any() or near(places[i], places[j]):
                continue
            pairs += 1
            if (solids[i] ^ solids[j]).volume() > SOLID_OVERLAP:
                crossing.append((i, j))
    # A design may go through itself (rods through their ground, a teapot's spout through its body); folding must not add to it.
    design = {k: solid(folded[faces[k]]) for pair in crossing for k in pair}
    added = [(i, j) for i, j in crossing if (design[i] ^ design[j]).volume() <= SOLID_OVERLAP]
    if added:
        wrong.append(f"{len(added)} pairs of facets go through each other that do not in the design")

    # The volume under the surface, or in it, about a base at its lowest point.
    base = min(float(p[:, 2].min()) for p in placed)

    def under(polygon):
        total = 0.0
        for a, b, c in triangles_of(polygon):
            p, q, s = polygon[a], polygon[b], polygon[c]
            area = 0.5 * ((q[0] - p[0]) * (s[1] - p[1]) - (q[1] - p[1]) * (s[0] - p[0]))
            total += area * ((p[2] + q[2] + s[2]) / 3 - base)
        return total

    volume = sum(under(p) for p in placed)
    wanted = design_volume if design_volume is not None else fold.get("biscale:recipe", {}).get("design_volume_mm3")
    volume_error = None
    if wanted is not None:
        volume_error = abs(volume - wanted) / max(abs(wanted), 1e-9)
        if not volume_error <= 1e-6:
            wrong.append(f"the refolded volume is {volume:.6f} mm3 and the design's is {wanted:.6f}")
    said = "none known" if volume_error is None else f"{volume_error:.1e}"
    figures = (
        f"{facets} facets, {len(parts)} pieces, net overlap {net_overlap:.1e} mm2, positions {worst:.1e} mm, "
        f"{pairs} pairs of solids, {len(added)} crossing ({len(crossing) - len(added)} in the design too), volume {volume:.3f} mm3, off by {said}"
    )
    return wrong, figures


def near(a, b):
    """Whether two facets share a corner, to a micrometre or so (a glued edge may gape by rounding)."""
    if a & b:
        return True
    return any(max(abs(x - y) for x, y in zip(p, q)) < 0.003 for p in a for q in b)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pattern", nargs="+")
    parser.add_argument("--design-volume", type=float)
    arguments = parser.parse_args()
    status = 0
    for path in arguments.pattern:
        try:
            wrong, figures = check(path, arguments.design_volume)
        except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
            print(f"{path}: cannot be read: {error!r}", file=sys.stderr)
            return 2
        print(f"{path}: {figures}")
        for text in wrong:
            print(f"{path}: wrong: {text}", file=sys.stderr)
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())

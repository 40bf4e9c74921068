#!/usr/bin/env python3
"""Checks folding patterns with other people's geometry: solids and exact polygon booleans of the Manifold library.

usage: validate.py PATTERN.fold|STRIPS.svg ... [--design-volume MM3]

Reads FOLD files that `biscale fold` wrote (any program's, where it has foldAngles), folds them up from their flat form and their
angles alone, and checks:

- the net: no two faces overlap (area of the union against the sum of areas, with manifold3d's CrossSection);
- the folded form in the file is the same shape (distances between corners, to 1e-4 mm);
- every facet, thickened to a solid, is a manifold, and no two solids of facets without a common corner intersect, unless those
  of the folded form do;
- the volume between the surface and its base (a surface with a border), or inside it (a closed one), refolded, is that of the
  design, where the file or --design-volume tells it, to 1e-6.

Of the strips of a weave (SVG; of `OUT-1.svg` the pages that follow are read too) it checks that they are rectangles that lie apart on
their pages (booleans again), that at each crossing just one of the two strips lies over, that strips are as long between crossings as
one bend that all of their direction share, and that the woven strips, laid along these bends and thickened to solids, do not meet.

Exit status: 0 all is well; 1 something is wrong (said on standard error); 2 bad input.
"""

import argparse
import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from pathlib import Path

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


def read_strips(path):
    """Strips of all pages by name: page, polygon (mm, y up), place in the cloth, crossings in their order."""
    pages = [path]
    if path.stem.endswith("-1"):
        k = 2
        while (page := path.with_name(f"{path.stem[:-2]}-{k}{path.suffix}")).exists():
            pages.append(page)
            k += 1
    strips, wrong = {}, []
    for number, page in enumerate(pages):
        root = ElementTree.parse(page).getroot()
        height = float(root.get("viewBox").split()[3])
        for node in root.iter("{http://www.w3.org/2000/svg}polygon"):
            points = [[float(v) for v in pair.split(",")] for pair in node.get("points").split()]
            polygon = np.array([[x, height - y] for x, y in points])
            if node.get("data-strip"):
                name = node.get("data-strip")
                if name in strips:
                    wrong.append(f"{name} stands twice")
                strips[name] = {"page": number, "polygon": polygon, "at": float(node.get("data-at")), "crossings": []}
            elif node.get("data-crossing"):
                strip = strips[node.get("data-of")]
                along = strip["polygon"][1] - strip["polygon"][0]
                middle = float((polygon.mean(0) - strip["polygon"][0]) @ along / np.linalg.norm(along))
                strip["crossings"].append((middle, node.get("data-over") == "1", float(node.get("data-at"))))
    if not strips:
        raise ValueError("no strips in the file")
    return strips, wrong


def bend_length(amplitude, distance):
    """Length of amplitude * cos(pi x / distance) from 0 to distance (Simpson's rule)."""
    x = np.linspace(0, 1, 513)
    slope = amplitude * np.pi / distance * np.sin(np.pi * x)
    weights = np.ones(513)
    weights[1:-1:2], weights[2:-1:2] = 4, 2
    return distance / 3 / 512 * float(weights @ np.sqrt(1 + slope**2))


def amplitude_of(length, distance):
    """The amplitude of a bend of a length, by bisection."""
    low, high = 0.0, length
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if bend_length(middle, distance) > length else (middle, high)
    return 0.5 * (low + high)


def ribbon(strip, width, amplitude, warp):
    """A woven strip as a solid: along its crossings, a cosine where it changes sides."""
    path = []
    for (_, over, at), following in zip(strip["crossings"], strip["crossings"][1:] + [None]):
        z = amplitude if over else -amplitude
        path.append((at, z))
        if following and following[1] != over:
            for t in np.linspace(0, 1, 18)[1:-1]:
                path.append((at + t * (following[2] - at), z * np.cos(np.pi * t)))
    w, h = 0.5 * width, 0.5 * THICKNESS
    points, faces = [], []
    for k, (along, z) in enumerate(path):
        for a, b in [(w, -h), (w, h), (-w, h), (-w, -h)]:
            across = strip["at"] + a
            points.append((across, along, z + b) if warp else (along, across, z + b))
        if k:
            for j in range(4):
                a, b, c, d = 4 * k - 4 + j, 4 * k + j, 4 * k + (j + 1) % 4, 4 * k - 4 + (j + 1) % 4
                faces += [(a, b, c), (a, c, d)] if warp else [(a, c, b), (a, d, c)]
    last = len(points) - 4
    ends = [(0, 1, 2), (0, 2, 3), (last, last + 2, last + 1), (last, last + 3, last + 2)]
    faces += ends if warp else [(a, c, b) for a, b, c in ends]
    return Manifold(Mesh(vert_properties=np.array(points, np.float32), tri_verts=np.array(faces, np.uint32)))


def check_strips(path):
    """Returns what is wrong with the strips of a weave, and a line of figures."""
    strips, wrong = read_strips(Path(path))
    overlap = 0.0
    for page in {s["page"] for s in strips.values()}:
        polygons = [s["polygon"] for s in strips.values() if s["page"] == page]
        areas = [abs(CrossSection([p], FillRule.NonZero).area()) for p in polygons]
        overlap = max(overlap, sum(areas) - CrossSection(polygons, FillRule.NonZero).area())
    if overlap > OVERLAP:
        wrong.append(f"strips on a page overlap by {overlap:.4f} mm2")
    for name, s in strips.items():
        sides = np.roll(s["polygon"], -1, 0) - s["polygon"]
        if max(abs(float(sides[k] @ sides[(k + 1) % 4])) for k in range(4)) > 1e-4:
            wrong.append(f"{name} is no rectangle")

    def direction(kind):
        found = {int(m.group(1)): s for name, s in strips.items() if (m := re.fullmatch(kind + r"-(\d+)", name))}
        if sorted(found) != list(range(1, len(found) + 1)) or not found:
            raise ValueError(f"the {kind} strips are not numbered from 1")
        return [found[k] for k in sorted(found)]

    warps, wefts = direction("warp"), direction("weft")
    for kind, own, crossed in [("warp", warps, wefts), ("weft", wefts, warps)]:
        for k, s in enumerate(own):
            if len(s["crossings"]) != len(crossed):
                raise ValueError(f"{kind} {k + 1} has {len(s['crossings'])} crossings for {len(crossed)} strips")
            off = max(abs(c[2] - other["at"]) for c, other in zip(s["crossings"], crossed))
            if off > 1e-4:
                wrong.append(f"{kind} {k + 1} crosses {off:.4f} mm from where the other strip lies")
    both = sum(warps[i]["crossings"][j][1] == wefts[j]["crossings"][i][1] for i in range(len(warps)) for j in range(len(wefts)))
    if both:
        wrong.append(f"at {both} crossings both strips lie over or both under")
    amplitudes = []
    for kind, own in [("warp", warps), ("weft", wefts)]:
        heights = []
        for k, s in enumerate(own):
            for (here, over, at), (there, after, to) in zip(s["crossings"], s["crossings"][1:]):
                length, distance = there - here, to - at
                if over == after:
                    if abs(length - distance) > 1e-4:
                        wrong.append(f"{kind} {k + 1} is {length:.4f} mm long where it floats over {distance:.4f}")
                elif length <= distance:
                    wrong.append(f"{kind} {k + 1} has no length to bend with")
                else:
                    heights.append(amplitude_of(length, distance))
        if heights and max(heights) - min(heights) > 1e-3:
            wrong.append(f"the bends of the {kind} strips are {min(heights):.4f} to {max(heights):.4f} mm high, not alike")
        amplitudes.append(float(np.mean(heights)) if heights else 0.0)
    meeting, pairs, bad = 0, 0, 0
    if not wrong:
        width = lambda s: float(np.linalg.norm(s["polygon"][2] - s["polygon"][1]))  # noqa: E731
        solids = [[ribbon(s, width(s), a, warp) for s in own] for own, a, warp in [(warps, amplitudes[0], True), (wefts, amplitudes[1], False)]]
        # One strip of a direction has no crossing to be laid along.
        bad = sum(s.is_empty() or s.volume() <= 0 for own, other in zip(solids, [wefts, warps]) if len(other) > 1 for s in own)
        for a in solids[0]:
            for b in solids[1]:
                pairs += 1
                meeting += (a ^ b).volume() > SOLID_OVERLAP
        if bad:
            wrong.append(f"{bad} woven strips make no manifold solid")
        if meeting:
            wrong.append(f"{meeting} pairs of woven strips go through each other")
    figures = (
        f"{len(warps)} warp and {len(wefts)} weft strips, {len(warps) * len(wefts)} crossings, {both} impossible, overlap {overlap:.1e} mm2, "
        f"bends {amplitudes[0]:.3f} and {amplitudes[1]:.3f} mm high, {pairs} pairs of solids, {meeting} meeting"
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
            strips = Path(path).suffix.lower() == ".svg"
            wrong, figures = check_strips(path) if strips else check(path, arguments.design_volume)
        except (OSError, ValueError, KeyError, IndexError, TypeError, AttributeError, ElementTree.ParseError) as error:
            print(f"{path}: cannot be read: {error!r}", file=sys.stderr)
            return 2
        print(f"{path}: {figures}")
        for text in wrong:
            print(f"{path}: wrong: {text}", file=sys.stderr)
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())

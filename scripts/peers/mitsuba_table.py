#!/usr/bin/env python3
"""The other side of the speed comparison: a table of effective BRDF values with Mitsuba 3, as one would write it there.

Rays start on the plane above one tile, stratified, and go against the viewer's direction; what they hit on a front face is lit
from every light direction of the table by a shadow ray. The rays from the viewer are shared by all lights. The periodic surface
is exact: a block of 7 x 7 tiles is in the scene, and a ray that leaves it is moved back by whole periods and goes on.

    fbar(wi,wo) = mean over the hits of  fr (n.wi)+ V(wi)

usage: mitsuba_table.py [--quick] CASE...      prints one JSON object a case: CPU and wall seconds, noise
"""
import argparse
import json
import os
import resource
import time

import numpy as np
import drjit as dr
import mitsuba as mi

mi.set_variant('llvm_ad_rgb')

TILES = os.path.join(os.path.dirname(os.path.abspath(__file__)), '../../tests/data/truth')
DIFFUSE = {'type': 'diffuse', 'reflectance': {'type': 'rgb', 'value': [.5] * 3}}


def ggx(alpha):
    """A GGX lobe with F = 1."""
    return {'type': 'roughconductor', 'material': 'none', 'distribution': 'ggx', 'alpha': alpha,
            'specular_reflectance': {'type': 'rgb', 'value': [.5] * 3}}


# Name: tile, BRDF, side of the square of rays a viewer's direction. The names are those of benches/table.rs.
CASES = {
    'weave-diffuse': ('weave', DIFFUSE, 32),
    'weave-ggx-0.3': ('weave', ggx(.3), 64),
    'weave-ggx-0.05': ('weave', ggx(.05), 64),
    'bumpy-diffuse': ('bumpy', DIFFUSE, 32),
    'rods-diffuse': ('rods', DIFFUSE, 88),
    'vgroove-diffuse': ('vgroove', DIFFUSE, 16),
}
DIRECTIONS = 132
# For the noise: a table of these directions, with these seeds.
SUBSET, SEEDS = 12, 6
# Copies of the tile to each side in the scene, and the most blocks of them that a ray crosses.
COPIES, MOST_BLOCKS = 3, 64


def read_obj(path):
    """Vertices, and the triangles of each material, of an OBJ file whose period is 1 x 1."""
    vertices, groups, current = [], {}, 'default'
    for line in open(path):
        words = line.split()
        if words[:1] == ['v']:
            vertices.append([float(x) for x in words[1:4]])
        elif words[:1] == ['usemtl']:
            current = words[1]
        elif words[:1] == ['f']:
            corners = [int(w.split('/')[0]) - 1 for w in words[1:]]
            groups.setdefault(current, []).extend([corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1))
    return np.array(vertices), {name: np.array(triangles) for name, triangles in groups.items()}


def mesh(name, vertices, triangles):
    props = mi.Properties()
    props['face_normals'] = True
    made = mi.Mesh(name, len(vertices), len(triangles), props=props)
    parameters = mi.traverse(made)
    parameters['vertex_positions'] = np.asarray(vertices, np.float32).ravel()
    parameters['faces'] = np.asarray(triangles, np.uint32).ravel()
    parameters.update()
    return made


class PeriodicTile:
    """A tile of period 1 x 1 with its neighbours."""

    def __init__(self, vertices, groups):
        self.zmin, self.zmax = float(vertices[:, 2].min()), float(vertices[:, 2].max())
        # A tile may overhang its cell: that far from the edge of the block hits can be trusted.
        def overhang(c):
            return int(np.ceil(max(0, -vertices[:, c].min(), vertices[:, c].max() - 1) - 1e-6))
        self.x0, self.x1 = -(COPIES - overhang(0)), COPIES - overhang(0) + 1
        self.y0, self.y1 = -(COPIES - overhang(1)), COPIES - overhang(1) + 1
        scene, self.groups = {'type': 'scene'}, list(groups)
        for g, name in enumerate(self.groups):
            used, triangles = np.unique(groups[name], return_inverse=True)
            triangles, own = triangles.reshape(groups[name].shape), vertices[used]
            shifts = [(i, j, 0) for i in range(-COPIES, COPIES + 1) for j in range(-COPIES, COPIES + 1)]
            scene[f'g{g}'] = mesh(name, np.concatenate([own + s for s in shifts]),
                                  np.concatenate([triangles + k * len(own) for k in range(len(shifts))]))
        self.scene = mi.load_dict(scene, optimize=False)
        self.shapes = [mi.ShapePtr(s) for s in self.scene.shapes()]
        assert len(self.shapes) == len(self.groups)

    def wrap(self, p):
        return mi.Point3f(p.x - dr.floor(p.x), p.y - dr.floor(p.y), p.z)

    def exit(self, o, d):
        tx = dr.select(d.x > 0, (self.x1 - o.x) / d.x, dr.select(d.x < 0, (self.x0 - o.x) / d.x, dr.inf))
        ty = dr.select(d.y > 0, (self.y1 - o.y) / d.y, dr.select(d.y < 0, (self.y0 - o.y) / d.y, dr.inf))
        return dr.maximum(dr.minimum(tx, ty), 0)

    @dr.syntax
    def intersect(self, o, d, active):
        o, d, active = mi.Point3f(o), mi.Vector3f(d), mi.Bool(active)
        found = dr.zeros(mi.PreliminaryIntersection3f, dr.width(o))
        found.t = dr.full(mi.Float, dr.inf, dr.width(o))
        blocks = mi.UInt32(0)
        while active:
            far = self.exit(o, d)
            ray = mi.Ray3f(o, d)
            ray.maxt = far
            new = self.scene.ray_intersect_preliminary(ray, active=active)
            hit = active & new.is_valid()
            found = dr.select(hit, new, found)
            z = o.z + far * d.z
            active = active & ~hit & (z <= self.zmax + 1e-6) & (z >= self.zmin - 1e-6) & (blocks < MOST_BLOCKS)
            o = dr.select(active, self.wrap(o + d * far), o)
            blocks += 1
        ray = mi.Ray3f(o, d)
        return found.compute_surface_interaction(ray, ray_flags=mi.RayFlags.All, active=found.is_valid())

    @dr.syntax
    def occluded(self, o, d, active):
        o, d, active = mi.Point3f(o), mi.Vector3f(d), mi.Bool(active)
        blocked = mi.Bool(False) & active
        blocks = mi.UInt32(0)
        while active:
            far = self.exit(o, d)
            ray = mi.Ray3f(o, d)
            ray.maxt = far
            hit = self.scene.ray_test(ray, active=active) & active
            blocked = blocked | hit
            z = o.z + far * d.z
            active = active & ~hit & (z <= self.zmax + 1e-6) & (blocks < MOST_BLOCKS)
            o = dr.select(active, self.wrap(o + d * far), o)
            blocks += 1
        return blocked

    def seen(self, u, v, wo):
        """What rays from the viewer hit, and whether from the front."""
        hit = self.intersect(mi.Point3f(u, v, self.zmax + 1e-4), -wo, mi.Bool(True) & (u > -1))
        return hit, hit.is_valid() & (dr.dot(hit.n, wo) > 0)

    def lit(self, hit, front, wi, bsdfs):
        """fr (n.wi)+ V(wi) of the hits."""
        above = front & (dr.dot(hit.n, wi) > 0)
        offset = (1 + dr.max(dr.abs(hit.p))) * 4e-6
        origin = self.wrap(hit.p + hit.n * (offset * dr.select(dr.dot(hit.n, wi) >= 0, 1., -1.)))
        free = above & ~self.occluded(origin, wi, above)
        local, context, colour = hit.to_local(wi), mi.BSDFContext(), mi.Color3f(0)
        for shape, bsdf in zip(self.shapes, bsdfs):
            mine = free & (hit.shape == shape)
            colour += dr.select(mine, bsdf.eval(context, hit, local, mine), 0)
        return colour


def stratified(n, repeats, rng):
    """A jittered grid of n x n, anew for each repeat."""
    i, j = np.arange(n)[:, None], np.arange(n)[None, :]
    u = (i + rng.random((repeats, n, n), dtype=np.float32)) / n
    v = (j + rng.random((repeats, n, n), dtype=np.float32)) / n
    return mi.Float(u.reshape(-1).astype(np.float32)), mi.Float(v.reshape(-1).astype(np.float32))


def table(tile, directions, bsdfs, n, seed=3):
    """fbar for all pairs of `directions`: array [viewer, light, channel]."""
    rng = np.random.default_rng(seed)
    rays, count = n * n, len(directions)
    out = np.zeros((count, count, 3), np.float32)
    at_once = max(1, int(4e6) // rays)
    for start in range(0, count, at_once):
        end = min(count, start + at_once)
        u, v = stratified(n, end - start, rng)
        viewer = dr.arange(mi.UInt32, (end - start) * rays) // rays
        chosen = mi.Vector3f(np.ascontiguousarray(directions[start:end].astype(np.float32).T))
        wo = dr.gather(mi.Vector3f, chosen, viewer)
        hit, front = tile.seen(u, v, wo)
        hits = dr.block_sum(dr.select(front, mi.Float(1), 0), rays)
        dr.eval(hit, front, hits)
        hits = np.maximum(np.array(hits), 1)[:, None]
        for k, wi in enumerate(directions):
            # Opaque numbers: one compiled kernel serves all lights.
            light = mi.Vector3f(*[dr.opaque(mi.Float, float(x)) for x in wi])
            out[start:end, k] = np.array(dr.block_sum(tile.lit(hit, front, light, bsdfs), rays)).T / hits
    return out


def spread_directions(n):
    """n directions up to 85 degrees, a Fibonacci lattice uniform in solid angle; the same as in benches/common."""
    i = np.arange(n) + .5
    z = 1 - (1 - np.cos(np.radians(85))) * i / n
    phi, r = i * np.pi * (3 - np.sqrt(5)), np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], 1)


def run(name, quick):
    shape, bsdf, n = CASES[name]
    n = n // 4 if quick else n
    directions = spread_directions(DIRECTIONS)
    tile = PeriodicTile(*read_obj(os.path.join(TILES, shape + '.obj')))
    bsdfs = [mi.load_dict(bsdf)] * len(tile.groups)
    table(tile, directions[:2], bsdfs, n)  # compiles the kernels, which stay in a cache
    cpu, wall = time.process_time(), time.time()
    table(tile, directions, bsdfs, n)
    cpu, wall = time.process_time() - cpu, time.time() - wall
    # Noise: median over the values of their relative standard deviation over seeds.
    subset = directions[np.random.default_rng(0).choice(DIRECTIONS, SUBSET, False)]
    values = np.array([table(tile, subset, bsdfs, n, seed=50 + k)[..., 0] for k in range(SEEDS)])
    relative = values.std(0, ddof=1) / np.maximum(values.mean(0), 1e-4)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({'case': name, 'rays': n * n, 'cpu_s': round(cpu, 3), 'wall_s': round(wall, 3),
                      'noise': round(float(np.median(relative)), 6), 'peak_mib': round(peak)}), flush=True)


if __name__ == '__main__':
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('cases', metavar='CASE', nargs='*', default=list(CASES), help='of ' + ', '.join(CASES))
    parser.add_argument('--quick', action='store_true', help='a sixteenth of the rays: tries the set-up')
    arguments = parser.parse_args()
    for case in arguments.cases:
        run(case, arguments.quick)

"""Pieces, pages and CPU seconds of the Blender add-on "Export Paper Model" (github.com/addam/Export-Paper-Model-from-Blender).

usage: fold_blender.py ADDON_FOLDER MESH:SIZE_MM ...

ADDON_FOLDER is a checkout of the add-on named `export_paper_model`; `pip install bpy` gives the Blender to run it in. Each mesh is read
as it is written, welded, its polygons cut into triangles, scaled so that its largest extent is SIZE_MM, and unfolded with the add-on's
defaults for a page of A4 with 10 mm left empty; its pieces are limited by the page. Prints one JSON line a mesh.

The add-on lets tabs overlap. Its pages are filled by a search with a limit of 15 seconds, which is not counted.
"""

import json
import os
import struct
import sys
import time

import bpy  # before bmesh, which comes with it

import bmesh  # isort: skip
from mathutils import Vector

# A4 less 10 mm on all sides. One unit of the model is 1 mm: in metres, the add-on refuses triangles below 1 mm².
PAGE = Vector((190.0, 277.0))
# Width of the tabs, mm: the add-on's default.
TAB = 5.0
# Height of the title above a piece, mm, as the add-on sets it.
TITLE = 1.2 * TAB
# Corners closer than this share of the size are one.
WELD = 1e-7


def read(path):
    """Vertices and polygons of an OBJ or a binary or text STL."""
    if path.lower().endswith(".obj"):
        vertices, polygons = [], []
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file:
                words = line.split()
                if words[:1] == ["v"]:
                    vertices.append([float(w) for w in words[1:4]])
                elif words[:1] == ["f"]:
                    corners = [int(w.split("/")[0]) for w in words[1:]]
                    polygons.append([c - 1 if c > 0 else len(vertices) + c for c in corners])
        return vertices, polygons
    with open(path, "rb") as file:
        data = file.read()
    count = struct.unpack_from("<I", data, 80)[0] if len(data) > 84 else -1
    if len(data) == 84 + 50 * count:
        vertices = [struct.unpack_from("<3f", data, 84 + 50 * k + 12 * (j + 1)) for k in range(count) for j in range(3)]
    else:
        lines = data.decode("ascii").splitlines()
        vertices = [[float(w) for w in line.split()[1:4]] for line in lines if line.split()[:1] == ["vertex"]]
    return vertices, [[k, k + 1, k + 2] for k in range(0, len(vertices), 3)]


def load(path, size_mm):
    """The mesh as Blender's active object in edit mode; how many triangles it has."""
    vertices, polygons = read(path)
    extent = max(max(v[k] for v in vertices) - min(v[k] for v in vertices) for k in range(3))
    factor = size_mm / extent
    data = bpy.data.meshes.new("mesh")
    data.from_pydata([[c * factor for c in v] for v in vertices], [], polygons)
    shape = bmesh.new()
    shape.from_mesh(data)
    bmesh.ops.remove_doubles(shape, verts=shape.verts, dist=WELD * size_mm)
    bmesh.ops.triangulate(shape, faces=shape.faces)
    shape.to_mesh(data)
    triangles = len(shape.faces)
    shape.free()
    thing = bpy.data.objects.new("object", data)
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.mode_set(mode="EDIT")
    return thing, triangles


def pieces(thing, unfolder, page):
    """Sizes of the pieces, CPU seconds of the search, and the number of pages; none where the add-on finds a piece larger than its page."""
    start = time.process_time()
    work = unfolder.Unfolder(thing)
    work.prepare(page, unfolder.default_priority_effect, 1, True)
    seconds = time.process_time() - start
    sizes = sorted(len(island.faces) for island in work.mesh.islands)
    pages = None
    work.mesh.generate_stickers(TAB, True)
    work.mesh.finalize_islands(PAGE, title_height=TITLE)
    try:
        pages = len(unfolder.paginate_islands(work.mesh.islands, PAGE, "CUSTOM"))
    except unfolder.UnfoldError:
        pass
    return sizes, seconds, pages


def unfold(path, size_mm, unfolder):
    """One line of the table."""
    thing, triangles = load(path, size_mm)
    out = {"mesh": os.path.basename(path), "mm": size_mm, "triangles": triangles}
    try:
        sizes, seconds, pages = pieces(thing, unfolder, PAGE)
        out |= {"pieces": len(sizes), "largest": sizes[-1], "median": sizes[len(sizes) // 2], "cpu_s": round(seconds, 2), "pages": pages}
        if pages is None:
            # Its limit leaves tabs and titles out: what it takes when the limit leaves room for them.
            sizes, _, pages = pieces(thing, unfolder, PAGE - Vector((2 * TAB, 2 * TAB + TITLE)))
            out |= {"pieces_with_room": len(sizes), "pages": pages}
    except unfolder.UnfoldError as error:
        out["error"] = str(error.args[0]).replace("\n", " ")[:200]
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.data.objects.remove(thing)
    return out


def main():
    folder = os.path.abspath(sys.argv[1])
    sys.path.insert(0, os.path.dirname(folder))
    unfolder = __import__(f"{os.path.basename(folder)}.unfolder", fromlist=["unfolder"])
    # Blender 5.0 has no freestyle marks on meshes any more; the add-on reads them for the style of lines only.
    unfolder.Mesh.copy_freestyle_marks = lambda mesh: None
    # It would take a layer off a mesh that is gone by then.
    unfolder.Unfolder.__del__ = lambda work: None
    for argument in sys.argv[2:]:
        path, size = argument.rsplit(":", 1)
        print(json.dumps(unfold(path, float(size), unfolder)), flush=True)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Renders a wgray scene's geometry with Mitsuba 3 and prints one JSON line with the times.

    DRJIT_LIBLLVM_PATH=... python mitsuba_scenes.py SCENE.toml [--size N] [--spp N] [--light-samples N] [--warm N] [-o FILE]

Direct light only, LIGHT_SAMPLES shadow rays to every light at every hit (what wgray's Phong integrator does, with cheaper
shading: diffuse). Mitsuba chooses a light at random for each of its `emitter_samples`, so it gets LIGHT_SAMPLES times
the number of lights. `load_s` is the time to read the scene's files and to build Embree's trees, `first_s` the first render,
which compiles, `warm_s` the median of WARM more; --warm 0 with -o is what a user's script does, the whole process.

Mitsuba's `sphere` takes no unequal axes and no shear. Where a scene has ellipsoids, --ellipsoids says what stands for them:
    spheres   a sphere of the same volume; Mitsuba's fastest for few
    exact     Mitsuba's shape `ellipsoids`, made for splatting: one for all ellipsoids of a material; its fastest for many
    auto      spheres for up to 1,000 ellipsoids, else exact (default)
An infinite plane becomes a rectangle of half side 1000. Meshes of one file and material are instances of one shape group.
"""
import argparse
import collections
import json
import os
import statistics
import sys
import tempfile
import time

sys.dont_write_bytecode = True
import mitsuba as mi
import numpy as np

import scenes

MOST_SPHERES = 1000


def paint(material):
    return {"type": "twosided", "b": {"type": "diffuse", "reflectance": {"type": "rgb", "value": material.diffuse}}}


def rectangle(T, center, u, v):
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = u, v, np.cross(u, v) / np.linalg.norm(np.cross(u, v)), center
    return {"type": "rectangle", "to_world": T(m)}


def triangles(s, path):
    mesh = mi.Mesh("triangles", len(s.vertices), len(s.faces))
    params = mi.traverse(mesh)
    params["vertex_positions"] = np.array(s.vertices, np.float32).ravel()
    params["faces"] = np.array(s.faces, np.uint32).ravel()
    params.update()
    mesh.write_ply(path)
    return {"type": "ply", "filename": path, "face_normals": True}


def sphere(T, s):
    radius = float(abs(np.linalg.det(np.array([s.a, s.b, s.c]))) ** (1 / 3))
    return {"type": "sphere", "to_world": T().translate(s.center).scale(radius)}


def ellipsoids(shapes):
    """One shape for all of them."""
    # any linear image of the sphere is that of orthogonal half axes: the singular value decomposition's
    turns, scales, _ = np.linalg.svd(np.array([[s.a, s.b, s.c] for s in shapes], float).transpose(0, 2, 1))
    turns *= np.linalg.det(turns)[:, None, None]
    return {"type": "ellipsoids", "centers": rows([s.center for s in shapes]), "scales": rows(scales),
            "quaternions": rows([quaternion(turn) for turn in turns]), "extent": 1.0, "extent_adaptive_clamping": False}


def rows(values):
    return mi.TensorXf(np.array(values, np.float32))


def quaternion(turn):
    w = np.sqrt(max(0, 1 + np.trace(turn))) / 2
    if w > 1e-6:
        x, y, z = (turn[2, 1] - turn[1, 2]) / (4 * w), (turn[0, 2] - turn[2, 0]) / (4 * w), (turn[1, 0] - turn[0, 1]) / (4 * w)
    else:  # half a turn about the axis that stays
        w, (x, y, z) = 0, np.linalg.eigh(turn + turn.T)[1][:, -1]
    return [x, y, z, w]


def ply(s):
    if not s.file.endswith(".ply"):
        raise ValueError(f"{s.file}: the peers' meshes are PLY files")
    # Without a word on normals, wgray's are the file's or flat, Mitsuba's the file's or smooth: our files have none.
    return {"type": "ply", "filename": s.file, "face_normals": s.normals in (None, "flat")}


def load(scene, size, spp, light_samples, exact=None):
    """Mitsuba's scene; `exact` as --ellipsoids has it, None for auto."""
    T = mi.ScalarTransform4f
    folder = tempfile.mkdtemp()
    width, height = size or (scene.width, scene.height)
    parts = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": light_samples * len(scene.lights), "bsdf_samples": 0},
        "sensor": {"type": "perspective", "fov": scene.fov, "fov_axis": "y",
                   "to_world": T().look_at(origin=scene.position, target=scene.look_at, up=scene.up),
                   "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
                   "sampler": {"type": "independent", "sample_count": spp}},
    }
    bsdfs = {}  # by the material, so that shapes share them

    def painted(row, material):
        name = bsdfs.setdefault(id(material), f"material{len(bsdfs)}")
        parts.setdefault(name, paint(material))
        return row | {"bsdf": {"type": "ref", "id": name}}

    curved = [s for s in scene.shapes if isinstance(s, scenes.Ellipsoid)]
    if exact is None:
        exact = len(curved) > MOST_SPHERES
    together = collections.defaultdict(list)
    for s in curved if exact else []:
        together[id(s.material)].append(s)
    for i, group in enumerate(together.values()):
        parts[f"ellipsoids{i}"] = painted(ellipsoids(group), group[0].material)
    uses = collections.Counter((s.file, id(s.material)) for s in scene.shapes if isinstance(s, scenes.Mesh))
    groups = {}  # names of shape groups
    for i, s in enumerate(scene.shapes):
        if isinstance(s, scenes.Quad):
            row = rectangle(T, s.center, s.u, s.v)
        elif isinstance(s, scenes.Triangles):
            row = triangles(s, os.path.join(folder, f"{i}.ply"))
        elif isinstance(s, scenes.Ellipsoid):
            if exact:
                continue
            row = sphere(T, s)
        elif isinstance(s, scenes.Mesh):
            key = (s.file, id(s.material))
            place = T(np.array([*s.to_world, [0, 0, 0, 1]]))
            if uses[key] == 1:
                row = ply(s) | {"to_world": place}
            else:
                if key not in groups:
                    groups[key] = f"group{len(groups)}"
                    parts[groups[key]] = {"type": "shapegroup", "mesh": painted(ply(s), s.material)}
                parts[f"shape{i}"] = {"type": "instance", "group": {"type": "ref", "id": groups[key]}, "to_world": place}
                continue
        else:
            other = np.eye(3)[int(np.argmin(np.abs(s.normal)))]
            u = np.cross(s.normal, other)
            u *= 1000 / np.linalg.norm(u)
            row = rectangle(T, s.point, u, np.cross(s.normal, u))
        parts[f"shape{i}"] = painted(row, s.material)
    for i, l in enumerate(scene.lights):
        # Mitsuba's radiance falls off with distance and the cosine at the light; 20 makes the picture about as bright.
        parts[f"light{i}"] = rectangle(T, l.center, l.u, l.v) | {
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0, 0, 0]}},
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": scenes.scaled(l.color, 20)}}}
    return mi.load_dict(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--size", type=int)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--light-samples", type=int, default=16, help="to every light")
    parser.add_argument("--warm", type=int, default=5)
    parser.add_argument("--ellipsoids", choices=["auto", "spheres", "exact"], default="auto")
    parser.add_argument("-o", "--output")
    args = parser.parse_args()

    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)  # warnings go to standard output, before the line of JSON
    scene = scenes.load(args.scene)
    size = (args.size, args.size) if args.size else (scene.width, scene.height)
    start = time.perf_counter()
    exact = {"auto": None, "spheres": False, "exact": True}[args.ellipsoids]
    loaded = load(scene, size, args.spp, args.light_samples, exact)
    load_s = time.perf_counter() - start
    times = []
    for seed in range(1 + args.warm):
        start = time.perf_counter()
        picture = mi.render(loaded, spp=args.spp, seed=seed)
        image = np.array(picture)  # waits for the picture
        times.append(time.perf_counter() - start)
    if not np.isfinite(image).all() or not image.mean() > 0.01 and min(size) > 1:
        sys.exit("Mitsuba's picture is black or not finite")
    if args.output:
        mi.util.write_bitmap(args.output, picture, write_async=False)
    total = args.light_samples * len(scene.lights)
    print(json.dumps({"renderer": f"Mitsuba {mi.__version__} {args.variant}", "width": size[0], "height": size[1],
                      "pixel_samples": args.spp, "light_samples": total, "load_s": load_s, "first_s": times[0],
                      "warm_s": statistics.median(times[1:]) if args.warm else None}))


if __name__ == "__main__":
    main()

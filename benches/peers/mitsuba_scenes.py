#!/usr/bin/env python3
"""Renders a wgray scene's geometry with Mitsuba 3 and prints one JSON line with the times.

    DRJIT_LIBLLVM_PATH=... python mitsuba_scenes.py SCENE.toml [--size N] [--spp N] [--light-samples N] [--warm N] [-o FILE]

Direct light only, LIGHT_SAMPLES shadow rays to every light at every hit (what wgray's Phong integrator does, with cheaper
shading: diffuse). Mitsuba chooses a light at random for each of its `emitter_samples`, so it gets LIGHT_SAMPLES times
the number of lights. `first_s` is the first render, which compiles, `warm_s` the median of WARM more; --warm 0 with -o
is what a user's script does, the whole process.

Mitsuba's `sphere` takes no unequal axes and no shear. Where a scene has ellipsoids, --ellipsoids says what stands for them:
    spheres   a sphere of the same volume (default: Mitsuba's fastest)
    exact     Mitsuba's shape `ellipsoids`, made for splatting, one for each; for pictures to look at
An infinite plane becomes a rectangle of half side 1000.
"""
import argparse
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


def ellipsoid(T, s, exact):
    axes = np.array([s.a, s.b, s.c], float).T
    if not exact:
        radius = float(abs(np.linalg.det(axes)) ** (1 / 3))
        return {"type": "sphere", "to_world": T().translate(s.center).scale(radius)}
    # any linear image of the sphere is that of orthogonal half axes: the singular value decomposition's
    turn, scale, _ = np.linalg.svd(axes)
    turn *= np.linalg.det(turn)
    w = np.sqrt(max(0, 1 + np.trace(turn))) / 2
    if w > 1e-6:
        x, y, z = (turn[2, 1] - turn[1, 2]) / (4 * w), (turn[0, 2] - turn[2, 0]) / (4 * w), (turn[1, 0] - turn[0, 1]) / (4 * w)
    else:  # half a turn about the axis that stays
        w, (x, y, z) = 0, np.linalg.eigh(turn + turn.T)[1][:, -1]
    row = lambda values: mi.TensorXf(np.array([values], np.float32))
    return {"type": "ellipsoids", "centers": row(s.center), "scales": row(scale), "quaternions": row([x, y, z, w]),
            "extent": 1.0, "extent_adaptive_clamping": False}


def load(scene, size, spp, light_samples, exact):
    T = mi.ScalarTransform4f
    folder = tempfile.mkdtemp()
    width, height = size or (scene.width, scene.height)
    rows = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": light_samples * len(scene.lights), "bsdf_samples": 0},
        "sensor": {"type": "perspective", "fov": scene.fov, "fov_axis": "y",
                   "to_world": T().look_at(origin=scene.position, target=scene.look_at, up=scene.up),
                   "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
                   "sampler": {"type": "independent", "sample_count": spp}},
    }
    for i, s in enumerate(scene.shapes):
        if isinstance(s, scenes.Quad):
            row = rectangle(T, s.center, s.u, s.v)
        elif isinstance(s, scenes.Triangles):
            row = triangles(s, os.path.join(folder, f"{i}.ply"))
        elif isinstance(s, scenes.Ellipsoid):
            row = ellipsoid(T, s, exact)
        else:
            other = np.eye(3)[int(np.argmin(np.abs(s.normal)))]
            u = np.cross(s.normal, other)
            u *= 1000 / np.linalg.norm(u)
            row = rectangle(T, s.point, u, np.cross(s.normal, u))
        rows[f"shape{i}"] = row | {"bsdf": paint(s.material)}
    for i, l in enumerate(scene.lights):
        # Mitsuba's radiance falls off with distance and the cosine at the light; 20 makes the picture about as bright.
        rows[f"light{i}"] = rectangle(T, l.center, l.u, l.v) | {
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0, 0, 0]}},
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": scenes.scaled(l.color, 20)}}}
    return mi.load_dict(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--size", type=int)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--light-samples", type=int, default=16, help="to every light")
    parser.add_argument("--warm", type=int, default=5)
    parser.add_argument("--ellipsoids", choices=["spheres", "exact"], default="spheres")
    parser.add_argument("-o", "--output")
    args = parser.parse_args()

    mi.set_variant(args.variant)
    scene = scenes.load(args.scene)
    size = (args.size, args.size) if args.size else (scene.width, scene.height)
    loaded = load(scene, size, args.spp, args.light_samples, args.ellipsoids == "exact")
    times = []
    for seed in range(1 + args.warm):
        start = time.perf_counter()
        picture = mi.render(loaded, spp=args.spp, seed=seed)
        image = np.array(picture)  # waits for the picture
        times.append(time.perf_counter() - start)
    if not np.isfinite(image).all() or not image.mean() > 0.01:
        sys.exit("Mitsuba's picture is black or not finite")
    if args.output:
        mi.util.write_bitmap(args.output, picture, write_async=False)
    total = args.light_samples * len(scene.lights)
    print(json.dumps({"renderer": f"Mitsuba {mi.__version__} {args.variant}", "width": size[0], "height": size[1],
                      "pixel_samples": args.spp, "light_samples": total, "first_s": times[0],
                      "warm_s": statistics.median(times[1:]) if args.warm else None}))


if __name__ == "__main__":
    main()

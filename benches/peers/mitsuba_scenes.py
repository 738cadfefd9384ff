#!/usr/bin/env python3
"""Renders a wgray scene with Mitsuba 3 and prints one JSON line with the times.

    DRJIT_LIBLLVM_PATH=... python mitsuba_scenes.py SCENE.toml [--size N] [--spp N] [--light-samples N] [--warm N] [-o FILE]

Renders direct light only, with LIGHT_SAMPLES shadow rays per light and hit: as many rays as wgray's Phong integrator,
with cheaper, diffuse shading. Mitsuba chooses a light at random for each of its `emitter_samples`, so it gets LIGHT_SAMPLES times the
number of lights. `load_s` is the time to read the scene's files and to build Embree's BVHs, `first_s` the time of the first
render, including compilation, and `warm_s` the median of WARM further renders. --warm 0 with -o times the whole process, as in
a user's script.

With --integrator path it renders a scene of the path tracer: with `path`, or with `volpath` if glass absorbs. Mitsuba's
depth is `max_depth` + 1, because Mitsuba also counts the segment from the camera. The BSDFs are Mitsuba's, except Phong's
(mitsuba_phong.py), which Mitsuba lacks. `emission` becomes an area light on the outer side of a closed shape, and two area lights
back to back for a rectangle, a disk and a triangle. Emissive meshes must be closed. --seed is the seed of the first image.

Mitsuba's `sphere` supports neither unequal axes nor shear. --ellipsoids selects the replacement of ellipsoids:
    spheres   a sphere of the same volume; fastest in Mitsuba for few ellipsoids
    exact     Mitsuba's shape `ellipsoids`, made for splatting, one per material; fastest in Mitsuba for many ellipsoids
    mesh      a fine mesh with the ellipsoid's normals; spheres stay spheres
    auto      spheres for up to 1,000 ellipsoids, otherwise exact (default)
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

import mitsuba_ggx
import mitsuba_phong
import scenes

MAX_SPHERES = 1000
# Distance of an emissive rectangle, disk or triangle from each of its two area lights. At a distance of 5e-4, nearby
# surfaces would be visibly brighter.
SIDE_OFFSET = 2e-5
BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0, 0, 0]}}


def color_texture(value):
    """Returns a colour as a Mitsuba texture. Two squares of a checker cover a uv interval of 1 in Mitsuba, and of 2 in
    wgray."""
    if isinstance(value, scenes.Checker):
        u, v = value.scale
        return {"type": "checkerboard", "color0": color_texture(value.even), "color1": color_texture(value.odd),
                "to_uv": mi.ScalarTransform3f().scale([u / 2, v / 2])}
    return {"type": "rgb", "value": value}


def bsdf(material, traced, exact):
    if material.kind == "phong" and traced:
        plugin = {"type": mitsuba_phong.NAME, "kd": color_texture(material.diffuse), "ks": color_texture(material.specular),
                  "shininess": material.shininess}
    elif material.kind in ("phong", "diffuse"):
        plugin = {"type": "diffuse", "reflectance": color_texture(material.diffuse if material.kind == "phong" else material.color)}
    elif material.kind == "conductor":
        plugin = {"type": "conductor", "material": "none", "specular_reflectance": color_texture(material.color)}
        if material.index:
            eta, k = (unbounded_color(value) for value in material.index)
            plugin = {"type": "conductor", "eta": eta, "k": k}
        if any(material.alpha) and exact:
            plugin = {"type": mitsuba_ggx.CONDUCTOR, "color": color_texture(material.color)} | microfacets(*material.alpha)
            if material.index:
                plugin |= {f"{name}{i}": float(x) for name, values in zip(("eta", "k"), material.index) for i, x in enumerate(values)}
        elif any(material.alpha):
            plugin |= {"type": "roughconductor", "distribution": "ggx"} | microfacets(*material.alpha)
    elif material.kind == "principled":
        # Only Mitsuba's metal (GGX with Schlick's formula) agrees with wgray's, at roughnesses with little masking and multiple
        # scattering. The diffuse term, specular lobe, glass, clearcoat and sheen of Disney's model differ from glTF's, at a
        # comparable cost.
        alpha_u, alpha_v = (float(alpha) for alpha in material.alpha)
        anisotropy = {"anisotropic": (1 - alpha_v / alpha_u) / 0.9} if alpha_u > alpha_v else {}
        plugin = {"type": "principled", "base_color": color_texture(material.color), "metallic": float(material.metallic),
                  "roughness": (alpha_u * alpha_v) ** 0.25, "specular": 0.5, "clearcoat": float(material.coat[0]),
                  "clearcoat_gloss": 1.0 - material.coat[1]} | anisotropy
    elif material.thin:
        return {"type": "thindielectric", "int_ior": float(material.ior), "ext_ior": 1.0, "specular_transmittance": color_texture(material.color)}
    else:
        plugin = {"type": "dielectric", "int_ior": float(material.ior), "ext_ior": 1.0, "specular_transmittance": color_texture(material.color)}
        if any(material.alpha) and exact:
            plugin = {"type": mitsuba_ggx.DIELECTRIC, "int_ior": float(material.ior), "color": color_texture(material.color)} | microfacets(*material.alpha)
        elif any(material.alpha):
            plugin |= {"type": "roughdielectric", "distribution": "ggx"} | microfacets(*material.alpha)
        return plugin
    return {"type": "twosided", "b": plugin}


def unbounded_color(value):
    """Returns a Mitsuba texture of three numbers, which may exceed 1."""
    return {"type": "rgb", "value": value}


def microfacets(alpha_u, alpha_v):
    return {"alpha_u": float(alpha_u), "alpha_v": float(alpha_v)}


def environment_emitter(T, environment):
    """Returns a constant or an image environment.

    Mitsuba's rows of texels are at equal angles from pole to pole, wgray's at the centres of bands. With 2 n + 1 rows,
    Mitsuba's rows include wgray's n rows. The rows in between are means, because both renderers interpolate linearly.
    """
    if not isinstance(environment, scenes.EnvironmentMap):
        return {"type": "constant", "radiance": color_texture(environment)}
    rows = np.array(mi.Bitmap(environment.file).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    image = np.empty((2 * len(rows) + 1, *rows.shape[1:]), np.float32)
    image[1::2] = rows
    image[2:-1:2] = (rows[:-1] + rows[1:]) / 2
    image[0], image[-1] = rows[0].mean(0), rows[-1].mean(0)
    to_world = T().rotate([0, 0, 1], environment.rotate) @ T(np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]]))
    return {"type": "envmap", "bitmap": mi.Bitmap(image), "scale": float(environment.scale), "to_world": to_world}


def rectangle(T, center, u, v, kind="rectangle"):
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = u, v, np.cross(u, v) / np.linalg.norm(np.cross(u, v)), center
    return {"type": kind, "to_world": T(m)}


def triangles(vertices, faces, path, normals=None):
    mesh = mi.Mesh("triangles", len(vertices), len(faces), has_vertex_normals=normals is not None)
    params = mi.traverse(mesh)
    params["vertex_positions"] = np.array(vertices, np.float32).ravel()
    params["faces"] = np.array(faces, np.uint32).ravel()
    if normals is not None:
        params["vertex_normals"] = np.array(normals, np.float32).ravel()
    params.update()
    mesh.write_ply(path)
    return {"type": "ply", "filename": path, "face_normals": normals is None}


def sphere(T, s):
    radius = float(abs(np.linalg.det(np.array([s.a, s.b, s.c]))) ** (1 / 3))
    return {"type": "sphere", "to_world": T().translate(s.center).scale(radius)}


def round_mesh(T, s, path, rows=256):
    """Returns a sphere, or for unequal axes a mesh of negligible tessellation error with the ellipsoid's normals."""
    axes = np.array([s.a, s.b, s.c], float)
    if np.allclose(axes @ axes.T, np.eye(3) * np.dot(axes[0], axes[0]), atol=1e-9):
        return sphere(T, s)
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, 2 * rows + 1), indexing="ij")
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    normals = unit @ np.linalg.inv(axes).T
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    i, j = (n.ravel() for n in np.meshgrid(range(rows), range(2 * rows), indexing="ij"))
    a, b, c, d = (n * (2 * rows + 1) + m for n, m in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
    faces = np.concatenate([np.stack([a, b, c], -1)[i < rows - 1], np.stack([a, c, d], -1)[i > 0]])
    if np.linalg.det(axes) < 0:
        faces = faces[:, ::-1]
    return triangles(unit @ axes + s.center, faces, path, normals)


def both_sides(T, s, path):
    """Returns the two one-sided shapes of an open emissive shape. Exchanged edges flip the normal of the second shape."""
    if any(isinstance(c, scenes.Checker) and c.scale[0] != c.scale[1] for c in (s.material.color, s.material.diffuse, s.material.emission)):
        raise ValueError("a checker on an emissive shape needs equal scales for u and v")
    if isinstance(s, scenes.Triangles):
        a, b, c = np.array(s.vertices, float)
        n = np.cross(b - a, c - a)
        n *= SIDE_OFFSET / np.linalg.norm(n)
        return [triangles([a + n, b + n, c + n], [(0, 1, 2)], path + "-front.ply"),
                triangles([a - n, c - n, b - n], [(0, 1, 2)], path + "-back.ply")]
    kind = "disk" if isinstance(s, scenes.Disk) else "rectangle"
    n = np.cross(s.u, s.v)
    n *= SIDE_OFFSET / np.linalg.norm(n)
    return [rectangle(T, s.center + n, s.u, s.v, kind), rectangle(T, s.center - n, s.v, s.u, kind)]


def ellipsoids(shapes):
    """Returns one shape for all ellipsoids of a material."""
    # The singular value decomposition gives orthogonal half axes of the same ellipsoid.
    rotations, scales, _ = np.linalg.svd(np.array([[s.a, s.b, s.c] for s in shapes], float).transpose(0, 2, 1))
    rotations *= np.linalg.det(rotations)[:, None, None]
    return {"type": "ellipsoids", "centers": tensor([s.center for s in shapes]), "scales": tensor(scales),
            "quaternions": tensor([quaternion(rotation) for rotation in rotations]), "extent": 1.0, "extent_adaptive_clamping": False}


def tensor(values):
    return mi.TensorXf(np.array(values, np.float32))


def quaternion(rotation):
    w = np.sqrt(max(0, 1 + np.trace(rotation))) / 2
    if w > 1e-6:
        x, y, z = ((rotation[k, j] - rotation[j, k]) / (4 * w) for j, k in ((1, 2), (2, 0), (0, 1)))
    else:  # a rotation by 180 degrees about the eigenvector of eigenvalue 1
        w, (x, y, z) = 0, np.linalg.eigh(rotation + rotation.T)[1][:, -1]
    return [x, y, z, w]


def mesh_file(s):
    kind = os.path.splitext(s.file)[1]
    if kind not in (".ply", ".obj"):
        raise ValueError(f"{s.file}: the comparison supports only PLY and OBJ files")
    # The benchmark files have no normals. Without normals, wgray's default is flat shading, Mitsuba's is smooth.
    return {"type": kind[1:], "filename": s.file, "face_normals": s.normals in (None, "flat")}


def sensor(T, scene, width, height, spp):
    film = {"film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": spp}}
    to_world = T().look_at(origin=scene.position, target=scene.look_at, up=scene.up)
    if scene.view_height is None and scene.lens:
        diameter, distance = scene.lens
        return film | {"type": "thinlens", "fov": scene.fov, "fov_axis": "y", "to_world": to_world, "aperture_radius": diameter / 2,
                       "focus_distance": float(distance)}
    if scene.view_height is None:
        return film | {"type": "perspective", "fov": scene.fov, "fov_axis": "y", "to_world": to_world}
    # The view of Mitsuba's orthographic camera is -1 to 1 along x, and this range divided by the aspect ratio along y.
    half = scene.view_height / 2 * width / height
    return film | {"type": "orthographic", "near_clip": 1e-4, "to_world": to_world @ T().scale([half, half, 1])}


def lights(T, scene):
    for l in scene.lights:
        if isinstance(l, scenes.PointLight):
            yield {"type": "point", "position": l.position, "intensity": color_texture(l.color)}
        elif isinstance(l, scenes.SpotLight):
            up = np.eye(3)[int(np.argmin(np.abs(l.direction)))]
            to_world = T().look_at(origin=l.position, target=list(np.add(l.position, l.direction)), up=list(up))
            yield {"type": "spot", "to_world": to_world, "intensity": color_texture(l.color), "cutoff_angle": l.angle, "beam_width": 0.9999 * l.angle}
        elif isinstance(l, scenes.DirectionalLight):
            yield {"type": "directional", "direction": l.direction, "irradiance": color_texture(l.color)}
        else:
            # Mitsuba's light falls off with distance and the cosine at the light; 20 gives about the same brightness.
            radiance = l.color if scene.integrator == "path" else scenes.scaled(l.color, 20)
            yield rectangle(T, l.center, l.u, l.v) | {"bsdf": BLACK, "emitter": {"type": "area", "radiance": color_texture(radiance)}}


def integrator(scene, light_samples):
    if scene.integrator != "path":
        return {"type": "direct", "emitter_samples": light_samples * len(scene.lights), "bsdf_samples": 0}
    absorbs = any(s.material.absorption and any(s.material.absorption) for s in scene.shapes)
    return {"type": "volpath" if absorbs else "path", "max_depth": scene.max_depth + 1, "rr_depth": scene.rr_depth + 1}


def load(scene, size, spp, light_samples, curved="auto", exact=False):
    """Returns the Mitsuba scene. `curved` is the value of --ellipsoids; `exact` selects wgray's rough BSDFs
    (mitsuba_ggx.py)."""
    T = mi.ScalarTransform4f
    folder = tempfile.mkdtemp()
    width, height = size or (scene.width, scene.height)
    traced = scene.integrator == "path"
    if traced:
        mitsuba_phong.register()
        mitsuba_ggx.register()
    parts = {"type": "scene", "integrator": integrator(scene, light_samples), "sensor": sensor(T, scene, width, height, spp)}
    if scene.environment and (isinstance(scene.environment, scenes.EnvironmentMap) or any(scene.environment)):
        parts["environment"] = environment_emitter(T, scene.environment)
    bsdfs = {}  # by material, so that shapes share them

    def with_material(row, material):
        name = bsdfs.setdefault(id(material), f"material{len(bsdfs)}")
        parts.setdefault(name, bsdf(material, traced, exact))
        row = row | {"bsdf": {"type": "ref", "id": name}}
        if is_emissive(material):
            row["emitter"] = {"type": "area", "radiance": color_texture(material.emission)}
        if material.absorption and any(material.absorption):
            scale = max(material.absorption)  # a medium's colours are at most 1, its scale is unlimited; 0 gives NaN
            row["interior"] = {"type": "homogeneous", "albedo": color_texture([0, 0, 0]), "scale": float(scale),
                               "sigma_t": color_texture([max(a / scale, 1e-6) for a in material.absorption])}
        return row

    all_ellipsoids = [s for s in scene.shapes if isinstance(s, scenes.Ellipsoid)]
    if curved == "auto":
        curved = "exact" if len(all_ellipsoids) > MAX_SPHERES else "spheres"
    by_material = collections.defaultdict(list)
    for s in all_ellipsoids if curved == "exact" else []:
        by_material[id(s.material)].append(s)
    for i, group in enumerate(by_material.values()):
        parts[f"ellipsoids{i}"] = with_material(ellipsoids(group), group[0].material)
    use_counts = collections.Counter((s.file, id(s.material)) for s in scene.shapes if isinstance(s, scenes.Mesh))
    groups = {}  # names of shape groups
    for i, s in enumerate(scene.shapes):
        path = os.path.join(folder, str(i))
        has_checker = any(isinstance(c, scenes.Checker) for c in vars(s.material).values())
        if has_checker and not isinstance(s, scenes.Quad):
            raise ValueError("other renderers support checkers only on rectangles")
        if is_emissive(s.material) and (isinstance(s, (scenes.Quad, scenes.Disk)) or isinstance(s, scenes.Triangles) and len(s.faces) == 1):
            for side, row in zip(("front", "back"), both_sides(T, s, path)):
                parts[f"shape{i}{side}"] = with_material(row, s.material)
            continue
        if isinstance(s, (scenes.Quad, scenes.Disk)):
            row = rectangle(T, s.center, s.u, s.v, "disk" if isinstance(s, scenes.Disk) else "rectangle")
        elif isinstance(s, scenes.Triangles):
            row = triangles(s.vertices, s.faces, path + ".ply")
        elif isinstance(s, scenes.Ellipsoid):
            if curved == "exact":
                continue
            row = sphere(T, s) if curved == "spheres" else round_mesh(T, s, path + ".ply")
        elif isinstance(s, scenes.Mesh):
            key = (s.file, id(s.material))
            to_world = T(np.array([*s.to_world, [0, 0, 0, 1]]))
            if use_counts[key] == 1 or is_emissive(s.material):  # Mitsuba has no emissive instances
                row = mesh_file(s) | {"to_world": to_world}
            else:
                if key not in groups:
                    groups[key] = f"group{len(groups)}"
                    parts[groups[key]] = {"type": "shapegroup", "mesh": with_material(mesh_file(s), s.material)}
                parts[f"shape{i}"] = {"type": "instance", "group": {"type": "ref", "id": groups[key]}, "to_world": to_world}
                continue
        else:
            axis = np.eye(3)[int(np.argmin(np.abs(s.normal)))]
            u = np.cross(s.normal, axis)
            u *= 1000 / np.linalg.norm(u)
            row = rectangle(T, s.point, u, np.cross(s.normal, u))
        parts[f"shape{i}"] = with_material(row, s.material)
    for i, row in enumerate(lights(T, scene)):
        parts[f"light{i}"] = row
    return mi.load_dict(parts)


def is_emissive(material):
    return isinstance(material.emission, scenes.Checker) or any(material.emission or [])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--integrator", choices=["phong", "path"], default="phong")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--size", type=int)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--light-samples", type=int, default=16, help="per light")
    parser.add_argument("--warm", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0, help="seed of the first image; each further image uses the next one")
    parser.add_argument("--ellipsoids", choices=["auto", "spheres", "exact", "mesh"], default="auto")
    parser.add_argument("-o", "--output", help="file of the last image")
    parser.add_argument("--each", metavar="FOLDER", help="write the image of each render after the first to this folder, named by its seed")
    args = parser.parse_args()

    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)  # warnings go to standard output, before the line of JSON
    scene = scenes.load(args.scene, args.integrator)
    size = (args.size, args.size) if args.size else (scene.width, scene.height)
    start = time.perf_counter()
    loaded = load(scene, size, args.spp, args.light_samples, args.ellipsoids)
    load_s = time.perf_counter() - start
    times = []
    for n in range(1 + args.warm):
        start = time.perf_counter()
        render = mi.render(loaded, spp=args.spp, seed=args.seed + n)
        image = np.array(render)  # waits for the result
        times.append(time.perf_counter() - start)
        if args.each and n:
            mi.util.write_bitmap(os.path.join(args.each, f"{args.seed + n}.exr"), render, write_async=False)
    if not np.isfinite(image).all() or not image.mean() > 0.01 and min(size) > 1:
        sys.exit("Mitsuba's image is black or not finite")
    if args.output:
        mi.util.write_bitmap(args.output, render, write_async=False)
    total = args.light_samples * len(scene.lights)
    print(json.dumps({"renderer": f"Mitsuba {mi.__version__} {args.variant}", "width": size[0], "height": size[1],
                      "pixel_samples": args.spp, "light_samples": total, "load_s": load_s, "first_s": times[0],
                      "warm_s": statistics.median(times[1:]) if args.warm else None}))


if __name__ == "__main__":
    main()

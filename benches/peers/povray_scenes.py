#!/usr/bin/env python3
"""Converts a wgray scene to a scene of POV-Ray 3.7 on standard output: povray_scenes.py SCENE.toml LIGHT_SAMPLES [SIZE]

Shading is Phong without distance falloff; lights are invisible to the camera. POV-Ray's Phong highlight has the light's
colour, so `specular` is treated as white. A POV-Ray pigment has one colour, so the ambient and diffuse colours of a
material must be equal.

An area light is converted in one of two ways. POV-Ray's `area_light` is faster and is used for timing. POV-Ray then
multiplies the mean visibility by the mean shading, `mean(V) * mean(f)`, whereas wgray computes `mean(V * f)`: the images
differ in penumbrae. A point light for each light sample gives wgray's formula.
"""
import math
import struct
import sys

sys.dont_write_bytecode = True
import scenes


def vec(v):
    return "<" + ",".join(f"{x:.9g}" for x in v) + ">"


def add(*vs):
    return [sum(xs) for xs in zip(*vs)]


def texture(material, ambient):
    if material.ambient != material.diffuse:
        raise ValueError("POV-Ray has one pigment: ambient and diffuse must be the same colour")
    return (f"texture {{ pigment {{ rgb {vec(material.diffuse)} }} "
            f"finish {{ ambient rgb {vec(ambient)} diffuse 1 phong 1 phong_size {material.shininess:g} }} }}")


def shape(s, ambient):
    pov_texture = texture(s.material, ambient)
    if isinstance(s, scenes.Plane):
        return f"plane {{ {vec(s.normal)}, {scenes.dot(s.normal, s.point):.9g} {pov_texture} }}"
    if isinstance(s, scenes.Ellipsoid):
        matrix = ", ".join(f"{x:.9g}" for v in (s.a, s.b, s.c, s.center) for x in v)
        return f"sphere {{ 0, 1 matrix <{matrix}> {pov_texture} }}"
    if isinstance(s, scenes.Quad):
        corners = [add(s.center, scenes.scaled(s.u, i), scenes.scaled(s.v, j)) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        s = scenes.Triangles(corners, [(0, 1, 2), (0, 2, 3)], s.material)
    if isinstance(s, scenes.Mesh):
        return mesh(s, pov_texture)
    faces = " ".join(f"triangle {{ {', '.join(vec(s.vertices[i]) for i in face)} }}" for face in s.faces)
    return f"mesh {{ {faces} {pov_texture} }}"


def mesh(s, pov_texture):
    """Returns a `mesh2` of flat-shaded triangles, because wgray renders a file without normals with flat shading."""
    vertices, triangles = read_ply(s.file)
    rows = ", ".join(f"<{x:.9g},{y:.9g},{z:.9g}>" for x, y, z in vertices)
    faces = ", ".join(f"<{a},{b},{c}>" for a, b, c in triangles)
    columns = ", ".join(f"{s.to_world[i][j]:.9g}" for j in range(4) for i in range(3))
    return (f"mesh2 {{ vertex_vectors {{ {len(vertices)}, {rows} }} face_indices {{ {len(triangles)}, {faces} }} "
            f"matrix <{columns}> {pov_texture} }}")


def read_ply(file):
    """Returns the vertices and triangles of a binary PLY file as examples/make_mesh.rs writes it."""
    with open(file, "rb") as f:
        header, _, body = f.read().partition(b"end_header\n")
    lines = header.decode("ascii").splitlines()
    if lines[1:2] != ["format binary_little_endian 1.0"] or [line.split()[-1] for line in lines[3:6]] != ["x", "y", "z"]:
        raise ValueError(f"{file}: must be a binary PLY file of positions and triangles")
    counts = [int(line.split()[2]) for line in lines if line.startswith("element")]
    vertices = list(struct.iter_unpack("<3f", body[:12 * counts[0]]))
    triangles = [row[1:] for row in struct.iter_unpack("<B3i", body[12 * counts[0]:])]
    if len(triangles) != counts[1]:
        raise ValueError(f"{file}: has {len(triangles)} triangles; there must be {counts[1]}")
    return vertices, triangles


def light(l, samples, points):
    n = math.isqrt(samples)
    if n * n != samples or n < 2:
        raise ValueError(f"{samples} light samples: must be a square number of at least 4")
    if points:
        cells = [(2 * i + 1) / n - 1 for i in range(n)]
        colour = vec(scenes.scaled(l.color, 1 / samples))
        return "\n".join(f"light_source {{ {vec(add(l.center, scenes.scaled(l.u, s), scenes.scaled(l.v, t)))} rgb {colour} }}"
                         for s in cells for t in cells)
    # POV-Ray samples an area light's axes from end to end; these ends are the outermost cell centres of wgray's grid.
    # With area_illumination, the shading uses all samples too; otherwise only the shadows do.
    axes = [vec(scenes.scaled(axis, 2 * (n - 1) / n)) for axis in (l.u, l.v)]
    return f"light_source {{ {vec(l.center)} rgb {vec(l.color)} area_light {axes[0]}, {axes[1]}, {n}, {n} area_illumination on }}"


def povray(scene, light_samples, width, height, points=False):
    # POV-Ray's angle is horizontal. It samples pixels at their centres, as wgray does (tested by povray_check.py).
    angle = 2 * math.degrees(math.atan(math.tan(math.radians(scene.fov) / 2) * width / height))
    return "\n".join([
        "#version 3.7;",
        "global_settings { assumed_gamma 1.0 ambient_light rgb 1 max_trace_level 5 }",
        # POV-Ray's axes are left-handed; the negative `right` makes them right-handed.
        f"camera {{ location {vec(scene.position)} right -x*{width}/{height} up y sky {vec(scene.up)} "
        f"angle {angle:.9g} look_at {vec(scene.look_at)} }}",
        *(light(l, light_samples, points) for l in scene.lights),
        *(shape(s, scene.ambient) for s in scene.shapes),
        "",
    ])


if __name__ == "__main__":
    scene = scenes.load(sys.argv[1])
    size = int(sys.argv[3]) if len(sys.argv) > 3 else None
    sys.stdout.write(povray(scene, int(sys.argv[2]), size or scene.width, size or scene.height))

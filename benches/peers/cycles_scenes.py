#!/usr/bin/env python3
"""Renders a wgray scene of the path tracer with Blender's Cycles on the CPU and prints one JSON line with the times.

    target/peers/cycles/bin/python cycles_scenes.py SCENE.toml [--size N] [--spp N] [--warm N] [--seed N] [-o FILE] [--each FOLDER]

Supports rectangles, triangles, ellipsoids and meshes with diffuse materials, rectangle lights, a constant environment
and a perspective camera. Ellipsoids become fine meshes; lights become meshes that emit on their front. Cycles counts bounces
after the first surface, so it gets `max_depth` - 1 bounces. Clamping, denoising, adaptive sampling and path guiding
are off; the pixel filter is a box. Cycles keeps its scene between images. `load_s`, `first_s` and `warm_s` are as in
mitsuba_scenes.py.
"""
import argparse
import json
import math
import os
import statistics
import sys
import tempfile
import time
import warnings

sys.dont_write_bytecode = True
warnings.simplefilter("ignore", DeprecationWarning)
import bpy
import mathutils

import scenes


def shader(name, color=None, radiance=None):
    """Returns a diffuse material, which emits on its front if `radiance` is given."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*(color or [0, 0, 0]), 1)
    out = nodes.new("ShaderNodeOutputMaterial")
    if not radiance:
        links.new(diffuse.outputs[0], out.inputs[0])
        return material
    material.cycles.emission_sampling = "FRONT"
    emission, mix, side = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeNewGeometry")
    emission.inputs["Color"].default_value = (*radiance, 1)
    links.new(side.outputs["Backfacing"], mix.inputs[0])
    links.new(emission.outputs[0], mix.inputs[1])
    links.new(diffuse.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], out.inputs[0])
    return material


def add(name, vertices, faces, material, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    if smooth:
        mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.update()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def add_quad(name, q, material):
    corners = [[c + s * u + t * v for c, u, v in zip(q.center, q.u, q.v)] for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    add(name, corners, [(0, 1, 2, 3)], material)


def add_ellipsoid(name, s, material, rows=64):
    unit = [(math.sin(math.pi * i / rows) * math.cos(math.pi * j / rows), math.sin(math.pi * i / rows) * math.sin(math.pi * j / rows),
             math.cos(math.pi * i / rows)) for i in range(rows + 1) for j in range(2 * rows)]
    vertex_index = lambda i, j: i * 2 * rows + j % (2 * rows)
    faces = [tuple(vertex_index(*k) for k in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))) for i in range(rows) for j in range(2 * rows)]
    add(name, [[c + x * a + y * b + z * d for c, a, b, d in zip(s.center, s.a, s.b, s.c)] for x, y, z in unit], faces, material, True)


def add_mesh(name, s, material):
    if s.file.endswith(".ply"):
        bpy.ops.wm.ply_import(filepath=s.file)
    else:
        bpy.ops.wm.obj_import(filepath=s.file, forward_axis="Y", up_axis="Z")
    imported = bpy.context.selected_objects[0]
    imported.matrix_world = mathutils.Matrix([*s.to_world, [0, 0, 0, 1]])
    imported.data.materials.clear()
    imported.data.materials.append(material)


def load(path, scene, size, spp):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    out = bpy.context.scene
    materials = {}

    def cycles_material(material):
        if material.kind != "diffuse" or not isinstance(material.color, list) or any(material.emission or []):
            raise ValueError(f"{path}: Cycles supports only diffuse materials of constant colour without emission")
        if id(material) not in materials:
            materials[id(material)] = shader("diffuse", material.color)
        return materials[id(material)]

    for i, s in enumerate(scene.shapes):
        name, material = f"shape{i}", cycles_material(s.material)
        if isinstance(s, scenes.Quad):
            add_quad(name, s, material)
        elif isinstance(s, scenes.Triangles):
            add(name, s.vertices, s.faces, material)
        elif isinstance(s, scenes.Ellipsoid):
            add_ellipsoid(name, s, material)
        elif isinstance(s, scenes.Mesh):
            add_mesh(name, s, material)
        else:
            raise ValueError(f"{path}: Cycles supports only rectangles, triangles, ellipsoids and meshes")
    for i, l in enumerate(scene.lights):
        if not isinstance(l, scenes.Quad):
            raise ValueError(f"{path}: Cycles supports only rectangle lights")
        add_quad(f"light{i}", l, shader("light", radiance=l.color))
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*(scene.environment or [0, 0, 0]), 1)
    out.world = world
    if scene.fov is None:
        raise ValueError(f"{path}: Cycles supports only perspective cameras")
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "VERTICAL", math.radians(scene.fov)
    camera.clip_start = 1e-3
    eye = bpy.data.objects.new("camera", camera)
    backward = scenes.unit(scenes.sub(scene.position, scene.look_at))
    right = scenes.unit(scenes.cross(scene.up, backward))
    columns = [right, scenes.cross(backward, right), backward, scene.position]
    eye.matrix_world = mathutils.Matrix([[c[i] for c in columns] for i in range(3)] + [[0, 0, 0, 1]])
    out.collection.objects.link(eye)
    out.camera = eye
    settings(out, scene, size, spp)
    return out


def settings(out, scene, size, spp):
    out.render.engine, out.cycles.device = "CYCLES", "CPU"
    out.render.resolution_x, out.render.resolution_y = size
    out.render.resolution_percentage, out.render.use_persistent_data = 100, True
    out.render.image_settings.file_format = "OPEN_EXR"
    out.render.image_settings.color_depth, out.render.image_settings.exr_codec = "32", "ZIP"
    out.view_settings.view_transform = "Standard"
    out.render.use_compositing = out.render.use_sequencer = False
    c, bounces = out.cycles, max(scene.max_depth - 1, 0)
    c.samples, c.use_adaptive_sampling, c.use_denoising, c.use_guiding = spp, False, False, False
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = bounces
    c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = 0
    c.min_light_bounces = scene.rr_depth
    c.pixel_filter_type = "BOX"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--size", type=int)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--warm", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0, help="seed of the first image; each further image uses the next one")
    parser.add_argument("--threads", type=int, help="default: all")
    parser.add_argument("-o", "--output", help="file of the last image")
    parser.add_argument("--each", metavar="FOLDER", help="write the image of each render after the first to this folder, named by its seed")
    args = parser.parse_args()

    scene = scenes.load(args.scene, "path")
    size = (args.size, args.size) if args.size else (scene.width, scene.height)
    start = time.perf_counter()
    out = load(args.scene, scene, size, args.spp)
    load_s = time.perf_counter() - start
    if args.threads:
        out.render.threads_mode, out.render.threads = "FIXED", args.threads
    times, folder = [], tempfile.mkdtemp()
    # Blender logs to standard output, which must contain only the line of JSON.
    stdout, silent = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    for n in range(1 + args.warm):
        out.cycles.seed = args.seed + n
        output = args.output if args.output and n == args.warm else None
        if output and not output.endswith(".exr"):
            out.render.image_settings.file_format = "PNG"
        out.render.filepath = output or os.path.join(args.each if args.each and n else folder, f"{args.seed + n}.exr")
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        times.append(time.perf_counter() - start)
    sys.stdout.flush()
    os.dup2(stdout, 1)
    print(json.dumps({"renderer": f"Cycles {bpy.app.version_string}, CPU", "width": size[0], "height": size[1], "pixel_samples": args.spp,
                      "load_s": load_s, "first_s": times[0], "warm_s": statistics.median(times[1:]) if args.warm else None}))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Renders small glTF scenes with wgray and with Blender's Cycles, which reads the same files, and compares the images.

    benches/peers/gltf_cycles.py [NAME...] [--size N] [--spp N] [--wgray FILE] [--out FOLDER]

Camera and environment are the same in both renderers. Lights come from the file; their units are not converted (Blender's
"unitless" lighting). Prints the RMSE and FLIP of each pair of images. The images, and a PNG of each pair and its
difference, are written to the folder (default: target/gltf-cycles).
"""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import time

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent

SCENE = """image = {{ width = {size}, height = {size} }}
camera = {{ position = {position}, look_at = {target}, fov = {fov} }}
[render]
integrator = "path"
max_depth = 16
pixel_samples = {{ pattern = "sobol", count = {spp} }}
[environment]
color = {sky}
[[shapes]]
type = "gltf"
file = "{name}.glb"
"""


def cycles(job):
    """Renders a job with Cycles and returns the seconds of rendering; runs in Blender's Python."""
    import bpy
    import mathutils

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=job["file"], export_import_convert_lighting_mode="COMPAT", import_shading="NORMALS")
    out = bpy.context.scene
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    if "map" in job:
        texture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        texture.image = bpy.data.images.load(job["map"])
        world.node_tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    else:
        background.inputs["Color"].default_value = (*job["sky"], 1)
    out.world = world
    # The lights of the file have no size.
    for light in bpy.data.lights:
        if light.type == "SUN":
            light.angle = 0
        else:
            light.shadow_soft_size = 0
    # Blender's importer uses (1 - colour) / distance as the absorption coefficient instead of -ln(colour) / distance
    # (KHR_materials_volume). The loop sets the coefficient that the extension defines.
    for material in bpy.data.materials:
        for node in material.node_tree.nodes if material.node_tree else ():
            if node.bl_idname == "ShaderNodeVolumeAbsorption":
                color, density = node.inputs["Color"].default_value, node.inputs["Density"].default_value
                absorption = [-math.log(max(color[k], 1e-6)) * density for k in range(3)]
                density = max(*absorption, 1e-9)
                node.inputs["Density"].default_value = density
                node.inputs["Color"].default_value = (*(1 - x / density for x in absorption), 1)
    camera = bpy.data.cameras.new("eye")
    camera.sensor_fit, camera.angle, camera.clip_start = "VERTICAL", math.radians(job["fov"]), 1e-3
    eye = bpy.data.objects.new("eye", camera)
    position, target = mathutils.Vector(job["position"]), mathutils.Vector(job["target"])
    eye.matrix_world = mathutils.Matrix.Translation(position) @ (target - position).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    out.collection.objects.link(eye)
    out.camera = eye
    out.render.engine, out.cycles.device = "CYCLES", "CPU"
    out.render.resolution_x = out.render.resolution_y = job["size"]
    out.render.image_settings.file_format = "OPEN_EXR"
    out.render.image_settings.color_depth, out.render.image_settings.exr_codec = "32", "ZIP"
    out.view_settings.view_transform = "Standard"
    out.render.use_compositing = out.render.use_sequencer = False
    c = out.cycles
    c.samples, c.use_adaptive_sampling, c.use_guiding = job["spp"], False, False
    c.use_denoising, c.denoiser, c.denoising_input_passes = job.get("denoise", False), "OPENIMAGEDENOISE", "RGB_ALBEDO_NORMAL"
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = job.get("bounces", 15)
    c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = 0
    c.pixel_filter_type, c.seed = job.get("filter", "BOX"), job.get("seed", 0)
    out.render.filepath = job["output"]
    start = time.monotonic()
    bpy.ops.render.render(write_still=True)
    return time.monotonic() - start


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--cycles":
        return cycles(json.loads(sys.argv[2]))
    import gltf_scenes
    import install

    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("names", nargs="*")
    options.add_argument("--size", type=int, default=256)
    options.add_argument("--spp", type=int, default=256)
    options.add_argument("--wgray", default=ROOT / "target/release/wgray")
    options.add_argument("--out", default=ROOT / "target/gltf-cycles")
    args = options.parse_args()
    folder = pathlib.Path(args.out)
    folder.mkdir(parents=True, exist_ok=True)
    python = install.Peers().cycles()
    for name, file, position, target, fov, sky in gltf_scenes.all_scenes():
        if args.names and name not in args.names:
            continue
        (folder / f"{name}.glb").write_bytes(file.glb())
        values = {"name": name, "position": position, "target": target, "fov": fov, "sky": sky, "size": args.size, "spp": args.spp}
        (folder / f"{name}.toml").write_text(SCENE.format(**values))
        ours, theirs = folder / f"{name}-wgray.exr", folder / f"{name}-cycles.exr"
        command = [args.wgray, "render", folder / f"{name}.toml", "-o", ours, "-o", ours.with_suffix(".png"), "--device", "cpu"]
        subprocess.run([str(part) for part in command], check=True, capture_output=True)
        values |= {"file": str(folder / f"{name}.glb"), "output": str(theirs)}
        with open(os.devnull, "w") as silent:
            subprocess.run([python, __file__, "--cycles", json.dumps(values)], check=True, stdout=silent)
        command = [args.wgray, "diff", theirs, ours, "--layers", "color", "--out", folder / f"{name}-diff.png", "--json"]
        report = json.loads(subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, text=True).stdout)
        color = report["layers"][0]
        print(f"{name}: RMSE {color['rmse']:.4f}, FLIP {color['flip']:.4f}", flush=True)


if __name__ == "__main__":
    main()

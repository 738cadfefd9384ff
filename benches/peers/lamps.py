#!/usr/bin/env python3
"""Compares one light in a room with a thousand lights of the same total power; prints a Markdown table.

Each row is for a kind of light, a device and a number of lights. The columns are the mean of the images, the render
time, the error, the time to reach the same error as with one light, and the ratio of that time to the time with one light.

Run it as `target/peers/venv/bin/python benches/peers/lamps.py --wgray target/release/wgray`.

The error is the relative error of `path_error.py`: the relative variance between images with different seeds is averaged
over the pixels; the error is the square root of the average. The time is the minimum of the render times in `--stats`, which exclude compilation. A light is a rectangle
that faces down, an emissive sphere or a point light. It is invisible to the camera, because the noise of a small
visible light would dominate the error. A thousand lights are spread through the room, one per cell of a grid of 10 x 10
x 10.
"""
import argparse
import json
import pathlib
import random
import subprocess
import tempfile

import numpy as np
import OpenEXR

ROOM = """[image]
width = {size}
height = {size}
[camera]
position = [0, -3.9, 1.6]
look_at = [0, 0, 1.2]
fov = 60
[render]
integrator = "path"
max_depth = {depth}
pixel_samples = {{ count = {spp} }}
[materials]
white = {{ type = "diffuse", color = [0.7, 0.7, 0.7] }}
red = {{ type = "diffuse", color = [0.7, 0.2, 0.2] }}
blue = {{ type = "diffuse", color = [0.2, 0.3, 0.7] }}
light = {{ type = "diffuse", color = [0, 0, 0], emission = [{radiance}, {radiance}, {radiance}], visible = false }}
dark = {{ type = "diffuse", color = [0.7, 0.7, 0.7], visible = false }}
"""

WALLS = [
    ("white", [0, 0, 0], [4, 8], [0, 0, 1], [1, 0, 0]),
    ("white", [0, 0, 3], [4, 8], [0, 0, -1], [1, 0, 0]),
    ("red", [-2, 0, 1.5], [8, 3], [1, 0, 0], [0, 1, 0]),
    ("blue", [2, 0, 1.5], [8, 3], [-1, 0, 0], [0, 1, 0]),
    ("white", [0, 4, 1.5], [4, 3], [0, -1, 0], [1, 0, 0]),
    ("white", [0, -4, 1.5], [4, 3], [0, 1, 0], [1, 0, 0]),
    ("white", [-0.8, 1.2, 0.5], [0.9, 0.9], [0.3, -1, 0.4], [1, 0.3, 0]),
    ("white", [0.7, 0.4, 0.4], [0.7, 0.8], [-0.4, -1, 0], [1, -0.4, 0]),
]
RADIANCE = 40
AREA = 0.25


def positions(count):
    """Returns the positions of the lights: a point below the center of the ceiling for one light, otherwise a random point in
    each cell of a grid."""
    if count == 1:
        return [(0, 0, 2.7)]
    side = round(count ** (1 / 3))
    generator = random.Random(7)
    cells = [(i, j, k) for i in range(side) for j in range(side) for k in range(side)]
    return [tuple(low + (high - low) * (index + 0.1 + 0.8 * generator.random()) / side
                  for index, low, high in zip(cell, (-1.9, -3.9, 0.3), (1.9, 3.9, 2.9))) for cell in cells]


def light(kind, count, position):
    """Returns the TOML text of one of `count` lights."""
    center = f"[{', '.join(f'{x:.4f}' for x in position)}]"
    area = AREA / count
    if kind == "rectangle":
        side = area ** 0.5
        return (f'[[lights]]\ntype = "rectangle"\ncenter = {center}\nsize = [{side}, {side}]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\n'
                f"color = [{RADIANCE}, {RADIANCE}, {RADIANCE}]\nvisible = false\n")
    if kind == "sphere":
        return f'[[shapes]]\ntype = "sphere"\nmaterial = "light"\ncenter = {center}\nradius = {(area / 4 / np.pi) ** 0.5}\n'
    power = RADIANCE * area / 4
    return f'[[lights]]\ntype = "point"\nposition = {center}\ncolor = [{power}, {power}, {power}]\n'


def dark_sphere(kind, position):
    """Returns a non-emissive sphere of the size of one of a thousand lights; nothing for point lights."""
    if kind == "point":
        return ""
    return light("sphere", 1000, position).replace('"light"', '"dark"')


def scene(kind, count, arguments):
    walls = "".join(f'[[shapes]]\ntype = "rectangle"\nmaterial = "{material}"\ncenter = {center}\nsize = {size}\nnormal = {normal}\n'
                    f"tangent = {tangent}\n" for material, center, size, normal, tangent in WALLS)
    head = ROOM.format(size=arguments.size, depth=arguments.depth, spp=arguments.spp, radiance=RADIANCE)
    spheres = "".join(dark_sphere(kind, position) for position in positions(1000)) if arguments.dark and count == 1 else ""
    return head + walls + spheres + "".join(light(kind, count, position) for position in positions(count))


def render(folder, text, seed, device, arguments):
    """Returns the image and the statistics of its render."""
    (folder / "room.toml").write_text(text)
    command = [arguments.wgray, "render", str(folder / "room.toml"), "-o", str(folder / "room.exr"), "--seed", str(seed),
               "--device", device, "--stats", str(folder / "stats.json"), "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    channels = OpenEXR.File(str(folder / "room.exr"), separate_channels=True).channels()
    image = np.stack([channels[c].pixels for c in "RGB"], -1).astype(float)
    return image, json.loads((folder / "stats.json").read_text())


def measure(folder, text, device, arguments):
    """Returns the shortest time, the relative error and the mean of the images of a scene."""
    images, seconds = [], []
    for seed in range(1, 1 + arguments.pictures):
        image, stats = render(folder, text, seed, device, arguments)
        images.append(image)
        seconds.append(stats["render_s"])
    images = np.array(images)
    variance = images.var(0, ddof=1).sum(-1)
    relative = variance / ((images.mean(0) ** 2).sum(-1) + 1e-4)
    return min(seconds), float(np.sqrt(relative.mean())), float(images.mean())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wgray", default="target/release/wgray")
    parser.add_argument("--kinds", nargs="*", default=["rectangle", "sphere", "point"])
    parser.add_argument("--counts", nargs="*", type=int, default=[1, 1000])
    parser.add_argument("--devices", nargs="*", default=["cpu", "lavapipe"])
    parser.add_argument("--dark", action="store_true",
                        help="add a thousand non-emissive spheres to the room with one light")
    parser.add_argument("--pictures", type=int, default=4)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--depth", type=int, default=4)
    arguments = parser.parse_args()
    print("| lights | device | count | mean | seconds | error | seconds at the error of one light | ratio |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        for kind in arguments.kinds:
            for device in arguments.devices:
                first = None
                for count in arguments.counts:
                    seconds, error, mean = measure(pathlib.Path(name), scene(kind, count, arguments), device, arguments)
                    first = first or (seconds, error)
                    equal = seconds * (error / first[1]) ** 2
                    print(f"| {kind} | {device} | {count} | {mean:.4f} | {seconds:.3f} | {error:.4f} | {equal:.3f} | "
                          f"{equal / first[0]:.2f} |", flush=True)


if __name__ == "__main__":
    main()

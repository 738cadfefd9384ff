#!/usr/bin/env python3
"""Compares wgray's view transforms with their specifications and with Blender's view transforms.

    benches/peers/view_check.py [--wgray PROGRAM] [--count N] [--figure docs/output/views.png]

The first run installs PyPI's bpy, for Blender's OpenColorIO configuration, and opencolorio, OpenEXR, numpy and pypng
into target/peers. wgray renders a card of N colours, from 2^-12 to 2^7, including greys, as a linear EXR and, with
every view transform and two exposures, as 16-bit PNGs. For each PNG, the values of the EXR are transformed in two ways:

    formula   in numpy, by the published formula: the PNG must agree to 2e-5 everywhere, 1.3 steps of 16 bits
    Blender   by OpenColorIO with Blender's tables, which interpolate between at most 57 points per axis: the mean
              difference must be at most 0.003, and 99 % of the values must agree to 0.03. Blender has no gamma22

--figure renders the box of scenes/cornell-path.toml, three stops brighter, and twelve hues from 2^-4 to 2^5, under each
transform.

Exit status 1 if a PNG fails, or, as a control, if it passes for another transform or for an exposure 0.01 stops higher.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
import install

PACKAGES = ["opencolorio==2.6.0", "OpenEXR", "numpy", "pypng"]
if "WGRAY_VIEW_CHECK" not in os.environ:
    peers = install.Peers()
    python = peers.environment("views", PACKAGES)
    blender = pathlib.Path(peers.cycles()).parent.parent
    os.execve(python, [python, *sys.argv], os.environ | {"WGRAY_VIEW_CHECK": str(blender)})

import numpy as np
import OpenEXR
import png
import PyOpenColorIO as ocio

CARD_WIDTH = 512


def card(count):
    """Returns an image of linear colours: greys, corners of the RGB cube, and random colours."""
    random = np.random.default_rng(1)
    stops = random.uniform(-12, 7, (count, 1))
    colors = random.uniform(0, 1, (count, 3)) ** random.choice([1, 4], (count, 1)) * 2.0**stops
    greys = np.repeat(np.geomspace(2.0**-14, 2.0**7, CARD_WIDTH)[:, None], 3, 1)
    corners = np.array([[r, g, b] for r in (0, 1) for g in (0, 1) for b in (0, 1)]) * 1.0
    all_colors = np.concatenate([greys, corners, corners * 8, colors])
    all_colors = all_colors[: len(all_colors) // CARD_WIDTH * CARD_WIDTH]
    return all_colors.reshape(-1, CARD_WIDTH, 3).astype(np.float32)


SCENE = """image = {{ width = {width}, height = {height} }}
camera = {{ type = "orthographic", position = [0, 0, 1], look_at = [0, 0, 0], up = [0, 1, 0], height = {height} }}
render = {{ integrator = "path", max_depth = 0, pixel_samples = {{ pattern = "grid", count = 1 }} }}
textures.card = {{ type = "image", file = "card.exr", filter = "nearest", encoding = "linear" }}
materials.card = {{ type = "diffuse", color = [0, 0, 0], emission = {{ texture = "card" }} }}
shapes = [{{ type = "rectangle", material = "card", center = [0, 0, 0], size = [{width}, {height}], normal = [0, 0, 1], tangent = [1, 0, 0] }}]
"""


# ---------------------------------------------------------------- published formulas


def srgb(light):
    """The transfer function of sRGB, by IEC 61966-2-1."""
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def neutral(light):
    """The formula of Khronos PBR Neutral."""
    minimum = light.min(1, keepdims=True)
    light = light - np.where(minimum < 0.08, minimum - 6.25 * minimum**2, 0.04)
    peak = light.max(1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        shown = 1 - 0.24**2 / (peak + 0.24 - 0.76)
        color_weight = 1 / (0.15 * (peak - shown) + 1)
        compressed = light * shown / peak * color_weight + shown * (1 - color_weight)
    return np.where(peak < 0.76, light, compressed)


def hsv(color):
    maximum, minimum = color.max(1), color.min(1)
    spread = np.where(maximum > minimum, maximum - minimum, 1)
    r, g, b = color.T
    hue = np.select([maximum == r, maximum == g], [(g - b) / spread % 6, (b - r) / spread + 2], (r - g) / spread + 4) / 6
    saturation = np.where(maximum > 0, (maximum - minimum) / np.where(maximum > 0, maximum, 1), 0)
    return np.where(maximum > minimum, hue, 0), saturation, maximum


def rgb(hue, saturation, value):
    def channel(n):
        k = (n + hue * 6) % 6
        return value * (1 - saturation * np.clip(np.minimum(k, 4 - k), 0, 1))

    return np.stack([channel(5), channel(3), channel(1)], 1)


def agx(light):
    """AgX as in AgX_LUT_Gen for Blender (AgXBaseRec2020.py), clipped to Rec. 709. The matrices are derived from the primaries and the
    white point."""
    to_rec2020 = np.array([[0.627403914, 0.329283038, 0.043313048], [0.069097292, 0.919540405, 0.011362303], [0.016391439, 0.088013308, 0.895595253]])
    inset = moved_primaries([2.13976149, -1.22827335, -3.05174246], [0.32965205, 0.28051336, 0.12475368])
    outset = np.linalg.inv(moved_primaries([0, 0, 0], [0.32317438, 0.28325605, 0.0374326]))
    light = light @ to_rec2020.T @ inset.T
    original_hue = hsv(light)[0]
    with np.errstate(divide="ignore"):
        x = np.clip((np.log2(light / 0.18) + 10) / 16.5, 0, 1)
    pivot, grey, slope, power = 10 / 16.5, 0.18 ** (1 / 2.4), 2.4, 1.5
    curve = np.empty_like(x)
    for above, width, height in ((True, 1 - pivot, 1 - grey), (False, pivot, grey)):
        scale = ((slope * width) ** -power * ((slope * width / height) ** power - 1)) ** (-1 / power)
        t = np.maximum((x - pivot if above else pivot - x) * slope / scale, 0)
        half = scale * t / (1 + t**power) ** (1 / power)
        curve = np.where((x >= pivot) == above, grey + half if above else grey - half, curve)
    hue, saturation, value = hsv(np.clip(curve, 0, 1) ** 2.4)
    hue = original_hue + 0.4 * ((hue - original_hue + 0.5) % 1 - 0.5)
    return rgb(hue % 1, saturation, value) @ outset.T @ np.linalg.inv(to_rec2020).T


def moved_primaries(degrees, fractions):
    """Returns the matrix to Rec. 2020 from moved primaries. Each primary of Rec. 2020 is rotated about the white point by an
    angle, along the edges of the triangle of primaries, and moved towards the white point by a fraction (working_space.py
    of AgX_LUT_Gen)."""
    white, corners = np.array([0.3127, 0.3290]), np.array([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]])
    moved = []
    for corner, degree, fraction in zip(corners, degrees, fractions):
        angle = np.radians(degree)
        rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        moved.append(white + to_edge(corners - white, rotation @ (corner - white)) * (1 - fraction))
    return np.linalg.inv(to_xyz(corners, white)) @ to_xyz(np.array(moved), white)


def to_edge(corners, direction):
    """Returns the vector in a direction from the origin to the edge of the triangle, which contains the origin."""
    distances = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        distance, edge_position = np.linalg.solve(np.array([direction, a - b]).T, a)
        if distance > 0 and -1e-9 <= edge_position <= 1 + 1e-9:
            distances.append(distance)
    return min(distances) * direction


def to_xyz(corners, white):
    columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in corners]).T
    target = np.array([white[0] / white[1], 1, (1 - white[0] - white[1]) / white[1]])
    return columns * np.linalg.solve(columns, target)


FORMULAS = {
    "gamma22": lambda light: np.clip(light, 0, 1) ** (1 / 2.2),
    "srgb": srgb,
    "agx": lambda light: srgb(agx(light)),
    "khronos-pbr-neutral": lambda light: srgb(neutral(light)),
}
BLENDER = {"srgb": "Standard", "agx": "AgX", "khronos-pbr-neutral": "Khronos PBR Neutral"}


def blender(name, light):
    """Applies the transform of Blender's configuration."""
    (path,) = pathlib.Path(os.environ["WGRAY_VIEW_CHECK"]).glob("lib/python*/site-packages/bpy/*/datafiles/colormanagement/config.ocio")
    config = ocio.Config.CreateFromFile(str(path))
    view = ocio.DisplayViewTransform(src="Linear Rec.709", display="sRGB", view=BLENDER[name])
    pixels = np.ascontiguousarray(light, np.float32)
    config.getProcessor(view).getDefaultCPUProcessor().applyRGB(pixels)
    return np.clip(pixels.astype(float), 0, 1)


# ---------------------------------------------------------------- wgray


def render(args, folder, name, *options):
    out = os.path.join(folder, name)
    subprocess.run([args.wgray, "render", os.path.join(folder, "card.toml"), "--device", "cpu", "-q", "-o", out, *options], check=True)
    if name.endswith(".exr"):
        channels = OpenEXR.File(out, separate_channels=True).channels()
        return np.stack([channels[c].pixels for c in "RGB"], -1).astype(float).reshape(-1, 3)
    _, _, rows, info = png.Reader(filename=out).read()
    assert info["bitdepth"] == 16, info
    return np.vstack([np.asarray(row) for row in rows]).reshape(-1, 3) / 65535


def hues(stops):
    """Returns the TOML text of a chart: hues along the rows, stops along the columns."""
    head = "image = { width = 240, height = 120 }\n"
    head += 'camera = { type = "orthographic", position = [0, 0, 1], look_at = [0, 0, 0], up = [0, 1, 0], height = 12 }\n'
    text = head + 'render = { integrator = "path", max_depth = 0, pixel_samples = { pattern = "grid", count = 4 } }\n'
    for row in range(12):
        for column, stop in enumerate(stops):
            color = (rgb(np.array([row / 12]), np.array([1]), np.array([1]))[0] * 2.0**stop).tolist()
            width = 24 / len(stops)
            text += f'[materials.m{row}_{column}]\ntype = "diffuse"\ncolor = [0, 0, 0]\nemission = {color}\n'
            text += f'[[shapes]]\ntype = "rectangle"\nmaterial = "m{row}_{column}"\ncenter = [{(column + 0.5) * width - 12}, {5.5 - row}, 0]\n'
            text += f"size = [{width}, 1]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n"
    return text


def figure(args, path):
    """Writes an image of two scenes under each transform, side by side."""
    columns = []
    with tempfile.TemporaryDirectory() as folder:
        scene, out = os.path.join(folder, "hues.toml"), os.path.join(folder, "out.png")
        pathlib.Path(scene).write_text(hues(range(-4, 6)))
        box = [str(install.ROOT / "scenes" / "cornell-path.toml"), "--size", "240x240", "--spp", "256", "--exposure", "3"]
        for name in FORMULAS:
            rows = []
            for options in (box, [scene]):
                subprocess.run([args.wgray, "render", *options, "--view-transform", name, "--device", "cpu", "-q", "-o", out], check=True)
                rows.append(np.vstack([np.asarray(row) for row in png.Reader(filename=out).read()[2]]).reshape(-1, 240, 3))
                rows.append(np.full((8, 240, 3), 255))
            columns += [np.concatenate(rows[:-1]), np.full((368, 8, 3), 255)]
    sheet = np.concatenate(columns[:-1], 1).astype(np.uint8)
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    png.from_array(sheet.reshape(len(sheet), -1), "RGB", {"size": sheet.shape[1::-1]}).save(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wgray", default=str(install.ROOT / "target" / "release" / "wgray"))
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--figure", metavar="FILE.png")
    args = parser.parse_args()
    if args.figure:
        return figure(args, args.figure)
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        colors = card(args.count)
        OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"RGB": colors}).write(os.path.join(folder, "card.exr"))
        pathlib.Path(folder, "card.toml").write_text(SCENE.format(width=colors.shape[1], height=colors.shape[0]))
        light = render(args, folder, "linear.exr")
        assert np.array_equal(light, colors.reshape(-1, 3)), "the image does not have the card's colours"
        print(f"{len(light)} colours\n")
        print("| transform | stops | largest from the formula | mean from Blender | 99 % within |\n| --- | --- | --- | --- | --- |")
        for name, formula in FORMULAS.items():
            for stops in (0, -1.25):
                displayed = render(args, folder, "displayed.png", "--bit-depth", "16", "--view-transform", name, "--exposure", str(stops))
                exposed = light * 2.0**stops
                error = np.abs(displayed - formula(exposed)).max()
                row, passes = [name, f"{stops}", f"{error:.1e}"], error < 2e-5
                if name in BLENDER:
                    difference = np.abs(displayed - blender(name, exposed))
                    mean, percentile = difference.mean(), np.quantile(difference, 0.99)
                    row, passes = [*row, f"{mean:.5f}", f"{percentile:.4f}"], passes and mean < 0.003 and percentile < 0.03
                else:
                    row += ["", ""]
                print("| " + " | ".join(row) + " |" + ("" if passes else " WRONG"))
                failed |= not passes
                for other_name, other_formula in FORMULAS.items():
                    for extra_stops in (0, 0.01):
                        if (other_name, extra_stops) == (name, 0):
                            continue
                        if np.abs(displayed - other_formula(exposed * 2.0**extra_stops)).max() < 2e-5:
                            print(f"{name} passes as {other_name} with {extra_stops} stops more")
                            failed = True
    sys.exit(failed)


main()

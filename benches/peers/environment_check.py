#!/usr/bin/env python3
"""Compares wgray's environment map, rotated and scaled, with Mitsuba's `envmap`.

    benches/peers/run --install-only                                        once
    target/peers/venv/bin/python benches/peers/environment_check.py         exit status 1 if they differ
    ... environment_check.py --wrong 1.02                                   wgray's images times 1.02: must fail

Two conventions differ. Up is +y in Mitsuba and the left edge of the image is at -z; in wgray these are +z and -x. The
axes are rotated accordingly. Mitsuba's first and last rows of texels are at the poles; wgray's are half a row away, and
a pole has the mean of the nearest row. Mitsuba therefore gets a copy of wgray's image, resampled to rows at
multiples of half a row, from pole to pole. Both renderers interpolate linearly between rows, so the copy represents the
same function. The means of blocks of pixels over a few seeds are compared in units of their standard errors.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
import install
os.environ |= install.Peers().mitsuba()[1]  # before the import, which loads LLVM

import mitsuba as mi
import numpy as np
import OpenEXR

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SIDE, WIDTH, HEIGHT, SEEDS, SAMPLES = 64, 64, 32, 8, 256
SPHERES = [("floor", [-1.3, 0, 0.6]), ("gold", [0, 0.3, 0.6]), ("glass", [1.3, 0, 0.6])]


def image():
    """Returns noise that is brighter in the upper half, with two bright texels."""
    texels = np.random.default_rng(1).random((HEIGHT, WIDTH, 3)) ** 4 * 2
    texels[:HEIGHT // 2] += [0.3, 0.5, 0.9]
    texels[8, 20] = [400, 300, 200]
    texels[20, 50] = [50, 60, 90]
    return texels.astype(np.float32)


def with_poles(texels):
    """Returns the image, resampled to rows at multiples of half a row, from pole to pole."""
    poles = [np.broadcast_to(row.mean(0), row.shape) for row in (texels[0], texels[-1])]
    nodes = np.concatenate([poles[0][None], texels, poles[1][None]])
    heights = np.concatenate([[0], (np.arange(HEIGHT) + 0.5) / HEIGHT, [1]])
    new_heights = np.arange(2 * HEIGHT + 1) / (2 * HEIGHT)
    columns = [np.stack([np.interp(new_heights, heights, nodes[:, x, c]) for c in range(3)], -1) for x in range(WIDTH)]
    return np.stack(columns, 1).astype(np.float32)


def wgray_scene():
    return f"""image = {{ width = {SIDE}, height = {SIDE} }}
camera = {{ position = [0, -5, 1.6], look_at = [0, 0, 0.8], fov = 40 }}
render = {{ integrator = "path", max_depth = 4, rr_depth = 1024, pixel_samples = {{ count = {SAMPLES}, pattern = "random" }} }}
environment = {{ file = "environment.exr", rotate = [20, 30, 40], scale = 1.5 }}
materials.floor = {{ type = "diffuse", color = [0.6, 0.5, 0.4] }}
materials.gold = {{ type = "conductor", color = [1, 0.8, 0.4] }}
materials.glass = {{ type = "dielectric", ior = 1.5 }}
[[shapes]]
type = "disk"
material = "floor"
center = [0, 0, 0]
radius = 3
normal = [0, 0, 1]
""" + "".join(f'[[shapes]]\ntype = "sphere"\nmaterial = "{m}"\ncenter = {c}\nradius = 0.6\n' for m, c in SPHERES)


def mitsuba_scene(texels):
    rotate = lambda axis, degrees: mi.ScalarTransform4f().rotate(axis, degrees)
    axes = mi.ScalarTransform4f(np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]]))
    rgb = lambda *color: {"type": "rgb", "value": list(color)}
    bsdfs = {
        "floor": {"type": "twosided", "inner": {"type": "diffuse", "reflectance": rgb(0.6, 0.5, 0.4)}},
        "gold": {"type": "conductor", "material": "none", "specular_reflectance": rgb(1, 0.8, 0.4)},
        "glass": {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0},
    }
    film = {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"}, "pixel_format": "rgb",
            "component_format": "float32"}
    shapes = {f"sphere{i}": {"type": "sphere", "center": c, "radius": 0.6, "bsdf": bsdfs[m]} for i, (m, c) in enumerate(SPHERES)}
    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 5, "rr_depth": 1000},
        "sensor": {"type": "perspective", "fov": 40, "fov_axis": "y", "film": film,
                   "to_world": mi.ScalarTransform4f().look_at([0, -5, 1.6], [0, 0, 0.8], [0, 0, 1]),
                   "sampler": {"type": "independent", "sample_count": SAMPLES}},
        "environment": {"type": "envmap", "bitmap": mi.Bitmap(with_poles(texels)), "scale": 1.5,
                   "to_world": rotate([0, 0, 1], 40) @ rotate([0, 1, 0], 30) @ rotate([1, 0, 0], 20) @ axes},
        "disk": {"type": "disk", "to_world": mi.ScalarTransform4f().scale(3), "bsdf": bsdfs["floor"]},
    } | shapes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wgray", default=str(ROOT / "target/release/wgray"))
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--wrong", type=float, default=1)
    args = parser.parse_args()
    mi.set_variant("scalar_rgb")
    texels = image()
    scene = mitsuba_scene(texels)
    images = ([], [])
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": texels}).write(str(folder / "environment.exr"))
        (folder / "scene.toml").write_text(wgray_scene())
        for seed in range(SEEDS):
            command = [args.wgray, "render", folder / "scene.toml", "-o", folder / "out.exr", "--device", args.device, "--quiet",
                       "--define", f"render.seed={seed + 1}"]
            subprocess.run(command, check=True)
            images[0].append(OpenEXR.File(str(folder / "out.exr")).channels()["RGB"].pixels * args.wrong)
            images[1].append(np.array(mi.render(scene, seed=seed)))
    all_agree = True
    for block in (8, 32, 64):
        count = SIDE // block
        block_means = [np.array(p, dtype=np.float64).reshape(SEEDS, count, block, count, block, 3).mean((2, 4)) for p in images]
        means = [values.mean(0) for values in block_means]
        error = np.sqrt(sum(values.var(0, ddof=1) / SEEDS for values in block_means))
        z = abs(means[0] - means[1]) / error
        # The limits, for 14 degrees of freedom, are 6 standard errors in any block and 2 in the root mean square of the blocks.
        agrees = z.max() < 6 and np.sqrt((z ** 2).mean()) < 2
        all_agree &= bool(agrees)
        print(f"blocks of {block}: largest difference {z.max():.2f} standard errors, root mean square {np.sqrt((z ** 2).mean()):.2f}, "
              f"largest relative difference {abs(means[0] / means[1] - 1).max():.4%}: {'agrees' if agrees else 'DIFFERS'}")
    sys.exit(not all_agree)


main()

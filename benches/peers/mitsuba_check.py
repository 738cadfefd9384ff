#!/usr/bin/env python3
"""Compares the depth and the Phong shading of wgray at pixel centres with Mitsuba's rays.

    benches/peers/run --install-only        once; `run` generates the scenes of generate.py
    target/peers/venv/bin/python benches/peers/mitsuba_check.py [--size N] [--wgray PROGRAM] [--device cpu] SCENE.toml...

Mitsuba's images cannot be compared directly with wgray's: its lights fall off with distance and are one-sided, and its
samples are random. Mitsuba therefore only traces the rays, from the pixel centres to the scene and from the hits to the
centres of the light's sample grid; Phong's formula is evaluated in numpy. The comparison with wgray's image at one
sample per pixel:

    coverage   the same pixels have a hit in both images, except at silhouettes
    depth      the distance along the ray agrees to a relative error of 1e-4, except at silhouettes, where the second difference of
               the depth exceeds 1 % of the smallest depth
    image      the means agree to 1 %, and 97 % of the pixels to 0.02 in every channel, in linear values

As a control, the first scene is compared again with Mitsuba's camera moved by 0.01; this comparison must fail. Exit
status 1 if it passes, or if a scene fails. Ellipsoids are Mitsuba's shape `ellipsoids`.
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

import scenes

SAMPLES, SIDE = 16, 4


def render_wgray(args, path, size):
    """Returns linear RGB and the depth, which is 0 for a miss."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "out.exr")
        subprocess.run([args.wgray, "render", path, "--size", f"{size}x{size}", "--spp", "1", "--light-samples", str(SAMPLES),
                        "--device", args.device, "--aov", "depth", "-q", "-o", out], check=True)
        channels = OpenEXR.File(out, separate_channels=True).channels()
        return np.stack([channels[c].pixels for c in "RGB"], -1).astype(float), channels["depth.Z"].pixels.astype(float)


def render_mitsuba(path, size, moved=0):
    """Like `render_wgray`, with Mitsuba's rays and a camera moved by `moved`; also returns the mask of visible lights."""
    import mitsuba_scenes
    scene = scenes.load(path)
    scene.position = [scene.position[0] + moved, *scene.position[1:]]
    loaded = mitsuba_scenes.load(scene, (size, size), 1, SAMPLES, curved="exact")
    y, x = np.mgrid[:size, :size]
    film = mi.Point2f(mi.Float(((x.ravel() + 0.5) / size).astype(np.float32)), mi.Float(((y.ravel() + 0.5) / size).astype(np.float32)))
    ray, _ = loaded.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    si = loaded.ray_intersect(ray)
    hit = np.array(si.is_valid())
    # Mitsuba's `t` is measured from the near clipping plane, so the distance to the camera is computed here.
    origin = np.array(scene.position)
    position = np.array(si.p).T.astype(float)
    depth = np.where(hit, np.linalg.norm(position - origin, axis=-1), 0)
    toward = np.array(ray.d).T.astype(float)
    n = np.array(si.n).T.astype(float)
    n = np.where((np.sum(n * toward, -1) > 0)[:, None], -n, n)
    on_light = np.array(mi.Bool(si.shape.is_emitter())) & hit
    # Materials are identified by their diffuse colour.
    materials = list({tuple(s.material.diffuse): s.material for s in scene.shapes}.values())
    albedo = np.array(si.bsdf().eval_diffuse_reflectance(si)).T
    material_index = np.argmin(abs(albedo[:, None] - np.array([m.diffuse for m in materials])).sum(-1), -1)
    pick = lambda term: np.array([getattr(m, term) for m in materials])[material_index]
    image = pick("ambient") * np.array(scene.ambient)
    kd, ks, power = pick("diffuse"), pick("specular"), pick("shininess")
    cells = 2 * (np.arange(SIDE) + 0.5) / SIDE - 1
    for light in scene.lights:
        for s in cells:
            for t in cells:
                point = np.array(light.center) + s * np.array(light.u) + t * np.array(light.v)
                to = point - position
                to /= np.linalg.norm(to, axis=-1, keepdims=True)
                shadow = np.array(loaded.ray_test(si.spawn_ray_to(mi.Point3f(*map(float, point)))))
                nl = np.sum(n * to, -1)
                mirrored = np.maximum(np.sum((to - 2 * nl[:, None] * n) * toward, -1), 0)
                value = kd * np.maximum(nl, 0)[:, None] + ks * (mirrored ** power)[:, None]
                image += np.where(((nl > 0) & ~shadow)[:, None], value * np.array(light.color) / SAMPLES, 0)
    image = np.where(hit[:, None], image, 0)
    return image.reshape(size, size, 3), depth.reshape(size, size), on_light.reshape(size, size)


def silhouettes(depth):
    """Returns the mask of pixels where the depth is not linear along a row or column: edges of surfaces."""
    a = np.pad(depth, 1, mode="reflect", reflect_type="odd")
    bend = np.maximum(abs(a[2:, 1:-1] - 2 * depth + a[:-2, 1:-1]), abs(a[1:-1, 2:] - 2 * depth + a[1:-1, :-2]))
    return bend > 0.01 * np.where(depth > 0, depth, np.inf).min()


def check(args, path, moved=0):
    ours, our_depth = render_wgray(args, path, args.size)
    theirs, depth, on_light = render_mitsuba(path, args.size, moved)
    edge = silhouettes(depth) | silhouettes(our_depth)
    coverage_differs = (our_depth > 0) != (depth > 0)
    hit_by_both = (our_depth > 0) & (depth > 0)
    depth_differs = hit_by_both & (abs(our_depth - depth) > 1e-4 * depth)
    off_light = ~on_light
    difference = abs(ours - theirs).max(-1)[off_light]
    mean, their_mean = ours[off_light].mean(), theirs[off_light].mean()
    close = (difference <= 0.02).mean()
    passes = (not (coverage_differs & ~edge).any() and not (depth_differs & ~edge).any()
              and abs(mean / their_mean - 1) <= 0.01 and close >= 0.97)
    print(f"{pathlib.Path(path).stem}{', camera moved' if moved else ''}: {'passes' if passes else 'FAILS'}; "
          f"{hit_by_both.mean():.1%} of pixels hit in both images, {coverage_differs.sum()} pixels in one only; wrong depths: {depth_differs.sum()}, "
          f"{(depth_differs & ~edge).sum()} of them not on silhouettes ({edge.mean():.1%} of pixels); means {mean:.5f} and {their_mean:.5f}, "
          f"{close:.2%} of pixels within 0.02", flush=True)
    return passes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="SCENE.toml")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--wgray", default=str(install.ROOT / "target/release/wgray"))
    parser.add_argument("--device", default="cpu")
    args = parser.parse_args()
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    all_pass = all([check(args, path) for path in args.scenes])
    sys.exit(not all_pass or check(args, args.scenes[0], moved=0.01))


if __name__ == "__main__":
    main()

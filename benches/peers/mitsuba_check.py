#!/usr/bin/env python3
"""Shows that wgray and Mitsuba see the same scene: the depth and the Phong shading of pixels' centres.

    benches/peers/run --install-only        once; scenes of generate.py are there after `run` has timed them
    target/peers/venv/bin/python benches/peers/mitsuba_check.py [--size N] [--wgray PROGRAM] [--device cpu] SCENE.toml...

Mitsuba's pictures themselves cannot be compared with wgray's: its lights fall off with distance and shine on one side,
and its samples are random. So Mitsuba traces the rays alone, from pixels' centres to the scene and from there to the centres
of the light's grid of samples, and Phong's formula is taken in numpy. Compared are, in wgray's picture with one sample a pixel,

    coverage   which pixels show anything
    depth      along the ray, within 1e-4 of it, but on silhouettes, where the depth bends by 1 % of the nearest
    picture    the mean, within 1 %, and the share of pixels within 0.02 in every channel, 97 %, in linear values

The first scene is compared once more with Mitsuba's camera moved by 0.01, which must fail. Exit status 1 if it does not, or if
another scene fails. Ellipsoids are compared as Mitsuba's shape `ellipsoids`.
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


def wgray(args, path, size):
    """Linear RGB and the depth, 0 where nothing is."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "out.exr")
        subprocess.run([args.wgray, "render", path, "--size", f"{size}x{size}", "--spp", "1", "--light-samples", str(SAMPLES),
                        "--device", args.device, "--aov", "depth", "-q", "-o", out], check=True)
        channels = OpenEXR.File(out, separate_channels=True).channels()
        return np.stack([channels[c].pixels for c in "RGB"], -1).astype(float), channels["depth.Z"].pixels.astype(float)


def mitsuba(path, size, moved=0):
    """The same by Mitsuba's rays, and where lights are seen; from a camera that is moved by so much."""
    import mitsuba_scenes
    scene = scenes.load(path)
    scene.position = [scene.position[0] + moved, *scene.position[1:]]
    loaded = mitsuba_scenes.load(scene, (size, size), 1, SAMPLES, curved="exact")
    y, x = np.mgrid[:size, :size]
    film = mi.Point2f(mi.Float(((x.ravel() + 0.5) / size).astype(np.float32)), mi.Float(((y.ravel() + 0.5) / size).astype(np.float32)))
    ray, _ = loaded.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    si = loaded.ray_intersect(ray)
    hit = np.array(si.is_valid())
    # Mitsuba's `t` counts from the near clipping plane, so the distance is taken from the camera.
    origin = np.array(scene.position)
    position = np.array(si.p).T.astype(float)
    depth = np.where(hit, np.linalg.norm(position - origin, axis=-1), 0)
    toward = np.array(ray.d).T.astype(float)
    n = np.array(si.n).T.astype(float)
    n = np.where((np.sum(n * toward, -1) > 0)[:, None], -n, n)
    on_light = np.array(mi.Bool(si.shape.is_emitter())) & hit
    # materials are told by their diffuse colour
    materials = list({tuple(s.material.diffuse): s.material for s in scene.shapes}.values())
    albedo = np.array(si.bsdf().eval_diffuse_reflectance(si)).T
    which = np.argmin(abs(albedo[:, None] - np.array([m.diffuse for m in materials])).sum(-1), -1)
    pick = lambda term: np.array([getattr(m, term) for m in materials])[which]
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
    """Pixels where the depth is not about linear, a row or a column through them: where another surface begins, or nothing."""
    a = np.pad(depth, 1, mode="reflect", reflect_type="odd")
    bend = np.maximum(abs(a[2:, 1:-1] - 2 * depth + a[:-2, 1:-1]), abs(a[1:-1, 2:] - 2 * depth + a[1:-1, :-2]))
    return bend > 0.01 * np.where(depth > 0, depth, np.inf).min()


def check(args, path, moved=0):
    ours, our_depth = wgray(args, path, args.size)
    theirs, depth, on_light = mitsuba(path, args.size, moved)
    edge = silhouettes(depth) | silhouettes(our_depth)
    other_cover = (our_depth > 0) != (depth > 0)
    deep = (our_depth > 0) & (depth > 0)
    off = deep & (abs(our_depth - depth) > 1e-4 * depth)
    plain = ~on_light
    difference = abs(ours - theirs).max(-1)[plain]
    mean, other_mean = ours[plain].mean(), theirs[plain].mean()
    close = (difference <= 0.02).mean()
    good = not (other_cover & ~edge).any() and not (off & ~edge).any() and abs(mean / other_mean - 1) <= 0.01 and close >= 0.97
    print(f"{pathlib.Path(path).stem}{', camera moved' if moved else ''}: {'good' if good else 'FAILS'}; "
          f"{deep.mean():.1%} of pixels hit by both, {other_cover.sum()} by one alone; depth off in {off.sum()} pixels, "
          f"{(off & ~edge).sum()} of them not on silhouettes ({edge.mean():.1%} are); means {mean:.5f} and {other_mean:.5f}, "
          f"{close:.2%} of pixels within 0.02", flush=True)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="SCENE.toml")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--wgray", default=str(install.ROOT / "target/release/wgray"))
    parser.add_argument("--device", default="cpu")
    args = parser.parse_args()
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    good = all([check(args, path) for path in args.scenes])
    sys.exit(not good or check(args, args.scenes[0], moved=0.01))


if __name__ == "__main__":
    main()

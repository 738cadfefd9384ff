#!/usr/bin/env python3
"""Tests that wgray's path tracer and Mitsuba's have the same expected value in each pixel.

    benches/peers/run --install-only                                    once
    target/peers/venv/bin/python benches/peers/path_check.py            all scenes, on the CPU
    ... path_check.py --device lavapipe --scenes diffuse,glass --save target/peers/images
    ... path_check.py --wgray none                                      Mitsuba against itself, with different seeds
    ... path_check.py --wrong 1.02                                      wgray's images times 1.02: every scene must fail

The scenes are those of path_scenes.py and scenes/cornell-path.toml. Both renderers render each scene BATCHES times with
different seeds, to estimate mean and variance of every pixel. Welch's t-test compares the means at three levels:
pixels, blocks of 8 x 8 pixels and the whole image, per channel. p-values are corrected for the number of tests of a
level (Šidák), and the bound of 1 % for the number of levels and scenes, so that a correct renderer fails with one seed in
a hundred. The standard error is at least 1e-5 of the mean, for rounding errors where the images have no
noise, and 1e-4 where an environment map is visible. Rough metal and glass are those of mitsuba_ggx.py. A scene also
fails

    if more than twice as many pixels are rejected at 1 % as expected by chance
    if the whole image, multiplied by --control (1.02), would also pass: the test is too insensitive, as for a black image
    for the course scenes: if a block differs by more than 2 %, or the whole image by more than 0.5 %

Exit status 1 if any scene fails. --save writes an image per scene: wgray's, Mitsuba's, and their difference, red where
wgray is brighter, blue where it is darker (full colour at 10 standard errors).
"""
import argparse
import dataclasses
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
import install
os.environ |= install.Peers().mitsuba()[1]  # before the import, which loads LLVM

import drjit as dr
import mitsuba as mi
import numpy as np
import OpenEXR
from scipy import stats

import path_scenes
import scenes

LEVEL, BLOCK, ROUNDING = 0.01, 8, 1e-5
MAP_ROUNDING = 1e-4  # where an environment map is visible: the error of Mitsuba's interpolation between texels
# Mitsuba selects lights uniformly, regardless of their power. With few samples the distribution of the means is so
# skewed that t-tests reject too often.
MORE_SAMPLES = {"many-lights": 8}


@dataclasses.dataclass
class Means:
    """The means over the batches of each pixel, block or image, and their squared standard errors."""
    mean: np.ndarray
    square: np.ndarray
    count: int


def means(batches):
    return Means(batches.mean(0), batches.var(0, ddof=1) / len(batches), len(batches))


def blocks(batches):
    n, height, width, channels = batches.shape
    h, w = height // BLOCK, width // BLOCK
    return batches[:, :h * BLOCK, :w * BLOCK].reshape(n, h, BLOCK, w, BLOCK, channels).mean((2, 4))


def welch(ours, theirs, rounding=ROUNDING):
    """Returns t and the two-sided p-value of each pixel, block or image."""
    floor = (rounding * (abs(ours.mean) + abs(theirs.mean)) / 2) ** 2 + 1e-18
    a, b = ours.square, theirs.square
    degrees_of_freedom = (a + b) ** 2 / np.maximum(a ** 2 / (ours.count - 1) + b ** 2 / (theirs.count - 1), 1e-300)
    degrees_of_freedom = np.where(a + b > floor, np.maximum(degrees_of_freedom, 1), 1e6)
    t = (ours.mean - theirs.mean) / np.sqrt(np.maximum(a + b, floor))
    return t, 2 * stats.t.sf(abs(t), degrees_of_freedom)


def sidak(p):
    """Returns the lowest p-value, corrected for the number of tests."""
    return float(-np.expm1(p.size * np.log1p(-min(p.min(), 1 - 1e-16))))


def render_wgray(args, path, seeds, size, spp):
    images = []
    environment = os.environ | ({"RAYON_NUM_THREADS": str(args.threads)} if args.threads else {})
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "out.exr")
        for seed in seeds:
            command = [args.wgray, "render", str(path), "--size", "x".join(map(str, size)), "--spp", str(spp), "--seed", str(seed), "--device",
                       args.device, "--progress", "none", "-q", "-o", out]
            done = subprocess.run(command, env=environment, capture_output=True, text=True)
            if done.returncode:
                raise RuntimeError(f"wgray ended with {done.returncode}: {done.stderr.strip()[-1000:]}")
            # Mitsuba's reader is not used, because it hangs with one thread.
            channels = OpenEXR.File(out, separate_channels=True).channels()
            images.append(np.stack([channels[c].pixels for c in "RGB"], -1).astype(float))
            os.remove(out)
    return np.array(images)


def render_mitsuba(args, path, seeds, size, spp):
    import mitsuba_scenes
    loaded = mitsuba_scenes.load(scenes.load(path, "path"), size, spp, 1, curved="mesh", exact=not args.own_facets)
    return np.array([np.array(mi.render(loaded, spp=spp, seed=seed))[..., :3] for seed in seeds], np.float64)


def save(folder, name, ours, theirs, t):
    """Writes three images side by side: both renders, gamma-encoded, and the difference."""
    folder.mkdir(parents=True, exist_ok=True)
    display = [np.clip(m, 0, 1) ** (1 / 2.2) for m in (ours.mean, theirs.mean)]
    t = np.clip(t.mean(-1) / 10, -1, 1)
    signs = 0.5 + np.stack([t, -abs(t), -t], -1) / 2
    mi.Bitmap((np.concatenate([*display, signs], 1) * 255).astype(np.uint8)).write(str(folder / f"{name}.png"))


def check(args, name, path, bound):
    """Prints a row of the table; returns whether the scene passes."""
    started = time.monotonic()
    course = str(path).endswith(".json")
    size, spp = ((args.course_size, args.course_spp) if course else (args.size, args.spp * MORE_SAMPLES.get(name, 1)))
    count = args.course_batches if course else args.batches
    try:
        theirs = render_mitsuba(args, path, range(1001, 1001 + count), (size, size), spp)
        seeds = range(args.seed, args.seed + count)
        renderer = render_mitsuba if args.wgray == "none" else render_wgray
        ours = renderer(args, path, seeds, (size, size), spp)
    except (RuntimeError, ValueError, OSError) as error:
        print(f"{name:22} FAILS: {error}", flush=True)
        return False
    ours *= args.wrong
    if not np.isfinite(ours).all() or not np.isfinite(theirs).all():
        print(f"{name:22} FAILS: non-finite pixels", flush=True)
        return False
    failures, lowest = [], []
    rounding = MAP_ROUNDING if name.startswith("map") else ROUNDING
    levels = {"pixels": lambda x: x, "blocks": blocks, "whole": lambda x: x.mean((1, 2))}
    for level, reduce in levels.items():
        a, b = means(reduce(ours)), means(reduce(theirs))
        t, p = welch(a, b, rounding)
        lowest.append(sidak(p))
        if lowest[-1] < bound:
            failures.append(level)
        if level == "pixels":
            rejected, chance = int((p < LEVEL).sum()), LEVEL * p.size
            if rejected > 2 * chance:
                failures.append("rejected")
            if args.save:
                save(args.save, name, a, b, t)
    our_total, their_total = (means(x.mean((1, 2, 3))) for x in (ours, theirs))
    ratio = our_total.mean / their_total.mean if their_total.mean else float("nan")
    error = np.sqrt(our_total.square + their_total.square) / their_total.mean if their_total.mean else float("nan")
    image_means = [means(x.mean((1, 2))) for x in (ours * args.control, theirs)]
    if args.wrong == 1 and sidak(welch(*image_means, rounding)[1]) >= bound:
        failures.append("control")
    a, b = (means(blocks(x).mean(-1)) for x in (ours, theirs))
    deviation = abs(a.mean - b.mean) / np.maximum(b.mean, 1e-12)
    if course and (deviation.max() > 0.02 or not abs(ratio - 1) <= 0.005):
        failures.append("2 %")
    worst = np.unravel_index(deviation.argmax(), deviation.shape)
    noise = np.sqrt(a.square + b.square)[worst] / max(b.mean[worst], 1e-12)
    print(f"{name:22} {ratio:8.5f} {error:8.5f} {lowest[0]:9.2g} {rejected:6d} {chance:6.0f} {lowest[1]:9.2g} {deviation.max():7.2%} {noise:7.2%} "
          f"{lowest[2]:9.2g} {time.monotonic() - started:6.0f}  {'FAILS: ' + ', '.join(failures) if failures else 'passes'}", flush=True)
    return not failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", help="names, separated by commas; 'course' stands for the three JSON scenes; default: all")
    parser.add_argument("--wgray", default=str(install.ROOT / "target/release/wgray"),
                        help="the program, or none: Mitsuba instead")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel and batch")
    parser.add_argument("--batches", type=int, default=16)
    parser.add_argument("--course-size", type=int, default=96)
    parser.add_argument("--course-spp", type=int, default=512)
    parser.add_argument("--course-batches", type=int, default=48)
    parser.add_argument("--seed", type=int, default=1, help="first seed of wgray; Mitsuba's seeds start at 1001")
    parser.add_argument("--wrong", type=float, default=1, help="factor by which wgray's images are multiplied; unless it is 1, all scenes must fail")
    parser.add_argument("--control", type=float, default=1.02, help="the factor that the test of each scene must detect")
    parser.add_argument("--own-facets", action="store_true",
                        help="use Mitsuba's own rough BSDFs, with the separable masking-shadowing function")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--threads", type=int, help="default: all")
    parser.add_argument("--save", metavar="FOLDER", type=pathlib.Path)
    args = parser.parse_args()
    for name, minimum in (("size", BLOCK), ("batches", 4), ("course_size", BLOCK), ("course_batches", 4), ("spp", 1), ("course_spp", 1)):
        if getattr(args, name) < minimum:
            parser.error(f"--{name.replace('_', '-')}: {getattr(args, name)} must be at least {minimum}")
    max_seed = 1001 - max(args.batches, args.course_batches)
    if not 0 <= args.seed <= max_seed:
        parser.error(f"--seed: {args.seed} must be from 0 to {max_seed}: each batch takes the next seed, and Mitsuba's seeds start at 1001")

    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)
    if args.threads:
        dr.set_thread_count(args.threads)
    all_scenes = {"cornell": install.ROOT / "scenes/cornell-path.toml"} | path_scenes.write(install.FOLDER / "path-scenes")
    names = list(all_scenes)
    if args.scenes:
        names = [n for word in args.scenes.split(",") for n in (path_scenes.COURSE_SCENES if word == "course" else [word])]
    for name in names:
        if name not in all_scenes:
            parser.error(f"--scenes: unknown {name!r}: one of course, {', '.join(all_scenes)}")
    bound = -np.expm1(np.log1p(-LEVEL) / (3 * len(names)))
    print(f"{args.spp} samples x {args.batches} batches (course: {args.course_spp} x {args.course_batches}), device {args.device}, "
          f"factor {args.wrong}; corrected p-values below {bound:.2g} fail")
    print(f"{'scene':22} {'ratio':>8} {'+-':>8} {'p pixels':>9} {'at 1 %':>6} {'chance':>6} {'p blocks':>9} {'worst':>7} {'+-':>7} {'p whole':>9} "
          f"{'s':>6}", flush=True)
    passes = [check(args, name, all_scenes[name], bound) for name in names]
    print(f"passed: {sum(passes)}, failed: {len(passes) - sum(passes)}")
    sys.exit(not all(passes))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Compares wgray's image with POV-Ray's, in linear values, and classifies the pixels that differ.

    benches/peers/run --install-only        once
    target/peers/venv/bin/python benches/peers/povray_check.py [--device lavapipe] [--scene scenes/cornell.toml]

The scene is rendered at its own size with every `specular` set to white (POV-Ray's highlight has the light's colour),
one sample at each pixel's centre and 16 light samples. POV-Ray renders it once with `area_light` and once with a point
light per light sample (povray_scenes.py documents the difference). Prints the percentage of pixels within 0.004 in
every channel and the classes of the others; writes the scenes, the EXR images and difference-*.png to --out. Exit
status 1 if either percentage is below --goal.

A third renderer, an independent implementation of the formulas in numpy with float64, classifies the pixels and is
compared with both images; `--device none` compares only POV-Ray with numpy, without wgray.
"""
import argparse
import os
import pathlib
import re
import struct
import subprocess
import sys
import tomllib
import zlib

sys.dont_write_bytecode = True
import numpy as np
import OpenEXR

import install
import povray_scenes
import scenes

MISS, LIGHT = -1, -2
CLASSES = {  # the colour in difference-*.png, and the meaning; a pixel belongs to the first class that applies
    "light": ((255, 220, 0), "the light, which is invisible to POV-Ray's camera"),
    "edge": ((255, 0, 0), "within a pixel of another primitive"),
    "shadow": ((0, 120, 255), "penumbra: some light samples of the pixel or a neighbour are occluded, others are not"),
    "other": ((255, 0, 255), "none of these"),
}


def dots(a, b):
    """Returns the dot products of rows."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


class Numpy:
    """wgray's formulas in float64, implemented independently: closest hits, shadows, Phong radiance."""

    def __init__(self, scene):
        self.scene, self.primitives = scene, []
        for s in scene.shapes:
            m = s.material
            if isinstance(s, scenes.Quad):
                self.primitives.append((self.quad, (np.array(s.center), np.array(s.u), np.array(s.v)), m))
            elif isinstance(s, scenes.Triangles):
                v = np.array(s.vertices, float)
                self.primitives += [(self.triangle, v[list(f)], m) for f in s.faces]
            elif isinstance(s, scenes.Ellipsoid):
                self.primitives.append((self.ellipsoid, (np.array(s.center), np.linalg.inv(np.array([s.a, s.b, s.c]).T)), m))
            else:
                self.primitives.append((self.plane, (np.array(s.point), np.array(s.normal)), m))

    @staticmethod
    def plane(o, d, point, n):
        with np.errstate(divide="ignore", invalid="ignore"):
            t = dots(point - o, n) / dots(d, n)
        return np.where(t > 0, t, np.inf), lambda p: np.broadcast_to(n / np.linalg.norm(n), p.shape)

    @classmethod
    def quad(cls, o, d, center, u, v):
        t, normal = cls.plane(o, d, center, np.cross(u, v))
        with np.errstate(invalid="ignore"):
            q = o + t[..., None] * d - center
            inside = (abs(dots(q, u)) <= u @ u) & (abs(dots(q, v)) <= v @ v)
        return np.where(inside, t, np.inf), normal

    @classmethod
    def triangle(cls, o, d, v0, v1, v2):
        n = np.cross(v1 - v0, v2 - v1)
        t, normal = cls.plane(o, d, v0, n)
        inside = True
        with np.errstate(invalid="ignore"):
            p = o + t[..., None] * d
            for a, b in ((v0, v1), (v1, v2), (v2, v0)):
                inside = inside & (dots(np.cross(b - a, p - a), n) >= 0)
        return np.where(inside, t, np.inf), normal

    @staticmethod
    def ellipsoid(o, d, center, inverse):
        o, d = (o - center) @ inverse.T, d @ inverse.T
        a, b, c = dots(d, d), dots(o, d), dots(o, o) - 1
        with np.errstate(invalid="ignore"):
            root = np.sqrt(b * b - a * c)
            near, far = (-b - root) / a, (-b + root) / a
            t = np.where(near > 0, near, np.where(far > 0, far, np.inf))

        def normal(p):
            n = ((p - center) @ inverse.T) @ inverse
            return n / np.linalg.norm(n, axis=-1, keepdims=True)
        return np.where(np.isnan(t), np.inf, t), normal

    def hit(self, o, d):
        """Returns the distance and primitive (or MISS) of the closest hits, and the normal functions of all primitives."""
        best, which, normals = np.full(d.shape[:-1], np.inf), np.full(d.shape[:-1], MISS), []
        for i, (intersect, row, _) in enumerate(self.primitives):
            t, normal = intersect(o, d, *row)
            normals.append(normal)
            which = np.where(t < best, i, which)
            best = np.minimum(t, best)
        return best, which, normals

    def rays(self, width, height):
        s = self.scene
        forward = np.array(scenes.unit(scenes.sub(s.look_at, s.position)))
        right = np.array(scenes.unit(scenes.cross(list(forward), s.up)))
        up, half = np.cross(right, forward), np.tan(np.radians(s.fov) / 2)
        x = (2 * (np.arange(width) + .5) / width - 1) * half * width / height
        y = (1 - 2 * (np.arange(height) + .5) / height) * half
        d = forward + x[None, :, None] * right + y[:, None, None] * up
        return np.array(s.position, float), d / np.linalg.norm(d, axis=-1, keepdims=True)

    def render(self, width, height, samples):
        """Returns the radiance, the visible primitive (or LIGHT, MISS) and the number of unoccluded light samples of each pixel."""
        n_grid = int(round(samples ** .5))
        o, d = self.rays(width, height)
        t, which, normals = self.hit(o, d)
        p = np.where(which[..., None] == MISS, 0, o + np.where(np.isinf(t), 0, t)[..., None] * d)
        n, image = np.zeros_like(p), np.zeros_like(p)
        pick = lambda term: np.array([getattr(m, term) for *_, m in self.primitives] + [[0.0] * 3])[which]
        kd, ks = pick("diffuse"), pick("specular")
        power = np.array([m.shininess for *_, m in self.primitives] + [1])[which]
        for i, normal in enumerate(normals):
            n = np.where((which == i)[..., None], normal(p), n)
        n = np.where((dots(n, d) > 0)[..., None], -n, n)
        start = p + 1e-6 * n
        lit_counts = np.zeros(which.shape, int)
        for light in self.scene.lights:
            cells = 2 * (np.arange(n_grid) + .5) / n_grid - 1
            for i in cells:
                for j in cells:
                    to = np.array(light.center) + i * np.array(light.u) + j * np.array(light.v) - start
                    distance = np.linalg.norm(to, axis=-1)
                    l = to / distance[..., None]
                    lit = (self.hit(start, l)[0] > distance * (1 - 1e-6)) & (dots(n, l) > 0) & (which != MISS)
                    nl = np.maximum(dots(n, l), 0)
                    rv = np.maximum(dots(l - 2 * dots(n, l)[..., None] * n, d), 0)  # r.v = (2 (n.l) n - l).(-d)
                    value = kd * nl[..., None] + ks * (rv ** power)[..., None]
                    image += np.where(lit[..., None], value * np.array(light.color) / samples, 0)
                    lit_counts += lit
        image += pick("ambient") * np.array(self.scene.ambient)
        for light in self.scene.lights:
            front = self.quad(o, d, np.array(light.center), np.array(light.u), np.array(light.v))[0] < t
            image = np.where(front[..., None], light.color, image)
            which = np.where(front, LIGHT, which)
        return image, which, lit_counts


def white_specular(text):
    """Returns the scene with a white `specular` in every material."""
    text = re.sub(r"(?m)^\s*specular\s*=.*\n", "", text)
    text = re.sub(r"(?m)^(\[materials\.[^\]]+\])\s*(#.*)?$", r"\1\nspecular = [1, 1, 1]", text)
    for name, row in tomllib.loads(text)["materials"].items():
        if row.get("specular") != [1, 1, 1]:
            raise ValueError(f"could not make materials.{name}.specular white")
    return text


def read(path):
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    return np.stack([channels[c].pixels.astype(np.float64) for c in "RGB"], -1)


def has_different_neighbor(values):
    """Returns the mask of pixels with a different value in one of the eight neighbours."""
    a = np.pad(values, 1, mode="edge")
    h, w = values.shape
    return np.any([a[y:y + h, x:x + w] != values for y in range(3) for x in range(3)], axis=0)


def compare(name, image, reference, visible, in_penumbra, tolerance, out=None):
    difference = abs(image - reference).max(-1)
    differs = ~(difference <= tolerance)  # true for NaN
    print(f"{name}: {100 * (1 - differs.mean()):.3f} % of {differs.size} pixels within {tolerance}; "
          f"median difference {np.median(difference):.2e}, largest {difference.max():.3g}")
    classes = {"light": visible == LIGHT, "edge": has_different_neighbor(visible),
               "shadow": in_penumbra | has_different_neighbor(in_penumbra), "other": np.ones_like(differs)}
    marked = np.repeat(np.clip(reference, 0, 1).mean(-1, keepdims=True) ** (1 / 2.2) * 127, 3, -1)
    unclassified = differs.copy()
    for kind, (colour, meaning) in CLASSES.items():
        pixels = unclassified & classes[kind]
        unclassified &= ~pixels
        marked[pixels] = colour
        location = f", the first at {tuple(int(v) for v in np.argwhere(pixels)[0][::-1])}" if pixels.any() else ""
        print(f"    {kind:7} {pixels.sum():6}  {100 * pixels.mean():.3f} %  {meaning}{location}")
    if out:
        write_png(out, marked.astype(np.uint8))
        print(f"    marked in {os.path.relpath(out)}: " + ", ".join(f"{k} {v[0]}" for k, v in CLASSES.items()))
    return 1 - differs.mean()


def write_png(path, pixels):
    h, w, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", w, h, 8, 2, 0, 0, 0)
    pathlib.Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", type=pathlib.Path, default=install.ROOT / "scenes/cornell.toml")
    parser.add_argument("--device", default="lavapipe", help="wgray's --device, or none")
    parser.add_argument("--wgray", default=install.ROOT / "target/release/wgray")
    parser.add_argument("--folder", type=pathlib.Path, default=install.FOLDER, help="installation folder of `run`")
    parser.add_argument("--out", type=pathlib.Path, help="output folder; default: FOLDER/povray_check")
    parser.add_argument("--size", type=int, help="width and height; default: those of the scene")
    parser.add_argument("--light-samples", type=int, default=16)
    parser.add_argument("--tolerance", type=float, default=0.004)
    parser.add_argument("--goal", type=float, default=95, help="required percentage of pixels within the tolerance")
    args = parser.parse_args()
    out = args.out or args.folder / "povray_check"
    out.mkdir(parents=True, exist_ok=True)

    variant = out / "wgray.toml"
    variant.write_text(white_specular(args.scene.read_text()))
    scene = scenes.load(variant)
    width, height = (args.size, args.size) if args.size else (scene.width, scene.height)
    command, environment = install.Peers(args.folder).povray()
    images = {}
    for name, points in (("area light", False), ("point lights", True)):
        base = out / f"povray-{name.replace(' ', '-')}"
        base.with_suffix(".pov").write_text(povray_scenes.povray(scene, args.light_samples, width, height, points))
        done = subprocess.run([command, f"+I{base}.pov", f"+O{base}.exr", "+FE", f"+W{width}", f"+H{height}", "-A", "-D"],
                              env=os.environ | environment, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"POV-Ray failed:\n{done.stderr[-2000:]}")
        images[name] = read(f"{base}.exr")
    reference, which, lit_counts = Numpy(scene).render(width, height, args.light_samples)
    classification = which, (lit_counts > 0) & (lit_counts < args.light_samples * len(scene.lights)), args.tolerance
    ours, image = "numpy", reference
    if args.device != "none":
        subprocess.run([args.wgray, "render", variant, "--spp", "1", "--light-samples", str(args.light_samples), "--size",
                        f"{width}x{height}", "--device", args.device, "-q", "-o", out / "wgray.exr"], check=True)
        ours, image = "wgray", read(out / "wgray.exr")
        compare("wgray against numpy", image, reference, *classification)
    fractions = {name: compare(f"{ours} against POV-Ray, {name}", image, theirs, *classification,
                            out / f"difference-{name.replace(' ', '-')}.png") for name, theirs in images.items()}
    for name, fraction in fractions.items():
        if not 100 * fraction >= args.goal:
            sys.exit(f"{name}: {100 * fraction:.3f} % of the pixels agree; the goal is {args.goal:g} %")


if __name__ == "__main__":
    main()

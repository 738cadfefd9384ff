#!/usr/bin/env python3
"""Compares wgray and Blender's Cycles on a glTF model: seconds per sample, and seconds from the command to a given error.

    benches/peers/model_cycles.py MODEL [--size N] [--rel-mse X] [--rounds N] [--wgray FILE]

Both renderers use the CPU, the camera that wgray chooses, wgray's studio as an environment map, and paths of at most 8 segments.

- Time per sample per pixel: the difference of the render times with 80 and with 16 samples per pixel, divided by 64.
- Time to the error: the seconds of a process that reads the model, renders, denoises and writes the image. Cycles uses Open Image
  Denoise with albedo and normal. The number of samples is the lowest of 4, 6, 8, 12, 16, 24, ... with which the denoised image
  reaches the error: the mean of (a - b)² / (b² + 0.01), where b is the same renderer's image with 1,024 samples and another seed.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FEW, MANY, REFERENCE = 16, 80, 1024
COUNTS = [count for power in range(2, 10) for count in (2 ** power, 3 * 2 ** (power - 1))]
MAX_DEPTH = 8
STUDIO = """image = { width = 1024, height = 512 }
camera = { type = "panorama", position = [0, 0, 0], look_at = [1, 0, 0], up = [0, 0, 1] }
environment = { name = "studio" }
[render]
integrator = "path"
"""
ERROR = """
import sys
import numpy as np
import OpenEXR
a, b = (OpenEXR.File(path, separate_channels=True).channels() for path in sys.argv[1:])
prefix = "denoised." if "denoised.R" in a else ""
a, b = (np.stack([image[p + c].pixels for c in "RGB"], -1).astype(float) for image, p in ((a, prefix), (b, "")))
print(np.mean((a - b) ** 2 / (b ** 2 + 0.01)))
"""


def run(command):
    return subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE, text=True).stdout


class Renderers:
    """The renderers. Each returns the seconds of a process, and the seconds of rendering alone."""

    def __init__(self, args, folder):
        import install

        peers = install.Peers()
        peers.install()
        self.args, self.folder, self.python, self.cycles_python = args, folder, peers.python, peers.cycles()
        self.map, studio = folder / "studio.exr", folder / "studio.toml"
        studio.write_text(STUDIO)
        run([args.wgray, "render", studio, "--spp", 4, "--quiet", "-o", self.map])
        self.camera = json.loads(run([args.wgray, "info", args.model, "--json"]))["camera"]

    def wgray(self, samples, seed, denoise, image):
        stats = self.folder / "stats.json"
        command = [self.args.wgray, "render", self.args.model, "--size", f"{self.args.size}x{self.args.size}", "--spp", samples]
        command += ["--seed", seed, "--max-depth", MAX_DEPTH, f"--denoise={'on' if denoise else 'off'}", "--device", "cpu", "--quiet"]
        start = time.monotonic()
        run([*command, "--environment", self.map, "--stats", stats, "-o", image])
        return time.monotonic() - start, json.loads(stats.read_text())["render_s"]

    def cycles(self, samples, seed, denoise, image):
        job = {"position": self.camera["position"], "target": self.camera["look_at"], "fov": self.camera["fov"]}
        job |= {"file": str(self.args.model.resolve()), "output": str(image), "size": self.args.size, "spp": samples, "seed": seed}
        job |= {"map": str(self.map), "bounces": MAX_DEPTH - 1, "denoise": denoise}
        start = time.monotonic()
        output = run([self.cycles_python, __file__, "--cycles", json.dumps(job)])
        return time.monotonic() - start, float(output.splitlines()[-1])

    def error(self, image, reference):
        return float(run([self.python, "-c", ERROR, image, reference]))


def compare(args, folder):
    renderers = Renderers(args, folder)
    both = {"wgray": renderers.wgray, "Cycles": renderers.cycles}
    image = folder / "image.exr"
    per_sample = {name: [] for name in both}
    for _ in range(args.rounds):
        for name, render in both.items():
            few, many = (render(samples, 0, False, image)[1] for samples in (FEW, MANY))
            per_sample[name].append((many - few) / (MANY - FEW))
    print("| renderer | ms per sample per pixel | samples to the error | error | seconds from the command |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for name, render in both.items():
        reference = folder / f"{name}-reference.exr"
        render(REFERENCE, 99, False, reference)
        for samples in COUNTS:
            render(samples, 0, True, image)
            error = renderers.error(image, reference)
            if error <= args.rel_mse:
                break
        seconds = statistics.median(render(samples, 0, True, image)[0] for _ in range(args.rounds))
        print(f"| {name} | {1000 * statistics.median(per_sample[name]):.0f} | {samples} | {error:.5f} | {seconds:.1f} |", flush=True)


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--cycles":
        import gltf_cycles

        seconds = gltf_cycles.cycles(json.loads(sys.argv[2]))
        print(f"\n{seconds}")
        return
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("model", type=pathlib.Path)
    options.add_argument("--size", type=int, default=512)
    options.add_argument("--rel-mse", type=float, default=0.0018)
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--wgray", default=ROOT / "target/release/wgray")
    args = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        compare(args, pathlib.Path(name))


main()

#!/usr/bin/env python3
"""Compares the noise of wgray and of Blender's Cycles for a glTF model, at equal samples per pixel.

    benches/peers/noise_cycles.py MODEL [--size N] [--wgray FILE]

The environment is a constant radiance of 0.5, so that only pixel filters, textures, materials and occlusion cause noise. Prints
the noise in percent for 16 and 64 samples: the square root of the relMSE against the same renderer's image of 1,024 samples with
another seed. wgray also renders without ray differentials (no mip levels) and with other pixel filters. Both renderers run on the CPU.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SAMPLES = [16, 64]
REFERENCE_SAMPLES = 1024
WGRAY = {
    "wgray": [],
    "wgray, no ray differentials": ["render.ray_differentials=false"],
    "wgray, gaussian": ['render.filter={type="gaussian"}'],
    "wgray, blackman_harris": ['render.filter={type="blackman_harris"}'],
}
CYCLES = {"Cycles, box": "BOX", "Cycles, Blackman-Harris": "BLACKMAN_HARRIS"}


def noise(wgray, image, reference):
    command = [wgray, "diff", image, reference, "--layers", "color", "--metrics", "rel_mse", "--json"]
    report = json.loads(subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, check=False).stdout)
    return 100 * report["layers"][0]["rel_mse"] ** 0.5


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--cycles":
        import gltf_cycles

        return gltf_cycles.cycles(json.loads(sys.argv[2]))
    import install

    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("model", type=pathlib.Path)
    options.add_argument("--size", type=int, default=256)
    options.add_argument("--wgray", default=ROOT / "target/release/wgray")
    args = options.parse_args()
    python = install.Peers().cycles()
    info = json.loads(subprocess.run([str(args.wgray), "info", str(args.model), "--json"], capture_output=True, check=True).stdout)
    camera = info["camera"]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)

        def render_with_wgray(defines, samples, seed, image):
            command = [args.wgray, "render", args.model, "--size", f"{args.size}x{args.size}", "--spp", samples, "--seed", seed]
            command += ["--device", "cpu", "--quiet", "--max-depth", 15, "-o", image]
            for define in ["environment={color=[0.5,0.5,0.5]}", *defines]:
                command += ["-D", define]
            subprocess.run([str(part) for part in command], check=True)

        def render_with_cycles(pixel_filter, samples, seed, image):
            values = {"file": str(args.model.resolve()), "output": str(image), "size": args.size, "spp": samples, "seed": seed}
            values |= {"position": camera["position"], "target": camera["look_at"], "fov": camera["fov"]}
            values |= {"sky": [0.5] * 3, "filter": pixel_filter}
            with open(os.devnull, "w") as silent:
                subprocess.run([python, __file__, "--cycles", json.dumps(values)], check=True, stdout=silent)

        print("| renderer | " + " | ".join(f"noise at {samples} spp, %" for samples in SAMPLES) + " |")
        print("| --- |" + " ---: |" * len(SAMPLES), flush=True)
        renderers = [(name, render_with_wgray, defines) for name, defines in WGRAY.items()]
        renderers += [(name, render_with_cycles, pixel_filter) for name, pixel_filter in CYCLES.items()]
        for name, render, setting in renderers:
            reference, image = folder / "reference.exr", folder / "image.exr"
            render(setting, REFERENCE_SAMPLES, 99, reference)
            row = []
            for samples in SAMPLES:
                render(setting, samples, 0, image)
                row.append(noise(args.wgray, image, reference))
            print(f"| {name} | " + " | ".join(f"{percent:.2f}" for percent in row) + " |", flush=True)


main()

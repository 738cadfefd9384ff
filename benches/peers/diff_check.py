#!/usr/bin/env python3
"""Compares the metrics of `wgray diff` with reference implementations, on random images and on extreme cases.

FLIP is compared with NVIDIA's implementation (flip-evaluator), SSIM and PSNR with scikit-image, RMSE and relative MSE
with NumPy. Prints the largest deviation of each metric, and fails if one exceeds the rounding errors. Then compares the pixels that
wgray reads from EXR files of every compression with those that the OpenEXR library reads.

    python3 -m venv venv && venv/bin/pip install flip-evaluator scikit-image OpenEXR
    cargo build --release
    venv/bin/python benches/peers/diff_check.py [--program target/release/wgray] [--count 200]
    venv/bin/python benches/peers/diff_check.py --values     # the expected values of tests/compare.rs
"""

import argparse
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

import flip_evaluator
import numpy
import OpenEXR
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

# Maximum deviation of each metric due to rounding: FLIP is computed in f32 (also by NVIDIA), the others in f64.
BOUNDS = {"rmse": 1e-12, "rel_mse": 1e-12, "psnr": 1e-12, "ssim": 1e-11, "flip": 3e-5}


def formula(width, height, is_linear):
    """Returns a pair of images defined by a formula, which tests/compare.rs also uses."""
    y, x, c = numpy.meshgrid(range(height), range(width), range(3), indexing="ij")
    smooth = (x * 5 + y * 3 + c * 40) % 256
    noise = ((x * 7919 + y * 104729 + c * 1299709 + (x * y) * 31) % 101) - 50
    a, b = numpy.clip(smooth + noise, 0, 255), smooth
    if is_linear:
        return (a * a / 4096).astype(numpy.float32), (b * b / 4096).astype(numpy.float32)
    return a.astype(numpy.uint8), b.astype(numpy.uint8)


def write(path, image):
    if path.suffix == ".exr":
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"RGB": numpy.ascontiguousarray(image)}).write(str(path))
        return
    height, width, _ = image.shape
    rows = image.astype(image.dtype.newbyteorder(">")).reshape(height, -1).view(numpy.uint8)
    rows = numpy.concatenate([numpy.zeros((height, 1), numpy.uint8), rows], 1).tobytes()
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", width, height, 8 * image.dtype.itemsize, 2, 0, 0, 0)
    chunks = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


def expected(a, b):
    """Returns the metrics of an image and its reference, computed by the reference implementations."""
    is_linear = a.dtype == numpy.float32
    scale = {numpy.dtype(numpy.uint8): 255, numpy.dtype(numpy.uint16): 65535}.get(a.dtype, 1)
    a, b = a.astype(numpy.float64) / scale, b.astype(numpy.float64) / scale
    peak = (numpy.abs(b).max() or 1) if is_linear else 1
    metrics = {
        "rmse": math.sqrt(((a - b) ** 2).mean()),
        "rel_mse": ((a - b) ** 2 / (b**2 + 0.01)).mean(),
    }
    metrics["psnr"] = peak_signal_noise_ratio(b, a, data_range=peak) if metrics["rmse"] > 0 else math.inf
    display_a, display_b = a, b
    if is_linear:
        display_a, display_b = numpy.clip(a, 0, 1) ** (1 / 2.2), numpy.clip(b, 0, 1) ** (1 / 2.2)
    if min(a.shape[:2]) >= 11:
        metrics["ssim"] = structural_similarity(
            display_b,
            display_a,
            gaussian_weights=True,
            sigma=1.5,
            use_sample_covariance=False,
            data_range=1,
            channel_axis=-1,
        )
    # NVIDIA's implementation computes an infinite exposure if the median luminance is 0.
    luminance = b @ [0.2126, 0.7152, 0.0722]
    if not is_linear or numpy.sort(luminance.ravel())[luminance.size // 2] > 0:
        metrics["flip"] = flip_evaluator.evaluate(
            b.astype(numpy.float32), a.astype(numpy.float32), "HDR" if is_linear else "LDR", applyMagma=False
        )[1]
    return metrics


def image_pairs(count):
    """Yields names and pairs of images."""
    random = numpy.random.default_rng(2004)
    for is_linear in (False, True):
        yield "formula", formula(40, 30, is_linear)
    flat = lambda value, kind=numpy.uint8, size=(23, 31): numpy.full((*size, 3), value, kind)
    yield "black, white", (flat(0), flat(255))
    yield "identical", (flat(77), flat(77))
    yield "one step", (flat(100), flat(101))
    green, blue = flat(0), flat(0)
    green[..., 1], blue[..., 2] = 255, 255
    yield "green, blue", (green, blue)
    one_bit = flat(128)
    one_bit[11, 13, 1] ^= 1
    yield "one bit", (one_bit, flat(128))
    board = (numpy.indices((40, 50)).sum(0) % 2 * 255).astype(numpy.uint8)[..., None].repeat(3, -1)
    yield "board, inverse", (board, 255 - board)
    yield "board, gray", (board, flat(128, size=(40, 50)))
    yield "16 bits", (flat(30000, numpy.uint16), flat(30001, numpy.uint16))
    yield "1 x 1", (flat(3, size=(1, 1)), flat(200, size=(1, 1)))
    yield "300 x 1", (flat(3, size=(1, 300)), flat(200, size=(1, 300)))
    floats = numpy.float32
    yield "linear one", (flat(1, floats), flat(2, floats))
    yield "linear dark", (flat(1e-6, floats), flat(2e-6, floats))
    yield "linear bright", (flat(1e6, floats), flat(1.1e6, floats))
    for i in range(count):
        height, width = random.integers(1, 70, 2)
        y, x = numpy.mgrid[0:height, 0:width]
        waves = [random.uniform(0.02, 1.5, 2) for _ in range(3)]
        smooth = numpy.stack([0.5 + 0.5 * numpy.sin(x * u + 2) * numpy.cos(y * v + 1) for u, v in waves], -1)
        noise = random.standard_normal(smooth.shape) * 10 ** random.uniform(-3, 0)
        kind = i % 4
        if kind == 3:
            b = (smooth ** random.uniform(0.5, 6) * 10 ** random.uniform(-3, 4)).astype(floats)
            a = (b * numpy.exp(noise)).astype(floats)
        else:
            maximum, depth = (65535, numpy.uint16) if kind == 2 else (255, numpy.uint8)
            b = (smooth * maximum + 0.5).astype(depth)
            a = (numpy.clip(smooth + noise, 0, 1) * maximum + 0.5).astype(depth)
        yield f"random {i}", (a, b)


def compare_exr_readers(program, folder):
    """Returns the number of kinds of EXR files, and a message for each file that wgray and OpenEXR read differently."""
    random = numpy.random.default_rng(2013)
    y, x = numpy.mgrid[0:70, 0:130]
    image = numpy.stack([x / 130 + 0.1 * random.random(x.shape), y / 70, numpy.sin(x / 9) + 1], -1)
    paths = [pathlib.Path(folder) / name for name in ("packed.exr", "plain.exr")]
    tested, failures = 0, []
    for name in ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB"]:
        for kind in (OpenEXR.scanlineimage, OpenEXR.tiledimage):
            for values in (numpy.float16, numpy.float32):
                header = {"compression": getattr(OpenEXR, f"{name}_COMPRESSION"), "type": kind}
                if kind == OpenEXR.tiledimage:
                    header["tiles"] = OpenEXR.TileDescription()
                OpenEXR.File(header, {"RGB": image.astype(values)}).write(str(paths[0]))
                write(paths[1], OpenEXR.File(str(paths[0])).channels()["RGB"].pixels)
                result = subprocess.run([program, "diff", *paths], capture_output=True, text=True)
                tested += 1
                if result.returncode != 0:
                    failures.append(f"{name} {kind} {values.__name__}: {result.stdout}{result.stderr}")
    return tested, failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/wgray")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--values", action="store_true")
    options = parser.parse_args()
    if options.values:
        for is_linear in (False, True):
            for name, value in expected(*formula(40, 30, is_linear)).items():
                print("linear" if is_linear else "display", name, repr(float(value)))
        return
    worst = {name: (0.0, "", 0) for name in BOUNDS}
    flip_at_60 = expected_flip = None
    with tempfile.TemporaryDirectory() as folder:
        for name, (a, b) in image_pairs(options.count):
            extension = ".exr" if a.dtype == numpy.float32 else ".png"
            paths = [pathlib.Path(folder) / (side + extension) for side in "ab"]
            for path, image in zip(paths, (a, b)):
                write(path, image)
            result = subprocess.run([options.program, "diff", "--json", *paths], capture_output=True, text=True)
            if result.returncode not in (0, 5):
                sys.exit(f"{name}: exit code {result.returncode}: {result.stderr}")
            layer = json.loads(result.stdout)["layers"][0]
            if flip_at_60 is None:  # the control: FLIP at another --ppd must exceed the bound
                command = [options.program, "diff", "--json", "--ppd", "60", *paths]
                control = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)
                flip_at_60, expected_flip = control["layers"][0]["flip"], expected(a, b)["flip"]
            for metric, value in expected(a, b).items():
                measured = float(layer[metric])
                deviation = 0.0 if measured == value else abs(measured - value)
                if metric in ("rmse", "rel_mse", "psnr") and value not in (0, math.inf):
                    deviation /= abs(value)
                largest, image, count = worst[metric]
                worst[metric] = (*max((largest, image), (deviation, name)), count + 1)
        kinds, failures = compare_exr_readers(options.program, folder)
    for line in failures:
        print(line)
    print(f"{kinds} kinds of EXR files, wgray and OpenEXR read {len(failures)} of them differently")
    failed = bool(failures)
    if abs(flip_at_60 - expected_flip) <= BOUNDS["flip"]:
        sys.exit("flip: --ppd 60 gives the same value as the default")
    for metric, (deviation, name, count) in worst.items():
        exceeds_bound = not deviation <= BOUNDS[metric]
        failed |= exceeds_bound
        print(f"{metric:8} largest deviation {deviation:.2e}, {name}; {count} images{'  FAILS' if exceeds_bound else ''}")
    sys.exit(failed)


if __name__ == "__main__":
    main()

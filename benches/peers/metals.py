#!/usr/bin/env python3
"""Prints the metals of crates/scene/src/metals.rs: n and k for linear red, green and blue, from the measured spectra that Mitsuba ships.

    benches/peers/run --install-only                                    once
    target/peers/venv/bin/python benches/peers/metals.py

Each spectrum is weighted by the colour matching functions of CIE 1931, converted to sRGB's primaries, and divided by the result for
a constant spectrum of 1. The last column is the reflectance at normal incidence.
"""
import os
import pathlib
import sys

sys.dont_write_bytecode = True
import install
os.environ |= install.Peers().mitsuba()[1]  # before the import, which loads LLVM

import mitsuba as mi
import numpy as np

FILES = {
    "aluminium": "Al", "beryllium": "Be", "chromium": "Cr", "copper": "Cu", "gold": "Au", "iridium": "Ir", "mercury": "Hg",
    "molybdenum": "Mo", "nickel": "Ni_palik", "niobium": "Nb", "rhodium": "Rh", "silver": "Ag", "titanium_nitride": "TiN",
    "tungsten": "W",
}


def index(folder, name, part):
    wavelengths, values = mi.spectrum_from_file(str(folder / f"{name}.{part}.spd"))
    return np.array(mi.spectrum_list_to_srgb(wavelengths, values, False, False))


def main():
    mi.set_variant("scalar_rgb")
    folder = pathlib.Path(mi.__file__).parent / "data" / "ior"
    for metal, name in FILES.items():
        n, k = index(folder, name, "eta"), index(folder, name, "k")
        reflectance = ((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k)
        print(f"{metal:18} {n.round(4)} {k.round(4)} {reflectance.round(2)}")


if __name__ == "__main__":
    main()

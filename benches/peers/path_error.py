"""Prints the errors of the EXR pictures in a folder as JSON: `relative`, `absolute`; null if there are fewer than two pictures.

Both are roots of means over the pixels: of the variance, and of the variance divided by the squared mean (plus 1e-4, for the
dark), each summed over the channels first. The pictures have the same expectation and independent noise, so a pixel's variance
over them is the mean square of what one differs by from what they all converge to. The absolute error is mostly that of the
pixels at the edges of a light that is seen, so the relative one is compared.
"""
import json
import pathlib
import sys

import numpy as np
import OpenEXR

count, mean, square = 0, 0, 0
for path in sorted(pathlib.Path(sys.argv[1]).glob("*.exr")):
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    picture = np.stack([channels[c].pixels for c in "RGB"], -1).astype(float)
    count += 1
    step = picture - mean
    mean = mean + step / count
    square = square + step * (picture - mean)
if count < 2:
    print("null")
else:
    variance = (square / (count - 1)).sum(-1)
    relative = variance / ((mean ** 2).sum(-1) + 1e-4)
    print(json.dumps({"relative": float(np.sqrt(relative.mean())), "absolute": float(np.sqrt(variance.mean() / 3))}))

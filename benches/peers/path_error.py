"""Prints the errors of the EXR images in a folder as JSON: `relative`, `absolute`; null for fewer than two images.

`absolute` is computed from the variance of each pixel, `relative` from the variance divided by the squared mean (plus
1e-4, for dark pixels). Both are summed over the channels and averaged over the pixels; the error is the square root of
the average. The images have the same expected
value and independent noise, so the variance of a pixel over the images is the mean squared error of one image. The
absolute error is dominated by the pixels at the edges of visible lights, so the relative error is compared.
"""
import json
import pathlib
import sys

import numpy as np
import OpenEXR

count, mean, square = 0, 0, 0
for path in sorted(pathlib.Path(sys.argv[1]).glob("*.exr")):
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    image = np.stack([channels[c].pixels for c in "RGB"], -1).astype(float)
    count += 1
    step = image - mean
    mean = mean + step / count
    square = square + step * (image - mean)
if count < 2:
    print("null")
else:
    variance = (square / (count - 1)).sum(-1)
    relative = variance / ((mean ** 2).sum(-1) + 1e-4)
    print(json.dumps({"relative": float(np.sqrt(relative.mean())), "absolute": float(np.sqrt(variance.mean() / 3))}))

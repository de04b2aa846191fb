# Reads the EXR file of scripts/readers.sh with OpenImageIO, and compares its slabs with the raw texels.
import json
import sys

import numpy
import OpenImageIO as oiio

folder = sys.argv[1]
image = oiio.ImageInput.open(f"{folder}/atlas.exr")
spec = image.spec()
note = json.loads(spec.get_string_attribute("sateen"))
assert [spec.channelnames[k] for k in range(spec.nchannels)] == ["R", "G", "B", "A"]
atlas = note["atlas"]
width, height = atlas["slab"]
columns, rows, depth = atlas["columns"], atlas["rows"], atlas["depth"]
assert (spec.width, spec.height) == (columns * width, rows * height)
pixels = image.read_image(oiio.HALF).view(numpy.uint16).reshape(spec.height, spec.width, 4)
slabs = pixels.reshape(rows, height, columns, width, 4).transpose(0, 2, 1, 3, 4).reshape(-1, height, width, 4)
raw = numpy.fromfile(f"{folder}/volume.bin", dtype="<u2").reshape(depth, height, width, 4)
assert numpy.array_equal(slabs[:depth], raw)
print(f"OpenImageIO {oiio.VERSION_STRING}: atlas.exr is {columns} × {rows} slabs of {width} × {height}, all {depth} as they were")

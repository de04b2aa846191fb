# Reads the DDS file of scripts/readers.sh with Panda3D, and compares it with the raw texels.
import sys

import numpy
import panda3d
from panda3d.core import Filename, Texture

folder = sys.argv[1]
texture = Texture()
assert texture.read(Filename(f"{folder}/volume.dds"))
width, height, depth = texture.x_size, texture.y_size, texture.z_size
assert (texture.texture_type, texture.component_type) == (Texture.TT_3d_texture, Texture.T_half_float)
# Panda3D keeps blue first, and turns rows and slabs round.
texels = numpy.frombuffer(bytes(texture.get_ram_image()), dtype="<u2").reshape(depth, height, width, 4)[::-1, ::-1, :, [2, 1, 0, 3]]
raw = numpy.fromfile(f"{folder}/volume.bin", dtype="<u2").reshape(depth, height, width, 4)
assert numpy.array_equal(texels, raw)
print(f"Panda3D {panda3d.__version__}: volume.dds is {width} × {height} × {depth} halves, all as they were")

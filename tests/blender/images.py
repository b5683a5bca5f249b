"""Images that were written, read back."""

import bpy
import numpy as np


def read_image(path):
    """Pixels of an image of floats, (rows, columns, 4), rows from v = 0 up."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(image.size[0] * image.size[1] * 4, dtype=np.float32)
    image.pixels.foreach_get(values)
    assert image.is_float
    return values.reshape(image.size[1], image.size[0], 4)

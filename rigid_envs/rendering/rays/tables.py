"""The tables that kernels of the renderer read: primitives, polygons, decals, a camera."""

import numpy as np

# A shape at a place. `kind` and `size` as in `intersections`; `solid`: to which solid of the scene
# it belongs, -1 if to none; `axes`: rows are its own axes in the world; `reach`: m, no point is
# farther from `position`; `color`: 0..255; `gloss`: strength of the highlight; `edge`: brightness
# of a box's edges as a share of its faces'; `opacity`: 0..1, used for those that are see-through
PRIMITIVE = np.dtype([
    ("position", np.float64, 3), ("axes", np.float64, (3, 3)), ("size", np.float64, 3),
    ("reach", np.float64), ("color", np.float64, 3), ("gloss", np.float64), ("edge", np.float64),
    ("opacity", np.float64), ("kind", np.int64), ("solid", np.int64),
], align=True)  # fmt: skip

# A convex polygon of up to 4 corners in the picture, drawn over everything: `corners`: columns and
# rows in pixels; a triangle's last corner stands twice
POLYGON = np.dtype([
    ("corners", np.float64, (4, 2)), ("color", np.float64, 3), ("opacity", np.float64),
], align=True)  # fmt: skip

# A disc or a cross on the ground: `radius`: m, the disc's or the length of the cross's arms;
# `rim`: opacity at the disc's border; `width`: m, half that of an arm, 0 for a disc
DECAL = np.dtype([
    ("position", np.float64, 2), ("radius", np.float64), ("width", np.float64),
    ("color", np.float64, 3), ("opacity", np.float64), ("rim", np.float64),
], align=True)  # fmt: skip

# `axes`: rows are right, up and forward; `focal`: pixels, and `pixel`: its inverse; `near`: m, the
# least depth that is drawn; `half_width` and `half_height`: of the picture in pixels
CAMERA = np.dtype([
    ("eye", np.float64, 3), ("axes", np.float64, (3, 3)), ("focal", np.float64),
    ("pixel", np.float64), ("near", np.float64), ("half_width", np.float64),
    ("half_height", np.float64),
], align=True)  # fmt: skip

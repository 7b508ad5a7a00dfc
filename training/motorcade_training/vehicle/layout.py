"""Sizes, names and conventions that training, evaluation and the product share."""

import math

#: Pixels a side of the network's input.
INPUT_PX = 64
#: Size of the crop against the box, stretched to a square.
MARGIN = 1.24
#: Cells a side of a heat map.
HEAT_CELLS = 16
#: `car-36`: 0-17 left, 18-35 right; i and i + 18 mirror each other.
KEYPOINTS = 36
MIRROR = [(i + 18) % KEYPOINTS for i in range(KEYPOINTS)]
#: Heading bins over the full turn; bin k is centred at k * BIN_RAD.
HEADING_BINS = 24
BIN_RAD = 2 * math.pi / HEADING_BINS
#: Body types in the order of the logits; `other` has no keypoints.
BODIES = ("city", "hatchback", "saloon", "estate", "suv", "van", "coupe", "panel_van", "other")
#: The network tells logarithms of length, width, height relative to these [m].
MEAN_DIMENSIONS_M = (4.3, 1.8, 1.55)
#: Input values are (grey level / 255 - MEAN) / DEVIATION; pixels outside the picture are 0.
MEAN, DEVIATION = 0.5, 0.25
#: Keypoint states of the simulator's `sights.npy`.
VISIBLE, SELF_HIDDEN, HIDDEN, OUTSIDE, UNKNOWN = range(5)

"""A detector of one's own, as around any network: python own_detector.py INPUT SEQUENCE

This one takes the largest bright blob of the lower half for a car.
"""

import sys

import numpy

import motorcade


class BrightBlob:
    description = "bright blobs"

    def detect(self, image):
        grey = image if image.ndim == 2 else image.mean(axis=2)
        top = grey.shape[0] // 2
        rows, columns = numpy.nonzero(grey[top:] > 200)
        if len(rows) < 50:
            return []
        box = [columns.min(), rows.min() + top, columns.max(), rows.max() + top]
        return [motorcade.Detection(box, "Car", score=0.5)]


drive = motorcade.run(sys.argv[1], sequence=sys.argv[2], detector=BrightBlob())
print(drive)

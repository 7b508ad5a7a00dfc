"""Classes of the scene network, in the order of its output channels."""

CLASSES: tuple[str, ...] = ("Car", "Truck", "Bus", "Motorcycle")
CAR, TRUCK, BUS, MOTORCYCLE = range(4)

#: COCO class numbers of the teacher (YOLOX) and ours.
FROM_COCO: dict[int, int] = {2: CAR, 7: TRUCK, 5: BUS, 3: MOTORCYCLE}

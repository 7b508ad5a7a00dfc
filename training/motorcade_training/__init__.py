"""Training of motorcade's two networks: scene (vehicle boxes, road) and vehicle (keypoints of a crop)."""

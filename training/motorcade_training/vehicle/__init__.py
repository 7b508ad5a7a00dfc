"""The vehicle network: a crop around a box → keypoints, visibilities, heading, body type, dimensions."""

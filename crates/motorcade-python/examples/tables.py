"""What a saved run says of its vehicles, with pandas: python tables.py RUN"""

import sys

import motorcade

frames, tracks = motorcade.load(sys.argv[1]).to_pandas()
print(f"{frames['speed_mps'].mean():.1f} m/s on average, {frames['status'].value_counts().to_dict()}")
by_vehicle = tracks.groupby(["id", "class"])
summary = by_vehicle.agg(
    frames=("frame", "size"),
    p_moving=("p_moving", "first"),
    speed_mps=("speed_mps", "median"),
    sigma_forward_m=("sigma_forward_m", "median"),
)
print(summary.round(2))

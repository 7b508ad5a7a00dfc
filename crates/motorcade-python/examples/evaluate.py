"""A rendered drive, estimated from pixels and compared with its ground truth: python evaluate.py FOLDER [FRAMES] [WIDTH]"""

import pathlib
import sys

import motorcade

folder = pathlib.Path(sys.argv[1])
frames = int(sys.argv[2]) if len(sys.argv) > 2 else 60
width = int(sys.argv[3]) if len(sys.argv) > 3 else 640
simulation = motorcade.simulate("demo", folder / "drive", frames=frames, width=width)
drive = motorcade.run(simulation.training, sequence=simulation.sequence)
drive.save(folder / "run")
evaluation = motorcade.evaluate(drive, kitti=simulation.training)
print(evaluation)
print(f"ATE {evaluation['ego']['ate_se3_m']:.2f} m over {drive.length_m:.0f} m")

#!/usr/bin/env python3
"""Reads the files of a run with the programs that people have: TrackEval, evo, GTSAM. Called by check_clients.sh.

    scripts/check_clients.py RUN DRIVE EVALUATION.json

DRIVE is the rendered drive of the run in KITTI's tracking layout, EVALUATION.json what `motorcade evaluate --json` says of the run.
"""
import contextlib
import io
import json
import pathlib
import re
import shutil
import sys
import tempfile

import gtsam
import numpy as np
import trackeval
from evo.core import metrics, trajectory
from evo.tools import file_interface

run, drive, evaluation = (pathlib.Path(a) for a in sys.argv[1:])
labels = drive / "training/label_02/0000.txt"
told = json.loads(evaluation.read_text())


def equal(what, found, expected, tolerance):
    print(f"{what}: {found:.6g}, expected {expected:.6g}")
    if not abs(found - expected) <= tolerance * max(1.0, abs(expected)):
        sys.exit(f"{what}: {found} differs from {expected}")


# evo: both trajectory files, and the error of the camera.
tum = file_interface.read_tum_trajectory_file(run / "ego.tum")
kitti = file_interface.read_kitti_poses_file(run / "ego.kitti.txt")
frames = len((run / "frames.csv").read_text().splitlines()) - 1
assert tum.num_poses == kitti.num_poses == frames, (tum.num_poses, kitti.num_poses, frames)
assert np.allclose(tum.positions_xyz, kitti.positions_xyz, atol=1e-5)
truth = file_interface.read_kitti_poses_file(drive / "training/gt_poses/0000.txt")
truth.reduce_to_ids(range(frames))
aligned = trajectory.PosePath3D(poses_se3=kitti.poses_se3)
aligned.align(truth)
ape = metrics.APE(metrics.PoseRelation.translation_part)
ape.process_data((truth, aligned))
equal("evo, ATE after SE(3) alignment [m]", ape.get_statistic(metrics.StatisticsType.rmse), told["ego"]["ate_se3_m"], 1e-4)
for file in (run / "vehicles").glob("*.tum"):
    assert file_interface.read_tum_trajectory_file(file).num_poses > 0, file

# GTSAM: every vertex and edge of the graph, and no lower cost by its own optimiser.
graph, values = gtsam.readG2o(str(run / "graph.g2o"), is3D=True)
lines = (run / "graph.g2o").read_text().splitlines()
vertices, edges = (sum(line.startswith(kind) for line in lines) for kind in ("VERTEX_SE3:QUAT", "EDGE_SE3:QUAT"))
assert (values.size(), graph.size()) == (vertices, edges), (values.size(), vertices, graph.size(), edges)
print(f"GTSAM: {vertices} vertices, {edges} edges, cost {graph.error(values):.6g}")

# TrackEval: its own reader of KITTI results, with a class it does not know of written as one it knows.
names = {line.split()[2] for line in (run / "tracks.kitti.txt").read_text().splitlines()}
known = {"Car", "Van", "Truck", "Pedestrian", "Person", "Cyclist", "Tram", "Misc", "DontCare"}
assert names <= known, names - known
with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    (folder / "truth/label_02").mkdir(parents=True)
    (folder / "results/motorcade/data").mkdir(parents=True)
    shutil.copy(labels, folder / "truth/label_02/0000.txt")
    shutil.copy(run / "tracks.kitti.txt", folder / "results/motorcade/data/0000.txt")
    (folder / "truth/evaluate_tracking.seqmap.training").write_text(f"0000 empty 000000 {frames:06d}\n")
    options = {
        "GT_FOLDER": str(folder / "truth"), "TRACKERS_FOLDER": str(folder / "results"), "OUTPUT_FOLDER": str(folder / "out"),
        "CLASSES_TO_EVAL": ["car"], "SPLIT_TO_EVAL": "training", "PRINT_CONFIG": False,
    }
    dataset = trackeval.datasets.Kitti2DBox(options)
    scores = [trackeval.metrics.HOTA(), trackeval.metrics.CLEAR({"PRINT_CONFIG": False})]
    quiet = {"PRINT_RESULTS": False, "PRINT_CONFIG": False, "TIME_PROGRESS": False, "PLOT_CURVES": False, "LOG_ON_ERROR": None, "BREAK_ON_ERROR": True}
    talk = io.StringIO()
    with contextlib.redirect_stdout(talk):
        results, _ = trackeval.Evaluator(quiet).evaluate([dataset], scores)
    car = results["Kitti2DBox"]["motorcade"]["COMBINED_SEQ"]["car"]
hota, mota, switches = 100 * np.mean(car["HOTA"]["HOTA"]), 100 * car["CLEAR"]["MOTA"], car["CLEAR"]["IDSW"]
print(f"TrackEval, cars: HOTA {hota:.1f}, MOTA {mota:.1f}, {switches} identity switches, {car['CLEAR']['CLR_TP']} of {car['CLEAR']['CLR_TP'] + car['CLEAR']['CLR_FN']} found")
if not (hota > 50 and mota > 50):
    sys.exit("TrackEval scores the rendered drive worse than 50")

# Every row of a CSV file has the columns of its head, and no cell is nan or inf.
for file in run.glob("*.csv"):
    head, *rows = file.read_text().splitlines()
    wrong = [row for row in rows if len(row.split(",")) != len(head.split(",")) or re.search(r"\b(nan|inf)\b", row, re.IGNORECASE)]
    assert not wrong, (file, wrong[:1])

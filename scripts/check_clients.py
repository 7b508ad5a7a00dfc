#!/usr/bin/env python3
"""Reads the files of a run with the programs that people have: TrackEval, evo, GTSAM, g2o. Called by check_clients.sh.

    scripts/check_clients.py RUN DRIVE EVALUATION.json CLASSES LABELS GRAPH.json

DRIVE is the rendered drive of the run in KITTI's tracking layout, EVALUATION.json what `motorcade evaluate --json` says of the run. CLASSES is a run over
labels with a bus and a motorcycle, GRAPH.json what `motorcade graph info --json` says of the graph.
"""
import contextlib
import csv
import io
import json
import pathlib
import re
import shutil
import sys
import tempfile

import g2opy
import gtsam
import numpy as np
import trackeval
from evo.core import metrics, trajectory
from evo.tools import file_interface

run, drive, evaluation, classes, class_labels, graph_info = (pathlib.Path(a) for a in sys.argv[1:])
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

# evo: the motion of the vehicles from frame to frame, of labels that one track shows without a gap.
def object_pose(line):
    x, y, z, ry = map(float, line[13:17])
    pose = np.eye(4)
    pose[:3, :3] = [[np.cos(ry), 0, np.sin(ry)], [0, 1, 0], [-np.sin(ry), 0, np.cos(ry)]]
    pose[:3, 3] = x, y, z
    return pose


def overlap(a, b):
    a, b = (np.array(line[6:10], float) for line in (a, b))
    sides = np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2])
    both = np.prod(sides) if (sides > 0).all() else 0.0
    return both / (np.prod(a[2:] - a[:2]) + np.prod(b[2:] - b[:2]) - both)


of_frame = {"true": {}, "found": {}}
for name, path in (("true", labels), ("found", run / "tracks.kitti.txt")):
    for line in map(str.split, path.read_text().splitlines()):
        of_frame[name].setdefault(int(line[0]), []).append(line)
compared = 0
for vehicle in told["vehicles"]:
    pairs = []
    for frame in range(frames):
        for line in of_frame["true"].get(frame, []):
            seen = float(line[9]) - float(line[7]) >= 40 and float(line[3]) <= 0 and float(line[4]) <= 0 and float(line[15]) <= 50
            found = max(of_frame["found"].get(frame, []), key=lambda other: overlap(line, other), default=None)
            if int(line[1]) == vehicle["label"] and seen and found and overlap(line, found) >= 0.5:
                pairs.append((frame, found[1], truth.poses_se3[frame] @ object_pose(line), kitti.poses_se3[frame] @ object_pose(found)))
    if vehicle["rpe_m_per_m"] is None or len({track for _, track, _, _ in pairs}) != 1 or [p[0] for p in pairs] != list(range(pairs[0][0], pairs[-1][0] + 1)):
        continue
    of_truth, of_run = (trajectory.PosePath3D(poses_se3=[p[k] for p in pairs]) for k in (2, 3))
    for relation, name, unit in ((metrics.PoseRelation.translation_part, "motion_error_m", "m"), (metrics.PoseRelation.rotation_angle_deg, "motion_error_deg", "deg")):
        rpe = metrics.RPE(relation, 1, metrics.Unit.frames, all_pairs=False)
        rpe.process_data((of_truth, of_run))
        equal(f"evo, vehicle {vehicle['label']}, error of motion [{unit}]", rpe.get_statistic(metrics.StatisticsType.rmse), vehicle[name], 2e-3)
    compared += 1
assert compared >= 2, compared

# GTSAM: every vertex and edge of the graph, and no lower cost by its own optimiser.
graph, values = gtsam.readG2o(str(run / "graph.g2o"), is3D=True)
lines = (run / "graph.g2o").read_text().splitlines()
vertices, edges = (sum(line.startswith(kind) for line in lines) for kind in ("VERTEX_SE3:QUAT", "EDGE_SE3:QUAT"))
assert (values.size(), graph.size()) == (vertices, edges), (values.size(), vertices, graph.size(), edges)
print(f"GTSAM: {vertices} vertices, {edges} edges, cost {graph.error(values):.6g}")

# g2o: the same by its own reader, which holds what is fixed, at the cost that `motorcade graph info` states for its errors.
theirs = g2opy.SparseOptimizer()
assert theirs.load(str(run / "graph.g2o"))
assert (len(theirs.vertices()), len(theirs.edges())) == (vertices, edges), (len(theirs.vertices()), vertices, len(theirs.edges()), edges)
fixed = {int(line.split()[1]) for line in lines if line.startswith("FIX")}
assert {number for number, vertex in theirs.vertices().items() if vertex.fixed()} == fixed
theirs.set_algorithm(g2opy.OptimizationAlgorithmLevenberg(g2opy.BlockSolverSE3(g2opy.LinearSolverEigenSE3())))
theirs.initialize_optimization()
theirs.compute_active_errors()
equal("g2o, sum of squared errors", theirs.active_chi2(), json.loads(graph_info.read_text())["cost_mqt"], 1e-6)


def kitti_results(run, truth, folder):
    """The rows of a run as TrackEval reads them, beside true ones."""
    frames = len((run / "frames.csv").read_text().splitlines()) - 1
    (folder / "truth/label_02").mkdir(parents=True)
    (folder / "results/motorcade/data").mkdir(parents=True)
    (folder / "truth/label_02/0000.txt").write_text(truth)
    shutil.copy(run / "tracks.kitti.txt", folder / "results/motorcade/data/0000.txt")
    (folder / "truth/evaluate_tracking.seqmap.training").write_text(f"0000 empty 000000 {frames:06d}\n")
    options = {
        "GT_FOLDER": str(folder / "truth"), "TRACKERS_FOLDER": str(folder / "results"), "OUTPUT_FOLDER": str(folder / "out"),
        "CLASSES_TO_EVAL": ["car"], "SPLIT_TO_EVAL": "training", "PRINT_CONFIG": False,
    }
    return trackeval.datasets.Kitti2DBox(options)


# TrackEval: its own reader of KITTI results, with a class it does not know of written as one it knows.
with tempfile.TemporaryDirectory() as folder:
    dataset = kitti_results(run, labels.read_text(), pathlib.Path(folder))
    scores = [trackeval.metrics.HOTA(), trackeval.metrics.CLEAR({"PRINT_CONFIG": False})]
    quiet = {"PRINT_RESULTS": False, "PRINT_CONFIG": False, "TIME_PROGRESS": False, "PLOT_CURVES": False, "LOG_ON_ERROR": None, "BREAK_ON_ERROR": True}
    talk = io.StringIO()
    with contextlib.redirect_stdout(talk):
        results, _ = trackeval.Evaluator(quiet).evaluate([dataset], scores)
    car = results["Kitti2DBox"]["motorcade"]["COMBINED_SEQ"]["car"]
own = told["tracking2d"]
for name, theirs in {"hota": "HOTA", "det_a": "DetA", "ass_a": "AssA", "loc_a": "LocA"}.items():
    equal(f"TrackEval, {theirs} [%]", 100 * np.mean(car["HOTA"][theirs]), own[name], 1e-6)
for name, (theirs, unit) in {"mota": ("MOTA", 100), "recall": ("CLR_Re", 100), "id_switches": ("IDSW", 1), "fragmentations": ("Frag", 1)}.items():
    equal(f"TrackEval, {theirs}", unit * car["CLEAR"][theirs], own[name], 1e-6)
hota, mota, switches = 100 * np.mean(car["HOTA"]["HOTA"]), 100 * car["CLEAR"]["MOTA"], car["CLEAR"]["IDSW"]
print(f"TrackEval, cars: HOTA {hota:.1f}, MOTA {mota:.1f}, {switches} identity switches, {car['CLEAR']['CLR_TP']} of {car['CLEAR']['CLR_TP'] + car['CLEAR']['CLR_FN']} found")
if not (hota > 50 and mota > 50):
    sys.exit("TrackEval scores the rendered drive worse than 50")

# Buses and motorcycles of a run, as TrackEval numbers the classes that they are written as.
written = {"Bus": "Truck", "Motorcycle": "Misc"}
truth = class_labels.read_text()
for name, theirs in written.items():
    assert f" {name} " in truth, name
    truth = truth.replace(f" {name} ", f" {theirs} ")
with (classes / "tracks.csv").open() as file:
    own = {(int(row["frame"]), int(row["id"])): row["class"] for row in csv.DictReader(file)}
with tempfile.TemporaryDirectory() as folder:
    dataset = kitti_results(classes, truth, pathlib.Path(folder))
    number_of = dataset.class_name_to_class_id
    raw = dataset.get_raw_seq_data("motorcade", "0000")
    read = {}
    for frame, (ids, kinds) in enumerate(zip(raw["tracker_ids"], raw["tracker_classes"])):
        for identity, kind in zip(ids, kinds):
            name = own[frame, int(identity)]
            assert int(kind) == number_of[written.get(name, name).lower()], (frame, identity, name, kind)
            read[name] = read.get(name, 0) + 1
    dataset.get_preprocessed_seq_data(raw, "car")
print("TrackEval, classes: " + ", ".join(f"{count} rows of a {name} read as {written.get(name, name)}" for name, count in read.items()))
assert set(written) <= set(read), read

# Every row of a CSV file has the columns of its head, and no cell is nan or inf.
for file in run.glob("*.csv"):
    head, *rows = file.read_text().splitlines()
    wrong = [row for row in rows if len(row.split(",")) != len(head.split(",")) or re.search(r"\b(nan|inf)\b", row, re.IGNORECASE)]
    assert not wrong, (file, wrong[:1])

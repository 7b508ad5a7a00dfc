"""Labels, crops and decoding of the scene network."""

import numpy as np
import torch

from motorcade_training.scene.assign import assign, cells
from motorcade_training.scene.augment import move
from motorcade_training.scene.average_precision import AveragePrecision
from motorcade_training.scene.classes import CAR, CLASSES, TRUCK
from motorcade_training.scene.decode import decode_boxes
from motorcade_training.scene.evaluate import Camera, lane_mask
from motorcade_training.scene.fuse import IGNORE, FuseOptions, fuse
from motorcade_training.scene.teacher import merge


def boxes(*rows):
    return np.array(rows, np.float32).reshape(-1, 4)


def test_fusing_takes_the_teacher_where_both_see_a_vehicle():
    labels = boxes([10, 100, 50, 130], [200, 100, 240, 130])
    teacher = boxes([11, 101, 52, 131], [400, 100, 440, 130], [500, 100, 520, 120], [600, 100, 700, 180])
    scores = np.array([0.6, 0.9, 0.2, 0.2], np.float32)
    found, kinds = fuse(labels, teacher, scores, np.array([TRUCK, CAR, CAR, CAR]), (64, 320), FuseOptions())
    by_left = {int(b[0]): k for b, k in zip(found, kinds)}
    # Refined, label alone, teacher alone, doubtful; the large doubtful one is background.
    assert by_left == {11: TRUCK, 200: CAR, 400: CAR, 500: IGNORE}


def test_boxes_cut_off_where_the_teacher_stops_looking_keep_the_label():
    found, _ = fuse(boxes([0, 40, 60, 120]), boxes([0, 64, 60, 120]), np.array([0.9]), np.array([CAR]), (64, 320), FuseOptions())
    assert found[0, 1] == 40


def test_views_agree():
    one = (boxes([0, 0, 10, 10]), np.array([0.8], np.float32), np.array([CAR]))
    other = (boxes([2, 0, 12, 10]), np.array([0.8], np.float32), np.array([CAR]))
    found, scores, _ = merge([one, other])
    assert np.allclose(found, [[1, 0, 11, 10]]) and np.isclose(scores[0], 0.8)
    _, scores, _ = merge([one, (boxes(), np.zeros(0, np.float32), np.zeros(0, int))])
    assert np.isclose(scores[0], 0.4)


def test_boxes_follow_mirror_and_scale():
    mirrored = move(boxes([10, 20, 30, 40]), np.array([[-2.0, 0, 199], [0, 2.0, 0]]))
    assert np.allclose(mirrored, [[139, 40, 179, 80]])


def test_decoding_inverts_encoding():
    wanted = boxes([33, 41, 64, 71], [10, 8, 150, 90])
    outputs = [np.zeros((1, len(CLASSES) + 4, 128 // s, 192 // s), np.float32) for s in (8, 16)]
    for box, output, stride, kind, score in zip(wanted, outputs, (8, 16), (CAR, TRUCK), (0.9, 0.7)):
        x, y = (int((box[k] + box[k + 2]) / 2 / stride) for k in (0, 1))
        centre = np.array([(x + 0.5) * stride, (y + 0.5) * stride])
        output[0, kind, y, x] = score
        output[0, len(CLASSES) :, y, x] = [*(centre - box[:2]), *(box[2:] - centre)]
    found, scores, kinds = decode_boxes(outputs)
    assert np.allclose(found, wanted) and kinds.tolist() == [CAR, TRUCK] and np.allclose(scores, [0.9, 0.7])


def test_assignment_prefers_cells_that_predict_the_box():
    centres, strides = cells(64, 96, torch.device("cpu"))
    target = torch.tensor([[20.0, 20.0, 52.0, 44.0]])
    predicted = target.repeat(len(centres), 1)
    predicted[::2] += 12
    result = assign(torch.full((len(centres), len(CLASSES)), 0.3), predicted, centres, strides, target, torch.tensor([CAR]))
    chosen = torch.nonzero(result.box == 0).flatten()
    assert len(chosen) > 0 and (strides[chosen] == 8).all()
    assert result.quality.max().item() > 0.99 and (result.quality[chosen[chosen % 2 == 0]] <= 0.99).all()


def test_average_precision_of_perfect_and_empty_answers():
    labels = boxes([0, 0, 10, 10], [20, 0, 30, 10])
    perfect = AveragePrecision()
    perfect.add(labels, np.array([0.9, 0.8]), labels, boxes())
    assert perfect.value() == 1.0
    half = AveragePrecision()
    half.add(boxes([0, 0, 10, 10], [50, 50, 60, 60]), np.array([0.9, 0.95]), labels, boxes([45, 45, 70, 70]))
    assert abs(half.value() - 0.5) < 1e-9


def test_own_lane_is_as_wide_as_it_should_be():
    mask = lane_mask(Camera(720, 600, 180, 1.65), 375, 1242)
    # 10 m ahead: row 180 + 720 x 1.65 / 10.
    assert abs(mask[299].sum() - 720 * 3.5 / 10) < 3
    assert not mask[180 + int(720 * 1.65 / 31)].any()

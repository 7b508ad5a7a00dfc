"""The object that takes frames, and detectors written in Python."""

import threading

import numpy as np
import pytest

import motorcade


class Boxes:
    """Gives the simulation's boxes back, in any of the accepted forms."""

    description = "boxes of the simulation"

    def __init__(self, simulation, form):
        self.form, self.frame, self.boxes = form, -1, {}
        for line in simulation.detections.read_text().splitlines():
            words = line.split()
            edges, score = [float(word) for word in words[6:10]], float(words[17])
            self.boxes.setdefault(int(words[0]), []).append((edges, words[2], score))

    def detect(self, image):
        assert image.dtype == np.uint8 and image.shape[:2] == (121, 400)
        self.frame += 1
        found = self.boxes.get(self.frame, [])
        if self.form == "list":
            return [motorcade.Detection(*one) for one in found]
        if self.form == "array":
            return np.array([[*edges, score] for edges, _, score in found]).reshape(-1, 5)
        return [e for e, _, _ in found], [c for _, c, _ in found], np.array([s for _, _, s in found])


def slam_of(camera, **more):
    return motorcade.Motorcade(camera, 1.65, models="none", run={"fixed_regions": False}, **more)


def test_frames_in_memory_give_estimates_and_a_drive(frames, simulation, tmp_path):
    camera, pictures = frames
    slam = slam_of(camera, detector=Boxes(simulation, "list"))
    estimates = [slam.step(picture, time_ns) for time_ns, picture in pictures]
    assert len(slam) == len(pictures) and [e.frame for e in estimates] == list(range(len(pictures)))
    last = estimates[-1]
    assert last.pose.shape == (4, 4) and last.covariance.shape == (6, 6) and last.road_normal.shape == (3,)
    assert 5.0 < last.speed_mps < 12.0 and last.time_s == pytest.approx(2.3)
    vehicle = last.vehicles[0]
    assert vehicle.pose.shape == (4, 4) and vehicle.covariance.shape == (6, 6) and vehicle.size_m.shape == (3,)
    assert last.camera_from_vehicle(vehicle)[2, 3] > 3.0
    drive = slam.finish()
    assert len(drive) == len(pictures) and drive.vehicles and drive.camera == camera
    drive.save(tmp_path / "run")
    assert len(motorcade.load(tmp_path / "run")) == len(pictures)
    for call in (slam.finish, lambda: slam.step(pictures[0][1], 10**12)):
        with pytest.raises(motorcade.Error, match="finished"):
            call()


@pytest.mark.parametrize("form", ["list", "array", "tuple"])
def test_detections_in_every_form_give_the_same_drive(frames, simulation, form):
    camera, pictures = frames
    drives = []
    for one in ("list", form):
        slam = slam_of(camera, detector=Boxes(simulation, one))
        for time_ns, picture in pictures[:12]:
            slam.push(picture, time_ns)
        drives.append(slam.finish())
    np.testing.assert_array_equal(drives[0].poses, drives[1].poses)
    assert len(drives[0].vehicles) == len(drives[1].vehicles)


def test_pictures_may_lie_in_memory_in_any_order(frames):
    camera, pictures = frames
    plain, mirrored, grey, planes = (slam_of(camera) for _ in range(4))
    for time_ns, picture in pictures[:6]:
        plain.push(picture, time_ns)
        mirrored.push(np.ascontiguousarray(picture[..., ::-1])[..., ::-1], time_ns)
        planes.push(np.asfortranarray(picture), time_ns)
        grey.push(picture[..., 1], time_ns, ignore=np.zeros(picture.shape[:2], bool))
    poses = plain.finish().poses
    np.testing.assert_array_equal(mirrored.finish().poses, poses)
    np.testing.assert_array_equal(planes.finish().poses, poses)
    assert len(grey.finish()) == 6


def test_a_missing_frame_keeps_its_row(frames):
    camera, pictures = frames
    slam = slam_of(camera)
    for k, (time_ns, picture) in enumerate(pictures):
        if k == 10:
            slam.skip(time_ns, reason="lost on the way")
        else:
            slam.push(picture, time_ns)
    assert any("lost on the way" in warning for warning in slam.warnings)
    drive = slam.finish()
    assert len(drive) == len(pictures) and drive.status[10] == "bridged"


def test_what_is_no_picture_is_refused(frames):
    camera, pictures = frames
    slam = slam_of(camera)
    picture = pictures[0][1]
    for image, said in [
        (picture.astype(float), "float64 of shape"),
        (picture[:, :-1], "calibrate for this size"),
        (picture[..., :2], "shape"),
        ("picture", "str"),
        (picture[0, 0, 0], "uint8"),
    ]:
        with pytest.raises(motorcade.InputError, match=said):
            slam.step(image, 0)
    with pytest.raises(motorcade.InputError, match="ignore"):
        slam.step(picture, 0, ignore=np.zeros((3, 3), np.uint8))
    slam.step(picture, 0)
    with pytest.raises(motorcade.InputError, match="not after"):
        slam.step(picture, 0)
    with pytest.raises(motorcade.InputError, match="must increase"):
        slam.step(picture, 1, number=0)
    assert len(slam) == 1


def test_cameras_that_cannot_be_are_refused(frames):
    camera, _ = frames
    fields = {"fx": 100.0, "fy": 100.0, "cx": 50.0, "cy": 20.0}
    for given, height_m, said in [
        (fields, 1.5, "width and height"),
        ({**fields, "width": 100, "height": 40, "distortion": (0.1, 0, 0, 0, 0)}, 1.5, "undistorted"),
        ({**fields, "width": 100, "height": 40, "model": "fisheye", "distortion": (0, 0, 0, 0)}, 1.5, "undistorted"),
        ({**fields, "model": "fisheye", "distortion": (0, 0, 0, 0, 0)}, 1.5, "fisheye lens has 4 coefficients, got 5"),
        ({**fields, "model": "omni"}, 1.5, "none of radial-tangential"),
        ({**fields, "focus": 3}, 1.5, "focus"),
        (camera, None, "height_m"),
        (camera, -1.0, "height of the camera"),
        (3.0, 1.5, "expected a Camera"),
    ]:
        with pytest.raises(motorcade.SettingsError, match=said):
            motorcade.Motorcade(given, height_m, models="none")


def test_errors_of_a_detector_come_back_as_they_were(frames, arguments):
    class Broken:
        def detect(self, image):
            raise ZeroDivisionError("in the detector")

    class Strange:
        def __init__(self, found):
            self.found = found

        def detect(self, image):
            return self.found

    camera, pictures = frames
    slam = slam_of(camera, detector=Broken())
    with pytest.raises(ZeroDivisionError, match="in the detector"):
        slam.step(pictures[0][1], 0)
    rest = {key: value for key, value in arguments.items() if key != "detections"}
    for threads in (1, 2):
        with pytest.raises(ZeroDivisionError, match="in the detector"):
            motorcade.run(**rest, detector=Broken(), threads=threads)
    box = [10.0, 10.0, 20.0, 20.0]
    for found, said in [
        ([motorcade.Detection(box, "Bicycle")], "Bicycle"),
        ([motorcade.Detection([20.0, 10.0, 10.0, 20.0])], "x1 < x2"),
        (([box], ["Car", "Car"], [1.0]), "1 boxes, 2 classes"),
        (np.array([[1.0, 2.0, np.nan, 4.0]]), "finite"),
        (np.zeros((2, 3)), "shape"),
        (7, "detect returned int"),
    ]:
        with pytest.raises(motorcade.InputError, match=said):
            slam_of(camera, detector=Strange(found)).step(pictures[0][1], 0)
    with pytest.raises(motorcade.SettingsError, match="no method detect"):
        slam_of(camera, detector=object())


def test_a_detector_in_python_takes_the_place_of_a_file(arguments, simulation, drive):
    rest = {key: value for key, value in arguments.items() if key != "detections"}
    own = motorcade.run(**rest, detector=Boxes(simulation, "list"))
    assert len(own.vehicles) == len(drive.vehicles)
    np.testing.assert_allclose(own.poses, drive.poses, atol=0.05)
    with pytest.raises(motorcade.SettingsError, match="not both"):
        motorcade.run(**arguments, detector=Boxes(simulation, "list"))


def test_the_lock_of_the_interpreter_is_released(frames):
    camera, pictures = frames
    slam, ticks, stop = slam_of(camera), [], threading.Event()

    def tick():
        while not stop.wait(0.001):
            ticks.append(1)

    thread = threading.Thread(target=tick)
    thread.start()
    for time_ns, picture in pictures:
        slam.push(picture, time_ns)
    stop.set()
    thread.join()
    assert len(ticks) > 5


def test_two_calls_at_once_are_refused(frames):
    camera, pictures = frames

    class Caller:
        def detect(self, image):
            len(slam)
            return []

    slam = slam_of(camera, detector=Caller())
    with pytest.raises(motorcade.Error, match="another call"):
        slam.step(pictures[0][1], 0)

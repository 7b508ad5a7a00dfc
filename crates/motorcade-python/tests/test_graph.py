"""Pose graphs."""

import numpy as np
import pytest

import motorcade


def planar(x, y, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


def spatial(x, y, angle):
    pose = np.eye(4)
    pose[:2, :2], pose[:2, 3] = planar(0, 0, angle)[:2, :2], (x, y)
    return pose


def square(pose, dof, **more):
    """Four steps of 1 m with a quarter turn each end where they began."""
    graph = motorcade.PoseGraph()
    graph.add_vertex(0, pose(0.0, 0.0, 0.0), fixed=True)
    for k in range(1, 4):
        graph.add_vertex(10 * k, pose(0.3 * k, 0.5, 0.2 + k * np.pi / 2))
    for k in range(4):
        graph.add_edge(10 * k, 10 * ((k + 1) % 4), pose(1.0, 0.0, np.pi / 2), 100.0 * np.eye(dof), **more)
    return graph


@pytest.mark.parametrize(("pose", "dof"), [(planar, 3), (spatial, 6)])
@pytest.mark.parametrize("more", [{}, {"robust": "cauchy:3.5"}])
def test_a_square_closes(pose, dof, more):
    graph = square(pose, dof, **more)
    rows = []
    report = graph.optimise(progress=lambda *what: rows.append(what))
    assert report["converged"] and report["final_cost"] < 1e-9 < report["initial_cost"]
    assert report["unknowns"] == 3 * dof and rows[0] == ("graph", 0, 100)
    np.testing.assert_allclose(graph.pose(20)[:2, -1], [1.0, 1.0], atol=1e-6)
    assert graph.ids == [0, 10, 20, 30] and len(graph) == graph.edge_count == 4
    assert graph.cost() == pytest.approx(report["final_cost"])


def test_covariances_are_those_of_dense_algebra():
    graph = motorcade.PoseGraph()
    for k in range(3):
        graph.add_vertex(k, planar(float(k), 0.0, 0.0), fixed=k == 0)
    information = np.diag([400.0, 25.0, 100.0])
    for k in range(2):
        graph.add_edge(k, k + 1, planar(1.0, 0.0, 0.0), information)
    marginals = graph.marginals()
    step = np.linalg.inv(information)
    np.testing.assert_allclose(marginals.covariance(1), step, atol=1e-12)
    # y of the second step is turned by the error of the first one's angle.
    adjoint = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]])
    np.testing.assert_allclose(marginals.covariance(2), adjoint @ step @ adjoint.T + step, atol=1e-12)
    joint = marginals.joint([2, 1])
    assert joint.shape == (6, 6)
    np.testing.assert_allclose(joint[:3, 3:], marginals.cross(2, 1), atol=1e-15)
    np.testing.assert_array_equal(marginals.covariance(0), np.zeros((3, 3)))


def test_files_are_written_and_read(tmp_path):
    graph, path = square(spatial, 6), tmp_path / "square.g2o"
    graph.write(path)
    read = motorcade.PoseGraph.read(path)
    assert graph.to_g2o() == path.read_text() and repr(read) == "PoseGraph(4 vertices, 4 edges)"
    for k in graph.ids:
        np.testing.assert_allclose(read.pose(k), graph.pose(k), atol=1e-14)
    assert read.optimise(method="dogleg", start="chordal", threads=2)["converged"]
    with pytest.raises(motorcade.SettingsError, match="force=True"):
        graph.write(path)
    read.write(path, force=True)
    with pytest.raises(motorcade.InputError, match="nowhere"):
        motorcade.PoseGraph.read(tmp_path / "nowhere.g2o")


def test_what_cannot_be_is_refused():
    graph = square(planar, 3)
    for call, kind, said in [
        (lambda: graph.add_vertex(0, np.eye(3)), motorcade.InputError, "there already"),
        (lambda: graph.add_vertex(5, np.eye(6)), motorcade.InputError, "4×4"),
        (lambda: graph.add_vertex(5, np.eye(5)), motorcade.InputError, "shape"),
        (lambda: graph.add_vertex(5, np.full((4, 4), np.nan)), motorcade.InputError, "NaN"),
        (lambda: graph.add_vertex(5, 2.0 * np.eye(4)), motorcade.InputError, "rotation"),
        (lambda: graph.add_edge(0, 99, np.eye(3), np.eye(3)), motorcade.InputError, "99"),
        (lambda: graph.add_edge(0, 10, np.eye(4), np.eye(6)), motorcade.GraphError, "not a"),
        (lambda: graph.add_edge(0, 10, np.eye(3), np.eye(6)), motorcade.InputError, "information"),
        (lambda: graph.add_edge(0, 10, np.eye(3), -np.eye(3)), motorcade.GraphError, "information"),
        (lambda: graph.add_edge(0, 10, np.eye(3), np.eye(3), robust="square:2"), motorcade.SettingsError, "robust"),
        (lambda: graph.pose(7), motorcade.InputError, "no vertex 7"),
        (lambda: graph.optimise(method="magic"), motorcade.SettingsError, "method"),
        (lambda: graph.optimise(start="moon"), motorcade.SettingsError, "moon"),
        (lambda: graph.optimise(time_limit_s=-1.0), motorcade.SettingsError, "time_limit_s"),
    ]:
        with pytest.raises(kind, match=said):
            call()
    graph.release(0)
    with pytest.raises(motorcade.GraphError, match="fix"):
        graph.marginals()
    # Held at its first vertex meanwhile.
    assert graph.optimise()["converged"]
    graph.fix(0)
    assert graph.marginals().covariance(10).shape == (3, 3)

#!/usr/bin/env python3
"""Time g2o on a g2o file, from outside.    time_g2o.py GRAPH.g2o COST [REPEATS]

    pip install g2o-python "numpy<2"

For Gauss-Newton and Levenberg-Marquardt the least number of iterations, up to 30, that leads from the file's vertices to
COST (`mqt`, within 1e-6), and the least CPU seconds of that many, ordering included, over REPEATS. Cholesky by Eigen on
6x6 blocks; the first vertex is held.
"""
import sys
import time

import g2o
import numpy as np


def read(path):
    vertices, edges = {}, []
    for line in open(path):
        word = line.split()
        if word[:1] == ["VERTEX_SE3:QUAT"]:
            vertices[int(word[1])] = np.array(word[2:9], float)
        elif word[:1] == ["EDGE_SE3:QUAT"]:
            upper = np.zeros((6, 6))
            upper[np.triu_indices(6)] = np.array(word[10:31], float)
            edges.append((int(word[1]), int(word[2]), np.array(word[3:10], float), upper + np.triu(upper, 1).T))
    return vertices, edges


def isometry(numbers):
    x, y, z, w = numbers[3:] / np.linalg.norm(numbers[3:])
    return g2o.Isometry3d(g2o.Quaternion(w, x, y, z), numbers[:3])


def solve(graph, method, iterations):
    vertices, edges = graph
    optimiser = g2o.SparseOptimizer()
    algorithm = {"gn": g2o.OptimizationAlgorithmGaussNewton, "lm": g2o.OptimizationAlgorithmLevenberg}[method]
    optimiser.set_algorithm(algorithm(g2o.BlockSolverSE3(g2o.LinearSolverEigenSE3())))
    for k, numbers in vertices.items():
        vertex = g2o.VertexSE3()
        vertex.set_id(k)
        vertex.set_estimate(isometry(numbers))
        vertex.set_fixed(k == min(vertices))
        optimiser.add_vertex(vertex)
    for i, j, numbers, information in edges:
        edge = g2o.EdgeSE3()
        edge.set_vertex(0, optimiser.vertex(i))
        edge.set_vertex(1, optimiser.vertex(j))
        edge.set_measurement(isometry(numbers))
        edge.set_information(information)
        optimiser.add_edge(edge)
    start = time.process_time()
    optimiser.initialize_optimization()
    optimiser.optimize(iterations)
    seconds = time.process_time() - start
    optimiser.compute_active_errors()
    return seconds, optimiser


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    graph, cost, repeats = read(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 3
    for method in ("gn", "lm"):
        reached = (n for n in range(1, 31) if solve(graph, method, n)[1].chi2() <= cost * (1 + 1e-6))
        iterations = next(reached, None)
        if iterations is None:
            print(f"{method}: does not reach the cost")
            continue
        seconds = min(solve(graph, method, iterations)[0] for _ in range(repeats))
        print(f"{method}: {1e3 * seconds:.1f} ms, {iterations} iterations")


if __name__ == "__main__":
    main()

"""A pose graph alone: a noisy drive around the block, closed by one loop edge."""

import numpy

import motorcade

random = numpy.random.default_rng(1)


def pose(x: float, y: float, angle: float) -> numpy.ndarray:
    c, s = numpy.cos(angle), numpy.sin(angle)
    return numpy.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


sigmas = numpy.array([0.01, 0.05, 0.05])  # rad, m, m
information = numpy.diag(sigmas**-2)
graph = motorcade.PoseGraph()
place = pose(0.0, 0.0, 0.0)
graph.add_vertex(0, place, fixed=True)
for k in range(40):
    turn = numpy.pi / 2 if k % 10 == 9 else 0.0
    angle, x, y = numpy.array([turn, 1.0, 0.0]) + sigmas * random.standard_normal(3)
    motion = pose(x, y, angle)
    place = place @ motion
    graph.add_vertex(k + 1, place)
    graph.add_edge(k, k + 1, motion, information)
graph.add_edge(40, 0, pose(0.0, 0.0, 0.0), information, robust="cauchy:3.5")

before = numpy.hypot(*graph.pose(40)[:2, 2])
report = graph.optimise()
after = numpy.hypot(*graph.pose(40)[:2, 2])
sigma = numpy.sqrt(numpy.diag(graph.marginals().covariance(20)))
print(f"{report['termination']} after {report['iterations']} iterations, cost {report['final_cost']:.1f}")
print(f"gap {before:.2f} m before, {after:.2f} m after; halfway ± {sigma[1]:.2f} m, ± {numpy.degrees(sigma[0]):.1f}°")

"""Linkages that tests open."""

import limber
import numpy as np
import pytest

RECTANGLE = {"rectangle": (0.02, 0.005)}


def grid(rods=3):
    """Two families of `rods` straight rods, flat: rods x rods joints of valence 4 but for the rim's."""
    points = [(i + 0.1 * j, j, 0) for i in range(rods) for j in range(rods)]
    along = [(i * rods + j, (i + 1) * rods + j) for i in range(rods - 1) for j in range(rods)]
    across = [(i * rods + j, i * rods + j + 1) for i in range(rods) for j in range(rods - 1)]
    return np.array(points, dtype=float), np.array(along + across)


def strip(edges=8):
    """A rod of 1 m along x, from joint 0 over joint 2 in its middle to joint 1, with a short piece across it at each."""
    points = [(x, y, 0) for x in (0, 1, 0.5) for y in (-0.05, 0, 0.05)]
    across = [(3 * i + j, 3 * i + j + 1) for i in range(3) for j in range(2)]
    return limber.linkage_scene(points, across + [(1, 7), (7, 4)], section=RECTANGLE, edges_per_segment=edges)


@pytest.fixture
def linkage(server):
    """The sample hyperboloid in equilibrium."""
    opened = server.open(sample="hyperboloid", progress=False)
    yield opened
    try:
        opened.close()
    except limber.LimberError as error:
        assert error.code in ("NOT_FOUND", "FAILED_PRECONDITION")

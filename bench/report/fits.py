"""Power laws y = a x^p through measured points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence


@dataclass
class PowerLaw:
    """p and a of y = a x^p by least squares of logarithms.

    spread: the largest factor by which a point lies off it, >= 1.
    last: the exponent between the last two points alone; above p where growth gets steeper.
    """

    exponent: float
    factor: float
    spread: float
    last: float

    def at(self, x: float) -> float:
        return self.factor * x**self.exponent


def fit(x: "Sequence[float]", y: "Sequence[float]") -> PowerLaw:
    """Raises ValueError for fewer than three points, other than positive numbers, or a single x."""
    if len(x) != len(y) or len(x) < 3:
        raise ValueError(f"a power law needs three points at least, there are {min(len(x), len(y))}")
    if min(x) <= 0 or min(y) <= 0:
        raise ValueError("a power law needs positive numbers")
    points = sorted(zip(x, y))
    u = [math.log(a) for a, _ in points]
    v = [math.log(b) for _, b in points]
    middle_u, middle_v = sum(u) / len(u), sum(v) / len(v)
    width = sum((a - middle_u) ** 2 for a in u)
    if width == 0 or u[-1] == u[-2]:
        raise ValueError("a power law needs different x")
    exponent = sum((a - middle_u) * (b - middle_v) for a, b in zip(u, v)) / width
    start = middle_v - exponent * middle_u
    spread = math.exp(max(abs(b - start - exponent * a) for a, b in zip(u, v)))
    return PowerLaw(exponent, math.exp(start), spread, (v[-1] - v[-2]) / (u[-1] - u[-2]))

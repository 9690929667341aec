"""Ends of laths beyond their outer holes, of laths that no server has made."""

import csv
import io

import limber
import pytest
from limber.laths import EDGE_DISTANCE, Hole, Lath, Laths, drilled


def lath(length, *places):
    """20 mm wide, of one part."""
    holes = tuple(Hole(joint, float(at), (1,), 90.0, 0.0, 0.0, 0.0) for joint, at in enumerate(places))
    return Lath(0, (0,), float(length), (0.0, float(length)), (20.0,), (5.0,), holes, False, 0.0)


def laths_of(*made, overhang=None, hole=None, edge_distance=EDGE_DISTANCE):
    longer, diameter, apart = drilled(made, overhang, hole, edge_distance)
    return Laths("grid", "mm", "rectangle 20 x 5", longer, 1e10, diameter, apart, 1, True)


def ends(one):
    return one.holes[0].at, one.length - one.holes[-1].at


def test_ends_that_are_drawn_too_short_are_made_longer():
    """1.5 diameters of 4 mm at least; what is drawn counts, and what is drawn longer stays."""
    for places, expected in (((0, 100), (6, 6)), ((1, 100), (6, 6)), ((1, 99.5), (6, 6)), ((25, 97), (25, 6)),
                             ((50,), (50, 50))):
        made = laths_of(lath(100, *places))
        assert ends(made[0]) == pytest.approx(expected)
        assert made[0].cuts == pytest.approx((0, made[0].length))
        rows = list(csv.DictReader(io.StringIO(made.csv())))
        assert float(rows[0]["at_mm"]) == pytest.approx(expected[0])
        assert float(rows[0]["length_mm"]) == pytest.approx(made[0].length)
    assert ends(laths_of(lath(100, 1, 80), overhang=10)[0]) == pytest.approx((10, 20))
    assert ends(laths_of(lath(100, 1, 80), hole=8, edge_distance=2)[0]) == pytest.approx((16, 20))
    assert laths_of(lath(100))[0].length == 100


def test_drawings_keep_the_edge_distance(tmp_path):
    path, made = tmp_path / "laths.svg", laths_of(lath(100, 0, 100))
    with pytest.raises(limber.LimberError, match="6 mm from the end of lath 0, less than 1.5 diameters") as caught:
        made.save_svg(path, hole=10)
    assert caught.value.field == "hole" and not path.exists()
    # As near to the ends as laths() was asked for.
    for given in ({"hole": 10}, {"overhang": 15}):
        assert laths_of(lath(100, 0, 100), **given).save_svg(path, hole=10)
    assert laths_of(lath(100, 0, 100), overhang=5).save_svg(path)
    assert laths_of(lath(100, 0, 100), edge_distance=0.6).save_svg(path, hole=3)
    with pytest.raises(limber.LimberError, match="cuts the end of lath 0"):
        laths_of(lath(100, 0, 100), overhang=1.9).save_svg(path)

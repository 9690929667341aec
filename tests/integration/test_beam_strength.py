"""Beams that are stressed beyond their yield stress are told, everywhere."""

import subprocess
import warnings

import pytest

import limber

HEAVY = 4e4  # N on the tip of a thin arm


def arm(force):
    """1 m along x, clamped at node 0, steel of 10 mm by 10 mm."""
    return {"nodes": [{"position": {"x": i / 10}} for i in range(11)],
            "sections": [{"rectangle": {"width": 0.01, "height": 0.01}, "young": 2.1e11, "poisson": 0.3, "yield_stress": 3.5e8}],
            "elements": [{"start": i, "finish": i + 1} for i in range(10)],
            "supports": [{"node": 0, "fix_x": True, "fix_y": True, "fix_z": True, "fix_rotation_x": True, "fix_rotation_y": True,
                          "fix_rotation_z": True}],
            "loads": [{"node": 10, "force": {"z": -force}}]}


def test_overloaded_structures_are_warned_of(server, limberd):
    session = server.open({"beams": {"structure": arm(10)}}, session="arm")
    with warnings.catch_warnings():
        warnings.simplefilter("error", limber.StrengthWarning)
        assert 0.05 < session.wait().utilisation < 1
        assert session.solution().utilisation == pytest.approx(session.wait().utilisation)
    session.load(10, force=(0, 0, -HEAVY))
    with pytest.warns(limber.StrengthWarning, match=r"session arm is overloaded: .* times the yield stress"):
        result = session.wait()
    with pytest.warns(limber.StrengthWarning):
        solution = session.solution()
    assert solution.utilisation == pytest.approx(result.utilisation) and result.utilisation > 10
    command = [str(limberd.parent / "limber"), "--endpoint", server.connection.endpoint]
    for words in (["show", "arm"], ["wait", "arm"], ["gravity", "arm", "0", "0", "-9"]):
        shown = subprocess.run(command + words, capture_output=True, text=True, check=True).stdout
        assert ("OVERLOADED" in shown) == (words[0] != "gravity"), shown
    session.close()
    with pytest.warns(limber.StrengthWarning, match="the structure is overloaded"):
        assert server.solve_beams(arm(HEAVY)).utilisation > 10

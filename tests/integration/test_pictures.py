"""Pictures of sessions of every kind, and the numbers that colour them."""

import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import tip_of
from limber.bodies import strains
from limber.bodies.tet_materials import TetMaterials
from linkage_inputs import linkage  # noqa: F401
from refusals import refusal
from test_saved_motions import arch


@pytest.fixture
def beams(server):
    opened = server.open(arch(), progress=False)
    opened.move_support(8, x=-0.3)
    opened.wait()
    yield opened
    opened.close()


def inked(path):
    """Share of pixels that are not white, and how many different colours they have."""
    from matplotlib import image
    pixels = image.imread(path)[:, :, :3]
    drawn = pixels[pixels.min(axis=2) < 0.98]
    return len(drawn) / pixels[:, :, 0].size, len(np.unique((drawn * 32).astype(int), axis=0))


def test_every_kind_is_drawn_in_its_colours(session, linkage, beams, tmp_path):  # noqa: F811
    pytest.importorskip("matplotlib")
    session.add(node=tip_of(session), frame=30, displacement=(0, 0.4, 0))
    session.wait()
    linkage.deploy(60)
    linkage.wait()
    for name, opened, frame in (("body", session, 30), ("linkage", linkage, -1), ("beams", beams, -1)):
        for colour in opened.COLOURS:
            path = opened.picture(tmp_path / f"{name}_{colour}.png", colour=colour, frame=frame, yield_stress=1e8)
            share, colours = inked(path)
            assert share > 0.01 and colours > (2 if colour == "none" else 20), path
        assert "<svg" in opened.picture(tmp_path / f"{name}.svg", title="a < b").read_text()
    first = session.picture(tmp_path / "first.png", frame=0).read_bytes()
    assert first != session.picture(tmp_path / "other.png", frame=30).read_bytes()
    assert first != session.picture(tmp_path / "side.png", frame=0, view=(30, 0)).read_bytes()


def test_strains_and_stresses():
    """A tet that is stretched by 10 % along x and narrows as its material does, and turned."""
    rest = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 1.5), (3, 3, 3)], dtype=float)
    tets = np.array([(0, 1, 2, 3), (1, 2, 3, 4)])
    turn = np.array([(0, -1, 0), (1, 0, 0), (0, 0, 1.0)])
    green, young, poisson = (1.1 ** 2 - 1) / 2, 2e6, 0.3
    narrow = np.sqrt(1 - 2 * poisson * green)
    moved = (rest * (1.1, narrow, narrow)) @ turn.T + 5
    gradient = strains.gradients(rest, tets, moved)
    assert np.allclose(gradient, turn @ np.diag([1.1, narrow, narrow]))
    assert strains.largest_strain(gradient) == pytest.approx(0.1)
    # One stress alone: E times Green's strain, pushed to the shape as it is now.
    materials = TetMaterials(np.array([young, 3 * young]), np.array([poisson, poisson]), np.array([1.0, 1.0]))
    expected = young * green * 1.1 / narrow ** 2
    assert strains.von_mises(gradient, materials) == pytest.approx([expected, 3 * expected])
    assert strains.tets_of(np.array([(2, 0, 1), (4, 3, 2), (3, 4, 1)]), tets).tolist() == [0, 1, 1]


def test_colours_are_what_the_kinds_tell(session, linkage, beams):  # noqa: F811
    session.add(node=tip_of(session), frame=30, displacement=(0, 0.4, 0))
    session.wait()
    shown = session.coloured("displacement", 30)
    moved = np.linalg.norm(session.frames()[30] - session.geometry().rest, axis=1)
    assert shown.values == pytest.approx(moved[session.geometry().surface].mean(axis=1), abs=1e-6)
    assert session.coloured("strain", 0).values.max() < 0.1 * session.coloured("strain", 30).values.max()

    linkage.deploy(60)
    linkage.wait()
    solution, shown = linkage.solution(), linkage.coloured("stress", -1)
    assert shown.values.max() == pytest.approx(solution.von_mises_stresses.max(), rel=0.02)
    assert shown.values.min() >= solution.von_mises_stresses.min()
    assert linkage.coloured("utilisation", -1, 1e8).values == pytest.approx(shown.values / 1e8)

    stresses, shown = beams.solution().stresses, beams.coloured("stress", -1)
    assert shown.values.tolist() == np.repeat(stresses, 12).tolist() and len(shown.faces) == 12 * len(stresses)
    assert beams.coloured("displacement", 0).values.max() < beams.coloured("displacement", -1).values.max()


def test_what_is_refused(session, linkage, tmp_path):  # noqa: F811
    path = tmp_path / "a.png"
    assert refusal(lambda: session.picture(tmp_path / "a.bmp")) == ("INVALID_ARGUMENT", "path")
    assert refusal(lambda: session.picture(path, colour="utilisation")) == ("INVALID_ARGUMENT", "colour")
    assert refusal(lambda: session.picture(path, frame=60)) == ("OUT_OF_RANGE", "frame")
    assert refusal(lambda: session.picture(path, view=(1, 2, 3))) == ("INVALID_ARGUMENT", "view")
    assert refusal(lambda: session.picture(tmp_path / "no" / "a.png")) == ("IO", "path")
    assert refusal(lambda: linkage.picture(path, colour="utilisation")) == ("INVALID_ARGUMENT", "yield_stress")
    assert refusal(lambda: linkage.picture(path, colour="stress", frame=0)) == ("INVALID_ARGUMENT", "frame")


def test_commands_without_a_display(server, session, tmp_path):
    environment = dict(os.environ, LIMBER_ENDPOINT=server.connection.endpoint)
    environment.pop("DISPLAY", None)

    def run(*arguments):
        return subprocess.run([sys.executable, "-m", "limber", *map(str, arguments)], env=environment, capture_output=True,
                              text=True, timeout=60)

    drawn = run("picture", session.id, tmp_path / "a.png", "--colour", "strain", "--frame", 30, "--view", 20, 10)
    assert drawn.returncode == 0 and (tmp_path / "a.png").is_file(), drawn.stderr
    saved = run("save", session.id, tmp_path / "a.glb", "--up", "y")
    assert saved.returncode == 0 and saved.stdout.split() == [str(tmp_path / "a.glb")], saved.stderr
    refused = run("picture", session.id, tmp_path / "a.png", "--colour", "taste")
    assert refused.returncode == 1 and "taste" in refused.stderr

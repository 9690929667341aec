"""The examples of the command line, as they are printed in the repository."""

import os
import subprocess

import meshio
import numpy as np
import pytest
from conftest import ROOT

pytestmark = pytest.mark.timeout(120)


@pytest.fixture
def example(limberd, server, tmp_path):
    """Runs examples/NAME.sh in a folder of its own."""
    path = f"{limberd.parent}{os.pathsep}{os.environ['PATH']}"

    def run(name):
        script = ROOT / "examples" / f"{name}.sh"
        assert len(script.read_text().splitlines()) < 30
        process = subprocess.run([str(script), "out"], cwd=tmp_path, capture_output=True, text=True, timeout=110,
                                 env=dict(os.environ, PATH=path, LIMBER_ENDPOINT=server.connection.endpoint))
        assert process.returncode == 0, process.stderr + process.stdout
        assert server.sessions() == [], "it closes what it opens"
        return process.stdout, tmp_path / "out"

    return run


def positions(file):
    return meshio.read(file).points


def test_edit_motion(example):
    _, out = example("edit_motion")
    first, second = (positions(out / f"{name}_00075.vtu") for name in ("first", "second"))
    moved = np.linalg.norm(second - first, axis=1)
    assert 0.01 < moved[0] < 0.15, "node 0 is led aside"
    np.testing.assert_allclose(positions(out / "second_00000.vtu"), positions(out / "first_00000.vtu"), atol=1e-3)


def test_interpolate_poses(example):
    _, out = example("interpolate_poses")
    rest = positions(out / "flight_00000.vtu")
    for frame, pose in ((20, 30), (45, 60), (80, 30)):
        wanted, found = positions(out / f"flight_{pose:05}.vtu"), positions(out / f"poses_{frame:05}.vtu")
        assert np.abs(found - wanted).max() < 0.2 * np.abs(wanted - rest).max()


def test_recover_material(example):
    printed, out = example("recover_material")
    assert "Hz" in printed and (out / "continued.pc2").stat().st_size > 1e6

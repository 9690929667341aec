"""What the commands and the examples do with structures of beams, over real sockets."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT
from limber.launching import find_binary
from test_beams import cantilever, job_folder

SHARED = ROOT / ".." / "shared"


@pytest.fixture(scope="module")
def cli(limberd):
    return str(find_binary("limber"))


def test_after_a_cancelled_opening_the_side_is_still_the_structures(cli, server):
    """The gridshell is pushed up where it is drawn."""
    run = [cli, "--endpoint", server.connection.endpoint]
    for step in (("open", "gridshell", "--session", "up", "--no-wait"), ("cancel", "up"), ("load", "up", "--node", "3")):
        subprocess.run([*run, *step], check=True, capture_output=True, timeout=60)
    session = server.session("up")
    assert session.wait().status == "CONVERGED"
    heights = session.frames()[-1][:, 2]
    assert heights.max() > 1 and heights.min() > -0.1
    session.close()


def test_commands(cli, server, tmp_path):
    endpoint = server.connection.endpoint

    def run(*arguments, code=0):
        done = subprocess.run([cli, "--endpoint", endpoint, *arguments], capture_output=True, text=True, timeout=60)
        assert done.returncode == code, done.stderr
        return done.stdout + done.stderr

    assert "40 elements, 41 nodes" in run("open", "arch", "--session", "bow")
    assert "revision 1" in run("bring", "bow", "40", "--x", "-0.5")
    assert "revision 2" in run("load", "bow", "--node", "20", "--force", "0", "0", "-5")
    assert "revision 3" in run("gravity", "bow", "0", "0", "0")
    assert "converged" in run("wait", "bow")
    assert "revision 4" in run("hold", "bow", "20")
    assert "revision 5" in run("support", "bow", "0", "--rotations", "xyz")
    assert "revision 6" in run("release", "bow", "20")
    assert "revision 7" in run("bring", "bow", "0", "--rotation-y", "0.1", "--axes", "1", "0", "0", "0", "1", "0")
    assert "revision 8" in run("push", "bow", "20", "--force", "0", "0", "2")
    text = run("wait", "bow")
    assert "utilisation" in text and "energy" in text
    loose = cantilever(6)
    loose["supports"][0].pop("fix_rotation_x")  # unloaded, it turns about itself
    loose["loads"] = []
    (tmp_path / "loose.json").write_text(json.dumps(loose))
    opened = run("open", str(tmp_path / "loose.json"), "--session", "loose", code=1)
    assert "loose: 6 elements, 7 nodes, ready, no solution" in opened
    assert "limber: revision 0 has no solution: " in opened and "no solution" in run("list")
    run("support", "loose", "0")
    run("wait", "loose")
    assert "no solution" not in run("list")
    run("close", "loose")
    assert "41 nodes" in run("list") and "2 supports, 2 motions" in run("show", "bow")
    assert "edits[0].set_beam_load.load.node" in run("load", "bow", "--node", "99", "--force", "1", "0", "0", code=1)
    run("export", "bow", "--format", "vtu", "csv", "--out", str(tmp_path))
    assert (tmp_path / "beams.vtu").is_file() and (tmp_path / "beams_nodes.csv").is_file()
    run("frames", "bow", "--out", str(tmp_path / "f.npy"))
    assert np.load(tmp_path / "f.npy").shape[1:] == (41, 3)
    run("export", "bow", "--format", "scene", "--out", str(tmp_path), "--stem", "edited")
    assert run("validate", str(tmp_path / "edited.json"))
    spoiled = json.loads((tmp_path / "edited.json").read_text())
    spoiled["beams"]["structure"]["supports"] = spoiled["beams"]["structure"]["motions"] = []
    (tmp_path / "spoiled.json").write_text(json.dumps(spoiled))
    assert "beams.structure.supports" in run("validate", str(tmp_path / "spoiled.json"), code=1)
    assert "can be opened" in run("validate", str(job_folder(tmp_path)))
    assert "can be opened" in run("validate", str(tmp_path / "SimulationJob.json"))
    (tmp_path / "SimulationJob.json").write_text(
        (tmp_path / "SimulationJob.json").read_text().replace("[10, [0", "[11, [0"))
    assert "11" in run("validate", str(tmp_path), code=1)
    run("load", "bow", "--node", "20", "--force", "0", "0", "0")
    run("edit-script", "bow", str(script(tmp_path, [{"release_beam_node": {"node": 0}}])), code=1)
    assert "has no solution: Stopped at" in run("wait", "bow", code=1)
    run("undo", "bow")
    run("wait", "bow")
    run("close", "bow")


def script(folder, edits):
    (folder / "edits.jsonl").write_text("".join(json.dumps(edit) + "\n" for edit in edits))
    return folder / "edits.jsonl"


def run_example(name, folder, *arguments):
    done = subprocess.run([sys.executable, str(ROOT / "examples" / name), *map(str, arguments)], cwd=folder,
                          capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_gridshell_example(limberd, tmp_path):
    text = run_example("bend_gridshell.py", tmp_path)
    assert text.count("converged") == 3 and (tmp_path / "out" / "gridshell" / "gridshell.vtu").is_file()
    moved = [float(by) for by in re.findall(r"moved by ([0-9.]+) m", text)]
    assert min(moved) > 0.01, text
    # At 69 % of the rim's way the branch ends. Beyond it Newton's method or, as rounding has it, relaxation comes to a shape.
    rim = next(line for line in text.splitlines() if line.startswith("rim"))
    assert "snaps by" in rim or "by relaxation" in rim, text


def test_the_roof_example(limberd, tmp_path):
    shared = os.environ.get("LIMBER_SHARED", SHARED)
    folder = os.path.join(shared, "data", "beams", "roof")
    if not os.path.isdir(folder):
        pytest.skip(f"no data in {folder}")
    assert run_example("load_roof.py", tmp_path, folder).count("converged") == 3


def test_the_roof_example_says_what_it_takes(tmp_path):
    done = subprocess.run([sys.executable, str(ROOT / "examples" / "load_roof.py")], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and done.stderr.startswith("usage: ") and "FOLDER" in done.stderr

"""The bodies of ../shared (or $LIMBER_SHARED), edited live by the example; skipped where they are absent."""

import edit_shared_bodies
import numpy as np
import pytest
import shared_bodies

needs_bodies = pytest.mark.skipif(not shared_bodies.folder().is_dir(),
                                  reason=f"no {shared_bodies.folder()} (set LIMBER_SHARED)")


@needs_bodies
def test_meaning_of_path_con():
    """The sum of the two rows is a smooth path near the ground, each row alone is not; the second is near rest."""
    folder = shared_bodies.folder() / "dino"
    path = shared_bodies.path_constraints(folder / "path_con.txt")
    lines = (folder / "mesh.abq").read_text().split("*ELEMENT")[0].splitlines()
    nodes = np.array([[float(x) for x in line.split(",")[1:]] for line in lines if line[:1].isdigit()])
    group = path[0]["nodes"]
    assert all(constraint["nodes"] == group for constraint in path) and len(path) == 15
    spread = [np.linalg.norm(nodes[ids] - nodes[ids].mean(axis=0), axis=1).max() for ids in (group, np.array(group) - 1)]
    assert spread[0] < 0.1 < 0.2 < spread[1], "ids count from 0: then the group is a small patch"
    rest = nodes[group].mean(axis=0)
    rows = np.array([[c["displacement"], c["barycentre"]] for c in path])
    assert np.linalg.norm(rows[:, 1] - rest / shared_bodies.PATH_UNIT, axis=1).max() < 0.8

    def roughness(heights):
        return np.abs(np.diff(heights, 2)).mean()

    even = [i for i, c in enumerate(path) if c["frame"] % 25 == 0]
    first, second = rows[even, 0, 1], rows[even, 1, 1]
    assert roughness(first + second) < 0.2 * min(roughness(first), roughness(second))
    ground = nodes[:, 1].min()
    assert all(ground < c["position"][1] < ground + 0.15 for c in path)


@needs_bodies
@pytest.mark.timeout(120)
@pytest.mark.parametrize("name", list(edit_shared_bodies.FRAMES))
def test_bodies_edited_live(server, name):
    session = edit_shared_bodies.edit(server, name)
    result = session.wait()
    assert result.converged and result.status == "CONVERGED", result
    motion = session.frames()
    assert np.isfinite(motion).all()
    rest = session.geometry().rest
    size = (rest.max(axis=0) - rest.min(axis=0)).max()
    assert np.abs(motion - rest).max() > 0.05 * size, "it moves"
    assert np.abs(motion - rest).max() < 3 * size, "and stays together"
    for constraint in session.constraints():
        mean = motion[constraint.frame, list(constraint.nodes)].mean(axis=0)
        wanted = np.array(constraint.target)
        if constraint.kind == "displacement":
            wanted = wanted + rest[list(constraint.nodes)].mean(axis=0)
        assert np.abs(mean - wanted).max() <= result.max_error + 1e-3 * size
    session.close()

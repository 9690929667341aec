"""Materials and groups of mesh files, as users reach them."""

import limber
import meshio
import numpy as np
import pytest
from conftest import bar, small_scene

SOFT, HARD = (1000.0, 0.4, 500.0), (1e7, 0.3, 900.0)


def halves():
    """Nodes and tets of a bar, and the tets of its two halves."""
    nodes, tets = (np.array(part) for part in bar())
    outer = nodes[tets].mean(axis=1)[:, 0] > 1.5
    return nodes, tets, np.flatnonzero(~outer), np.flatnonzero(outer)


def write_inp(path, materials=True):
    nodes, tets, soft, hard = halves()
    lines = ["*NODE"] + [f"{i + 1}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(nodes.tolist())]
    for name, part in (("soft", soft), ("hard", hard)):
        lines.append(f"*ELEMENT, TYPE=C3D4, ELSET={name}")
        lines += [f"{t + 1}, " + ", ".join(str(node + 1) for node in tets[t]) for t in part.tolist()]
    if materials:
        for name, (young, poisson, density) in (("soft", SOFT), ("hard", HARD)):
            lines += [f"*MATERIAL, NAME={name}m", "*DENSITY", f"{density},", "*ELASTIC", f"{young}, {poisson}",
                      f"*SOLID SECTION, ELSET={name}, MATERIAL={name}m"]
    path.write_text("\n".join(lines) + "\n")
    return soft, hard


def materials_of(session):
    """By tet, (E, nu, density)."""
    scene = session.settings()
    found = {}
    for group in scene.material_groups:
        for tet in group.tets:
            found[tet] = (group.material.youngs_modulus, group.material.poissons_ratio, group.material.density)
    return found


def opened(server, mesh, **options):
    return server.open(limber.scene_from_mesh(mesh, frames=20, fixed_nodes=[0, 1, 3], modes=5, **options), progress=False)


def expect_halves(session):
    _, tets, soft, hard = halves()
    found = materials_of(session)
    assert len(found) == len(tets)
    assert {found[t] for t in soft.tolist()} == {SOFT} and {found[t] for t in hard.tolist()} == {HARD}
    session.close()


def test_sections_of_an_abaqus_file_are_taken_and_listed(server, tmp_path):
    soft, _ = write_inp(tmp_path / "a.inp")
    session = opened(server, tmp_path / "a.inp")
    found = materials_of(session)
    # The file's tets come in the order of its sets.
    assert {found[t] for t in range(len(soft))} == {SOFT} and {found[t] for t in range(len(soft), len(found))} == {HARD}
    assert any("of the set 'soft' have the material 'softm'" in issue for issue in session.issues)
    session.close()


def write_msh(path):
    nodes, tets, soft, hard = halves()
    tags = np.ones(len(tets), dtype=int)
    tags[hard] = 2
    mesh = meshio.Mesh(nodes, [("tetra", tets)], cell_data={"gmsh:physical": [tags], "gmsh:geometrical": [tags]},
                       field_data={"soft": np.array([1, 3]), "hard": np.array([2, 3])})
    meshio.write(path, mesh, file_format="gmsh22", binary=False)
    return mesh


def test_physical_groups_are_listed_and_get_materials_by_name(server, tmp_path):
    write_msh(tmp_path / "a.msh")
    session = opened(server, tmp_path / "a.msh")
    assert any("groups of tets without a material: soft (72 tets), hard (72 tets)" in issue for issue in session.issues)
    _, _, soft, hard = halves()
    assert [sorted(group.tets) for group in session.settings().material_groups] == [soft.tolist(), hard.tolist()]
    session.close()
    expect_halves(opened(server, tmp_path / "a.msh", materials={"soft": SOFT, "hard": HARD}))
    with pytest.raises(limber.LimberError) as caught:
        opened(server, tmp_path / "a.msh", materials={"gone": SOFT})
    assert (caught.value.code, caught.value.field) == ("NOT_FOUND", "materials")


def test_meshes_of_meshio_bring_groups_and_cell_data(server, tmp_path):
    mesh = write_msh(tmp_path / "a.msh")
    expect_halves(opened(server, mesh, materials={"soft": SOFT, "hard": HARD}))
    with pytest.warns(limber.MaterialWarning, match="soft .72 tets., hard .72 tets."):
        limber.scene_from_mesh(mesh)
    _, tets, soft, _ = halves()
    rows = np.array([SOFT if t in set(soft.tolist()) else HARD for t in range(len(tets))])
    names = ("youngs_modulus", "poissons_ratio", "density")
    with_data = meshio.Mesh(mesh.points, [("tetra", tets)], cell_data={name: [rows[:, i]] for i, name in enumerate(names)})
    expect_halves(opened(server, with_data))
    for ending in ("vtk", "vtu"):
        meshio.write(tmp_path / f"b.{ending}", with_data)
        expect_halves(opened(server, tmp_path / f"b.{ending}"))


def test_a_scene_that_is_saved_does_not_grow(server, tmp_path):
    write_inp(tmp_path / "a.inp")
    session = opened(server, tmp_path / "a.inp")
    session.export(tmp_path, ["scene"], stem="s")
    again = server.open(limber.load_scene(tmp_path / "s.json"), progress=False)
    assert len(again.settings().material_groups) == 2
    assert materials_of(again) == materials_of(session)
    session.close()
    again.close()


def test_targets_out_of_reach_are_reported(server):
    session = server.open(small_scene(), progress=False)
    far = session.add(frame=30, node=62, displacement=(0, 600, 0), exact=True)
    result = session.wait(until="checked")
    assert f"Constraint {far.id} in frame 30 is out of reach" in result.message
    left = result.out_of_reach[0].distance if result.out_of_reach else 0  # it may be met inside out
    assert left == pytest.approx(result.max_exact_error, rel=0.05, abs=1e-6)
    session.close()

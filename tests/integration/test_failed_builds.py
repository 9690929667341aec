"""Scenes in which nothing is wrong until they are built: what becomes of their sessions."""

import limber
import pytest
from conftest import bar, small_scene


def flat_scene():
    """A bar that is thinner than double precision can factor: only the build finds out."""
    nodes, tets = bar()
    held = [i for i, node in enumerate(nodes) if node[0] == 0]
    return limber.scene_from_arrays(nodes * (1, 1, 1e-8), tets, frames=20, fixed_nodes=held, modes=8, tolerance=0.05)


def open_flat(server, name=""):
    with pytest.raises(limber.LimberError) as caught:
        server.open(flat_scene(), session=name, progress=False)
    assert caught.value.code == "NUMERICAL"
    return caught.value


def names(server):
    return {status.session for status in server.sessions()}


@pytest.mark.parametrize("material", [{"youngs_modulus": e, "density": rho} for e in (1e-30, 1e30) for rho in (1e-30, 1e30)])
def test_what_validation_lets_pass_is_built(server, material):
    """At every corner of the bounds, the same motion: it does not depend on units."""
    energies = []
    for options in ({}, material | {"length_unit_in_metres": 1e-29}, material | {"length_unit_in_metres": 1e29}):
        scene = small_scene(**options)
        assert server.validate(scene) == []
        session = server.open(scene, progress=False)
        session.add(node=62, frame=30, displacement=(0, 0, 0.4))
        energies.append(session.wait().energy)
        session.close()
    assert energies == pytest.approx([energies[0]] * 3, rel=1e-6)


@pytest.mark.parametrize("field, value", [("material.youngs_modulus", 1e308), ("material.youngs_modulus", 1e-300),
                                          ("material.density", 1e300), ("length_unit_in_metres", 1e-100)])
def test_values_beyond_double_are_refused_with_their_field(server, field, value):
    scene = small_scene(**{field.split(".")[-1]: value})
    assert [issue.split(": ")[1] for issue in server.validate(scene)] == [f"scene.{field}"]
    with pytest.raises(limber.LimberError) as caught:
        server.open(scene)
    assert caught.value.field == f"scene.{field}" and "1e-30" in caught.value.message


def test_a_failed_build_takes_no_place(launch):
    server = launch("--max-sessions", "2")
    solved = server.open(small_scene(), session="solved", progress=False)
    for attempt in range(4):
        error = open_flat(server, f"flat-{attempt}")
        assert len(names(server)) == 2, "the newest failure is there to be asked"
        left = server.session(f"flat-{attempt}").status()
        assert error.message in left.message
    second = server.open(small_scene(), session="second", progress=False)
    assert names(server) == {"solved", "second"}
    with pytest.raises(limber.LimberError) as caught:
        server.open(small_scene(), progress=False)
    assert caught.value.code == "LIMIT_EXCEEDED", "those that have a model keep their places"
    assert solved.wait().converged and second.wait().converged


def test_a_failed_build_gives_its_name_back(launch):
    server = launch()
    open_flat(server, "x")
    open_flat(server, "x")
    invalid = small_scene(youngs_modulus=-1)
    with pytest.raises(limber.LimberError):
        server.open(invalid, session="x")
    assert "not positive definite" in server.session("x").status().message, "a refused request changes nothing"
    mended = server.open(small_scene(), session="x", progress=False)
    assert mended.wait().converged and mended.status().message == ""
    with pytest.raises(limber.LimberError) as caught:
        server.open(small_scene(), session="x")
    assert caught.value.code == "ALREADY_EXISTS"


def test_a_failed_build_can_be_tried_again(launch):
    server = launch("--max-sessions", "1")
    open_flat(server, "x")
    with pytest.raises(limber.LimberError) as caught:
        server.wait_job(server.session("x").solve_cold(), progress=False)
    assert caught.value.code == "NUMERICAL"
    server.open(small_scene(), progress=False)
    with pytest.raises(limber.LimberError) as caught:
        server.session("x")
    assert caught.value.code == "NOT_FOUND"
    reasons = [job.error.message for job in server.jobs() if job.session == "x"]
    assert len(reasons) == 2 and all("not positive definite" in reason for reason in reasons), "the jobs still say why"

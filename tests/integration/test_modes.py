"""Scenes that do not name their modes: sessions choose them by the energy of the optimum."""

import threading

import limber
import numpy as np
import pytest
from conftest import bar, tip_of
from limber.messages import service

HARD = 1e6


def unnamed_scene(**options):
    """A bar that keeps the default number of modes until its session knows better."""
    nodes, tets = bar()
    held = [i for i, node in enumerate(nodes) if node[0] == 0]
    settings = {"name": "bar", "fixed_nodes": held, "tolerance": 0.01, "youngs_modulus": 1e5, "period_frames": 25}
    return limber.scene_from_arrays(nodes, tets, frames=60, **(settings | options))


def pulled_apart(session, share=1.0):
    """Two nodes of one cross-section are pulled apart in one frame, hard: that takes more modes than usual."""
    rest = session.geometry().rest
    section = [i for i, node in enumerate(rest) if abs(node[0] - 1.5) < 1e-9]
    low, high = min(section, key=lambda i: rest[i].sum()), max(section, key=lambda i: rest[i].sum())
    return [limber.add(node=low, frame=30, displacement=tuple(share * np.array((0.2, 0.6, -0.5))), weight=HARD),
            limber.add(node=high, frame=30, displacement=tuple(share * np.array((0.2, -0.5, 0.3))), weight=HARD)]


def demand_more(session):
    session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.3), weight=HARD)
    session.edit(pulled_apart(session))


def choice_of(session):
    return session.status().model.mode_choice


@pytest.fixture
def unnamed(server):
    session = server.open(unnamed_scene(), progress=False)
    yield session
    session.close()


def test_an_edit_that_needs_more_modes_while_a_second_client_reads_frames(unnamed):
    unnamed.add(node=tip_of(unnamed), frame=30, displacement=(0, 0, 0.3), weight=HARD)
    unnamed.wait(until="checked")
    before = choice_of(unnamed)
    assert before.state == service.ModeChoice.STATE_SETTLED and 30 <= before.modes <= 45
    reader = limber.connect(unnamed.connection.endpoint).session(unnamed.reference)
    shapes, stop, faults = [], threading.Event(), []

    def read():
        try:
            with reader.stream(timeout=30) as stream:
                for message in stream:
                    assert np.isfinite(message.positions).all()
                    shapes.append((message.result.revision, message.raw.basis_hash))
                    if stop.is_set():
                        return
        except Exception as fault:
            faults.append(fault)

    thread = threading.Thread(target=read)
    thread.start()
    edited = unnamed.edit(pulled_apart(unnamed))
    first = unnamed.wait()
    last = unnamed.wait(until="checked")
    stop.set()
    unnamed.add(node=tip_of(unnamed), frame=20, displacement=(0, 0, 0.1))
    thread.join(timeout=30)
    assert not faults and not thread.is_alive()
    assert last.revision == first.revision == edited.revision
    choice = choice_of(unnamed)
    assert choice.modes > before.modes, choice.reason
    assert last.energy < first.energy * 0.99 and f"in place of {before.modes}" in last.message
    energies = [one.energy for one in choice.energies]
    assert energies == sorted(energies, reverse=True) and [one.modes for one in choice.energies][0] == before.modes
    assert {hash for revision, hash in shapes if revision == last.revision}


def test_frames_of_the_larger_model_meet_the_constraints(unnamed):
    demand_more(unnamed)
    result = unnamed.wait(until="checked")
    assert choice_of(unnamed).modes > 30
    frames, rest = unnamed.frames(), np.asarray(unnamed.geometry().rest)
    worst = max(np.linalg.norm(frames[30, c.nodes[0]] - rest[c.nodes[0]] - (c.displacement.x, c.displacement.y, c.displacement.z))
                for c in unnamed.scene().constraints)
    assert worst == pytest.approx(result.max_error, rel=1e-2, abs=1e-4)


def test_named_modes_stay(server):
    session = server.open(unnamed_scene(modes=30), progress=False)
    demand_more(session)
    session.wait(until="checked")
    choice = choice_of(session)
    assert choice.state == service.ModeChoice.STATE_NAMED and choice.modes == 30
    assert session.scene().model.modes == 30
    session.close()


def test_scenes_of_sessions_do_not_name_what_was_chosen(unnamed):
    demand_more(unnamed)
    unnamed.wait(until="checked")
    assert choice_of(unnamed).modes > 30
    assert not unnamed.scene().model.HasField("modes")


def test_undo_across_a_swap(unnamed):
    unnamed.add(node=tip_of(unnamed), frame=30, displacement=(0, 0, 0.3), weight=HARD)
    before = unnamed.wait(until="checked")
    unnamed.edit(pulled_apart(unnamed))
    unnamed.wait(until="checked")
    assert choice_of(unnamed).modes > 30
    unnamed.undo()
    assert unnamed.wait().energy == pytest.approx(before.energy, rel=0.02)
    unnamed.redo()
    assert unnamed.wait(until="checked").converged


def test_explains_modes_and_first_pictures(unnamed, cli):
    demand_more(unnamed)
    unnamed.wait(until="checked")
    said = unnamed.explain()
    choices = {choice.name: choice for choice in said.choices}
    modes = choices["modes (r)"]
    assert modes.number == choice_of(unnamed).modes and not modes.asked_for and "with 30" in modes.reason and modes.number > 30
    assert choices["first picture"].value == "none"
    errors = {error.quantity: error for error in said.errors}
    energy = errors["energy, against the optimum near by with more modes"]
    assert energy.value == choice_of(unnamed).saving and energy.tolerance == 0.01
    assert "Energies of the optimum" in cli("explain", unnamed.id).stdout


def test_explains_fewer_modes_that_would_do(unnamed):
    # Forces that count by themselves want few modes.
    unnamed.dynamics(discretisation="differences", damping_ratio=0, force_smoothing=0)
    unnamed.add(node=tip_of(unnamed), frame=30, displacement=(0, 0, 0.3))
    unnamed.wait(until="checked")
    fewer = choice_of(unnamed).fewer
    assert 0 < fewer < 30
    assert any(f"model.modes {fewer} in place of 30" in advice.change for advice in unnamed.explain().advice)


def test_explains_why_modes_were_not_compared(unnamed):
    unnamed.wait(until="checked")
    modes = next(choice for choice in unnamed.explain().choices if choice.name == "modes (r)")
    assert "nothing is held" in modes.reason

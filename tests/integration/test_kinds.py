"""What holds for sessions of every kind, over real sockets: bodies, linkages, beams, and the kind of
docs/a-kind-of-your-own.md, which limberd does not know and limberd_springs does."""

from __future__ import annotations

import subprocess
import threading
from dataclasses import dataclass, field
from typing import Any, Callable

import limber
import numpy as np
import pytest
import springs
from conftest import small_scene, tip_of
from limber import beam_edits
from limber.launching import find_binary
from limber.messages import design
from limber.messages import scene as scene_messages
from limber.messages import service
from test_beams import cantilever
from test_failed_builds import flat_scene
from test_restarts import Restartable

SPRINGS = 20


def broken_body():
    scene = small_scene()
    scene.fixed_nodes.append(100_000)
    return scene


def linkage(server=None, youngs_modulus=None):
    """Two rods that cross two others, flat: four joints."""
    lines = [(0, 1), (1, 2), (2, 3), (4, 5), (5, 6), (6, 7), (8, 1), (1, 5), (5, 9), (10, 2), (2, 6), (6, 11)]
    points = [(-1, 0, 0), (0, 0, 0), (1, 0.2, 0), (2, 0.4, 0), (-1, 1, 0), (0, 1, 0), (1, 1.2, 0), (2, 1.4, 0),
              (0, -1, 0), (0, 2, 0), (1, -0.8, 0), (1, 2.2, 0)]
    return limber.linkage_scene(np.array(points, dtype=float), np.array(lines), section={"rectangle": (0.02, 0.005)},
                                youngs_modulus=youngs_modulus)


def broken_linkage():
    scene = linkage()
    scene.linkage.edges_per_segment = 1
    return scene


def unbuilt_linkage():
    """Its energies lose their digits: only the build finds out."""
    scene = linkage(youngs_modulus=1e-305)
    scene.linkage.rest_lengths = scene_messages.REST_LENGTHS_LEAST_STRESS
    return scene


def broken_beams():
    structure = cantilever()
    structure["elements"][3]["finish"] = 99
    return limber.beam_scene(structure)


def chain(stiffness=10.0):
    length = 1.2 * SPRINGS
    return springs.chain_scene([(1.2 * i, 0, 0) for i in range(SPRINGS + 1)], stiffness=stiffness, rest_length=1,
                               pins={0: (0, 0, 0), SPRINGS: (length, 0, 0)}, name="chain")


def joint_load(joint, z):
    return {"set_joint_load": {"load": {"joint": joint, "force": {"z": z}}}}


@dataclass(frozen=True)
class Kind:
    """How sessions of a kind are opened and edited here."""

    name: str
    session_class: type
    scene: Callable[[], Any]
    broken: Callable[[], Any]                    # is refused
    small: "Callable[[limber.OpenSession, int], list]"  # another number: another answer
    slow: "Callable[[limber.OpenSession], list]"
    refused: Any                                 # an edit
    refused_field: str                           # behind "edits[i]."
    setup: "Callable[[limber.OpenSession], list]" = field(default=lambda session: [])
    unbuilt: "Callable[[], Any] | None" = None   # is found to be wrong only when it is built

    def open(self, server, **options):
        opened = server.open(self.scene(), progress=False, **options)
        edits = self.setup(opened)
        if edits:
            opened.edit(edits)
        opened.wait()
        return opened


KINDS = [
    Kind("bodies", limber.Session, small_scene, broken_body,
         setup=lambda s: [limber.add(node=tip_of(s), frame=30, displacement=(0, 0, 0.1))],
         small=lambda s, i: [limber.move(1, (0, 0, 0.1 + 0.02 * i))],
         slow=lambda s: [limber.move(1, (-1.5, 1.5, 1.0))],
         refused=limber.remove(99), refused_field="remove.id", unbuilt=flat_scene),
    Kind("linkages", limber.LinkageSession, linkage, broken_linkage,
         setup=lambda s: [{"pin_joint": {"pin": {"joint": 0, "held": "HELD_MOTION"}}}],
         small=lambda s, i: [joint_load(3, 0.01 * i)],
         slow=lambda s: [{"set_mean_angle": {"angle_degrees": 40}}, joint_load(3, 0.5)],
         refused=joint_load(99, 1), refused_field="set_joint_load.load.joint", unbuilt=unbuilt_linkage),
    Kind("beams", limber.BeamSession, lambda: limber.beam_scene(cantilever()), broken_beams,
         small=lambda s, i: [beam_edits.load(20, (0, 0, -1 - 0.1 * i))],
         slow=lambda s: [beam_edits.load(20, (0, 0, -300)), beam_edits.load(10, (0, 40, 0))],
         refused=beam_edits.load(99, (0, 0, 1)), refused_field="set_beam_load.load.node"),
    Kind("springs", springs.ChainSession, chain, lambda: chain(stiffness=-1),
         small=lambda s, i: [springs.set_load(10, (0, 0, -0.01 * i))],
         slow=lambda s: [springs.move_pin(SPRINGS, (0, 5000, 0))],
         refused=springs.release_pin(99), refused_field="extension.release_pin.node"),
]


@pytest.fixture(params=KINDS, ids=lambda kind: kind.name)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def server(limberd, cache_dir):
    """limberd with all four kinds."""
    with limber.launch(springs.binary(), cache_dir=cache_dir) as running:
        yield running
        assert running.process.poll() is None, "limberd died: " + running.log


@pytest.fixture
def opened(server, kind):
    session = kind.open(server)
    yield session
    try:
        session.close()
    except limber.LimberError as error:
        assert error.code == "NOT_FOUND"


def answer(session):
    """The newest shape or motion, to the last bit."""
    data = session.raw_frames(final=True).data
    frames = np.frombuffer(data.data, np.float32).reshape(data.shape)
    return (frames if isinstance(session, limber.Session) else frames[-1]).tobytes()


def refusal(call):
    with pytest.raises(limber.LimberError) as caught:
        call()
    return caught.value.code, caught.value.field


def test_opened_sessions_say_what_they_are_of(server, kind, opened):
    assert isinstance(opened, kind.session_class)
    assert server.validate(kind.scene()) == []
    status = opened.status()
    assert (status.kind, status.state) == (kind.name, service.SESSION_STATE_READY)
    assert status.result.converged and not status.result.solve_failed, status.result.message
    listed = {status.session: status.kind for status in server.sessions()}
    assert listed[opened.id] == kind.name
    positions = opened.frames()
    assert positions.shape[2] == 3 and np.isfinite(positions).all()
    quantised = opened.frames(encoding="quantised")
    extent = np.ptp(positions, axis=(0, 1)).max()
    assert np.abs(opened.frames(encoding="positions") - positions).max() <= 1e-6 * extent
    assert np.abs(quantised - positions).max() <= extent / 60_000


def test_what_is_wrong_is_named_and_leaves_nothing(server, kind):
    issues = server.validate(kind.broken())
    assert issues and issues[0].startswith("error: scene.")
    before = {status.session for status in server.sessions()}
    code, named = refusal(lambda: server.open(kind.broken(), session=f"broken-{kind.name}", progress=False))
    assert issues[0].split(": ")[1] == named and code in ("INVALID_ARGUMENT", "OUT_OF_RANGE")
    assert {status.session for status in server.sessions()} == before
    kind.open(server, session=f"broken-{kind.name}").close()


# What the validation of the others lets pass can always be built.
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind.unbuilt], indirect=True, ids=lambda kind: kind.name)
def test_a_build_that_fails_says_why_and_gives_its_name_back(server, kind):
    name = f"unbuilt-{kind.name}"
    code, _ = refusal(lambda: server.open(kind.unbuilt(), session=name, progress=False))
    assert code == "NUMERICAL"
    failed = server.session(name)
    assert failed.status().state == service.SESSION_STATE_FAILED and failed.status().message
    assert refusal(failed.wait)[0] == "FAILED_PRECONDITION"
    kind.open(server, session=name).close()


def test_edits_are_numbered_and_answered(kind, opened):
    first = opened.revision
    answers = {answer(opened)}
    for i in (1, 2):
        receipt = opened.edit(kind.small(opened, i))
        assert receipt.revision == first + i
        result = opened.wait()
        assert result.revision == first + i and result.final and not result.solve_failed, result.message
        answers.add(answer(opened))
    assert len(answers) == 3


def test_refused_edits_change_nothing(kind, opened):
    before, revision = answer(opened), opened.status().revision
    edits = [*kind.small(opened, 1), kind.refused]
    assert refusal(lambda: opened.edit(edits))[1] == f"edits[{len(edits) - 1}].{kind.refused_field}"
    assert refusal(lambda: opened.edit([])) == ("INVALID_ARGUMENT", "edits")
    assert refusal(lambda: opened.edit(kind.small(opened, 1), expected_revision=revision + 7)) == \
        ("FAILED_PRECONDITION", "expected_revision")
    assert opened.status().revision == revision and answer(opened) == before


def test_edits_of_other_kinds_are_refused(kind, opened):
    for other in KINDS:
        if other.name != kind.name:
            code, named = refusal(lambda: opened._send([limber.edits.to_message(other.refused)], None))
            assert code == "INVALID_ARGUMENT"
            assert named == "edits[0]." + other.refused_field.split(".")[0]


def test_undo_and_redo_give_back_the_very_answers(kind, opened):
    before = answer(opened)
    opened.edit(kind.small(opened, 3))
    opened.wait()
    after = answer(opened)
    assert after != before
    for _ in range(2):
        opened.undo()
        opened.wait()
        assert answer(opened) == before
        opened.redo()
        opened.wait()
        assert answer(opened) == after


def test_streams_bring_every_final_result_in_order(kind, opened):
    with opened.stream() as stream:
        sequences = [stream.next(30).result.sequence]
        for i in (1, 2, 3):
            revision = opened.edit(kind.small(opened, i)).revision
            while True:
                streamed = stream.next(30)
                sequences.append(streamed.result.sequence)
                assert np.isfinite(streamed.positions).all()
                if streamed.result.final and streamed.result.revision == revision:
                    break
        assert sequences == sorted(set(sequences))
        opened.close()
        with pytest.raises(StopIteration):
            while True:
                stream.next(30)


def test_exported_scenes_open_as_they_were(server, kind, opened, tmp_path):
    opened.edit(kind.small(opened, 2))
    opened.wait()
    written = opened.export(tmp_path, formats=("scene",), stem="again").files
    again = server.open(next(path for path in written if path.suffix == ".json"), progress=False)
    assert isinstance(again, kind.session_class)
    again.wait()
    shape, same = opened.frames()[-1], again.frames()[-1]
    assert np.abs(shape - same).max() < 1e-3 * np.ptp(shape, axis=0).max()
    assert again.export(tmp_path / "twice", stem="x").files
    assert refusal(lambda: again.connection.call("export", service.ExportRequest(
        session=again.reference, format=service.EXPORT_FORMAT_UNSPECIFIED)))[1] == "format"
    again.close()


def test_a_cancelled_solve_ends_and_the_session_continues(kind, opened):
    opened.edit(kind.slow(opened))
    opened.cancel()
    result = opened.wait()
    assert result.final and result.revision == opened.revision
    if kind.name == "springs":
        assert result.status == "CANCELLED"
    opened.undo()
    opened.edit(kind.small(opened, 4))
    result = opened.wait()
    assert result.revision == opened.revision and result.status == "CONVERGED", result.message


def test_newer_edits_interrupt_older_ones(kind, opened):
    opened.edit(kind.slow(opened))
    opened.undo()
    revision = opened.edit(kind.small(opened, 5)).revision
    result = opened.wait()
    assert result.revision == revision and result.status == "CONVERGED", result.message


def test_two_clients_edit_one_session(server, kind, opened):
    revisions, faults = [], []

    def edit(offset):
        try:
            with limber.connect(server.connection.endpoint) as own:
                session = own.session(opened.reference)
                assert isinstance(session, kind.session_class)
                for i in range(8):
                    revisions.append(session.edit(kind.small(session, offset + i)).revision)
                session.wait()
        except Exception as fault:  # shown by the test, not lost with the thread
            faults.append(fault)

    before = opened.status().revision
    clients = [threading.Thread(target=edit, args=(offset,)) for offset in (1, 11)]
    for client in clients:
        client.start()
    for client in clients:
        client.join(60)
    assert not faults
    assert sorted(revisions) == list(range(before + 1, before + 17))
    assert opened.wait(revision=before + 16).revision == before + 16


def test_closed_sessions_are_gone_for_everybody(server, kind):
    name = f"closed-{kind.name}"
    session = kind.open(server, session=name)
    other = server.session(name)
    session.close()
    for call in (session.status, other.frames, other.undo, other.wait, other.cancel, session.close):
        assert refusal(call)[0] == "NOT_FOUND"
    again = kind.open(server, session=name)
    assert refusal(session.status)[0] == "NOT_FOUND", "the old handle does not reach the new session"
    again.close()


def test_requests_of_other_kinds_are_refused_by_name(kind, opened):
    connection = opened.connection
    for verb, request, of in (("get_material", service.GetMaterialRequest, "bodies"),
                              ("solve_cold", service.SolveColdRequest, "bodies"),
                              ("stop_design", design.StopDesignRequest, "linkages"),
                              ("get_beam_solution", service.GetBeamSolutionRequest, "beams")):
        if of != kind.name:
            with pytest.raises(limber.LimberError) as caught:
                connection.call(verb, request(session=opened.reference))
            assert (caught.value.code, caught.value.field) == ("FAILED_PRECONDITION", "session")
            assert f"session '{opened.id}' is of " in caught.value.message


@pytest.fixture(scope="module")
def restartable(limberd, cache_dir, tmp_path_factory):
    server = Restartable(springs.binary(), tmp_path_factory.mktemp("restarts"), cache_dir)
    yield server
    server.close()


def test_a_handle_of_another_run_reaches_nothing(restartable, kind):
    with limber.connect(restartable.endpoint) as server:
        session = kind.open(server, session="held")
        restartable.restart()
        with limber.connect(restartable.endpoint) as fresh:
            stranger = kind.open(fresh, session="held")
            before = stranger.status().revision
            with pytest.raises(limber.ServerRestarted):
                session.edit(kind.small(session, 1))
            assert stranger.status().revision == before
            stranger.close()


def test_limberd_refuses_a_kind_that_it_has_not(launch):
    server = launch()
    code, named = refusal(lambda: server.open(chain(), progress=False))
    assert (code, named) == ("UNSUPPORTED", "scene")
    assert refusal(lambda: server.validate(chain()))[0] == "UNSUPPORTED"


def test_a_client_without_the_module_still_waits_and_closes(server, monkeypatch):
    monkeypatch.delitem(limber.kind._KINDS, "springs")
    session = server.open(chain(), progress=False)
    assert type(session) is limber.OpenSession
    assert session.wait().status == "CONVERGED"
    assert session.frames(encoding="positions").shape == (1, SPRINGS + 1, 3)
    assert refusal(session.frames) == ("UNSUPPORTED", "encoding")
    assert refusal(session.undo) == ("FAILED_PRECONDITION", "edits[0].undo")
    session.close()


def test_extensions_are_checked_like_requests(server):
    scene = chain()
    scene.extension.value += b"\xf8\x07\x01"  # field 127 of no message here
    code, named = refusal(lambda: server.open(scene, progress=False))
    assert (code, named) == ("INVALID_ARGUMENT", "scene.extension")
    other = small_scene()
    other.extension.CopyFrom(chain().extension)
    assert refusal(lambda: server.open(other, progress=False))[1].startswith("scene.")


def test_the_command_line_says_of_any_kind_what_all_have(server, kind, tmp_path):
    def run(*arguments):
        done = subprocess.run([str(find_binary("limber")), "--endpoint", server.connection.endpoint, *map(str, arguments)],
                              capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        return done.stdout

    session = kind.open(server, session="any")
    try:
        session.wait()
        is_foreign = kind.name not in ("bodies", "linkages", "beams")
        shown, listed = run("show", "any"), run("list")
        watched = run("watch", "any", "--count", 1).splitlines()
        assert ("of the kind " + kind.name in shown) == is_foreign == ("of the kind " + kind.name in listed)
        assert "session any" in shown and "revision" in shown and "since the edit" in run("wait", "any")
        has_unit = kind.name in ("linkages", "beams")
        assert ("energy [J]" in watched[0]) == has_unit == (" J" in listed)
        assert watched[0].split()[-2:] == {"bodies": ["error", "ms"], "linkages": ["[deg]", "ms"],
                                           "beams": ["[J]", "ms"]}.get(kind.name, ["energy", "ms"])
        run("frames", "any", "--out", tmp_path / "f.npy")
        assert np.load(tmp_path / "f.npy").shape == session.frames().shape
    finally:
        session.close()

"""Recorded traffic of this version and of earlier ones, sent again to the limberd that was built."""

import subprocess
import sys
from pathlib import Path

import limber
import pytest
from conftest import small_scene, tip_of
from limber import reply_parts
from limber.errors import LimberError
from limber.recorder import Recorder
from limber.recording import REPLY, REQUEST, Reader, Writer
from limber.replaying import replay
from limber.v1 import scene_pb2
from limber.v1 import service_pb2 as service

RECORDINGS = Path(__file__).resolve().parents[1] / "recordings"
FILES = sorted(RECORDINGS.glob("*/*.limberrec"))


def test_there_are_recordings_of_every_kind():
    assert {path.stem for path in FILES} >= {"bodies", "linkages", "beams"}


def with_published_dynamics(source, target):
    """Bodies were recorded when the published differences were what a scene without a discretisation has."""
    with Writer(target) as writer:
        for message in Reader(source):
            data = message.data
            if message.direction == REQUEST:
                request = service.Request.FromString(data)
                if request.HasField("open_session") and request.open_session.scene.HasField("mesh"):
                    request.open_session.scene.dynamics.discretisation = scene_pb2.TIME_DISCRETISATION_DIFFERENCES
                    data = request.SerializeToString()
            writer.add(message.direction, message.connection, data)
    return target


@pytest.mark.timeout(120)
@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_replies_are_what_they_were(launch, tmp_path, path):
    outcome = replay(with_published_dynamics(path, tmp_path / path.name), launch().connection.endpoint)
    assert outcome.differences == []
    assert outcome.replies == outcome.requests > 10
    assert outcome.kinds["error"] >= 1 and outcome.kinds["edit"] >= 3 and outcome.kinds["wait"] >= 3


def changed(source, target, change):
    """A copy of a recording whose replies `change` was applied to."""
    with Writer(target) as writer:
        for message in Reader(source):
            data = message.data
            if message.direction == REPLY:
                reply = service.Reply.FromString(data)
                change(reply)
                data = reply.SerializeToString()
            writer.add(message.direction, message.connection, data)


def raise_energy(reply):
    if reply.HasField("wait"):
        reply.wait.result.total_energy *= 1.01


def skip_a_revision(reply):
    if reply.HasField("edit"):
        reply.edit.revision += 1


def name_another_field(reply):
    if reply.HasField("error"):
        reply.error.field = "edits[1]"


def refuse_the_opening(reply):
    if reply.HasField("open_session"):
        reply.error.message = "no"


@pytest.mark.parametrize("change, words", [(raise_energy, "total_energy"), (skip_a_revision, "revision"),
                                           (name_another_field, "field"), (refuse_the_opening, "now open_session")])
def test_differences_are_told(launch, tmp_path, change, words):
    changed(RECORDINGS / "0.1.0" / "beams.limberrec", tmp_path / "changed.limberrec", change)
    outcome = replay(tmp_path / "changed.limberrec", launch().connection.endpoint)
    assert outcome.differences and words in outcome.differences[0]


def test_a_replay_leaves_sessions_of_others_alone(server, tmp_path):
    path = tmp_path / "a.limberrec"
    with Recorder(server.connection.endpoint, path) as recorder, limber.connect(recorder.endpoint) as client:
        session = client.open(small_scene(), session="a", progress=False)
        session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
        session.wait()
        session.close()
    with pytest.raises(LimberError, match="exists"):
        Recorder(server.connection.endpoint, path)
    server.open(small_scene(), session="a", progress=False)
    outcome = replay(path, server.connection.endpoint)
    assert outcome.differences == [] and outcome.replies > 3
    assert [(one.session, one.revision) for one in server.sessions()] == [("a", 0)]


def test_long_replies_are_recorded_whole(server, tmp_path):
    path = tmp_path / "a.limberrec"
    with Recorder(server.connection.endpoint, path) as recorder, limber.connect(recorder.endpoint) as client:
        session = client.open(small_scene(frames=3000), session="long", progress=False)
        session.wait()
        assert len(session.raw_frames(encoding="quantised").data.data) > 4 * reply_parts.PartSize.LEAST
    requests = [service.Request.FromString(message.data) for message in Reader(path) if message.direction == REQUEST]
    kinds = [request.WhichOneof("body") for request in requests]
    assert "get_frames" in kinds and "get_reply_part" not in kinds
    assert not any(request.most_reply_bytes for request in requests)


def test_what_is_recorded_is_what_was_said(server, tmp_path):
    path = tmp_path / "a.limberrec"
    with Recorder(server.connection.endpoint, path, note="a test") as recorder:
        for name in ("first", "second"):
            with limber.connect(recorder.endpoint) as client:
                session = client.open(small_scene(), session=name, progress=False)
                with session.stream() as stream:  # passed on, and not recorded
                    assert stream.next(30).result.revision == 0
                    session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
                    assert session.wait().revision == 1
                    while stream.next(30).result.revision < 1:
                        pass
                session.close()
    reader = Reader(path)
    messages = list(reader)
    assert reader.header["note"] == "a test" and not reader.is_cut
    assert len(messages) == recorder.messages
    assert {message.connection for message in messages} == {0, 1}
    asked, answered = ([service.Request.FromString(m.data).id if way == REQUEST else service.Reply.FromString(m.data).id
                        for m in messages if m.direction == way and m.connection == 0] for way in (REQUEST, REPLY))
    assert sorted(asked) == sorted(answered)
    assert [m.seconds for m in messages] == sorted(m.seconds for m in messages)


def test_a_recording_without_its_end_is_read_up_to_there(tmp_path):
    whole = (RECORDINGS / "0.1.0" / "bodies.limberrec").read_bytes()
    path = tmp_path / "cut.limberrec"
    path.write_bytes(whole[:len(whole) // 2])
    reader = Reader(path)
    assert 0 < len(list(reader)) < len(list(Reader(RECORDINGS / "0.1.0" / "bodies.limberrec")))
    assert reader.is_cut


@pytest.mark.parametrize("data, words", [(b"", "no recording"), (b"limbrec\0\2\0\0\0", "form 2"), (b"limbrec\0\1\0\0\0", "header"),
                                         (b"limbrec\0\1\0\0\0" + b"x" * 50, "damaged")])
def test_what_is_no_recording_is_refused(tmp_path, data, words):
    path = tmp_path / "bad.limberrec"
    path.write_bytes(data)
    with pytest.raises(limber.LimberError, match=words):
        list(Reader(path))


def test_damaged_bytes_are_an_error_or_other_messages(tmp_path):
    whole = bytearray((RECORDINGS / "0.1.0" / "linkages.limberrec").read_bytes())
    path = tmp_path / "bad.limberrec"
    for place in range(12, len(whole), 97):
        spoilt = bytearray(whole)
        spoilt[place] ^= 0x55
        path.write_bytes(spoilt)
        try:
            list(Reader(path))
        except limber.LimberError as error:
            assert str(path) in str(error)


def test_the_command_line_records_and_replays(launch, cli, tmp_path, monkeypatch):
    monkeypatch.setenv("LIMBER_PYTHON", sys.executable)
    path = tmp_path / "line.limberrec"
    server = launch()
    recording = subprocess.Popen([sys.executable, "-m", "limber", "--endpoint", server.connection.endpoint, "record", str(path)],
                                 stdout=subprocess.PIPE, text=True)
    with limber.connect(recording.stdout.readline().strip()) as client:
        session = client.open(sample="arch", session="arch", progress=False)
        session.gravity((0, 0, -1.0))
        session.wait()
        session.close()
    recording.terminate()
    assert recording.wait(20) == 0
    again = launch()
    ran = cli("--endpoint", again.connection.endpoint, "replay", path)
    assert ran.returncode == 0 and ran.stdout == "" and " 0 differences" in ran.stderr, ran.stderr
    changed(path, tmp_path / "other.limberrec", skip_a_revision)
    ran = cli("--endpoint", again.connection.endpoint, "replay", tmp_path / "other.limberrec")
    assert ran.returncode == 1 and "revision" in ran.stdout
    assert cli("--endpoint", again.connection.endpoint, "replay", tmp_path / "none").returncode == 1

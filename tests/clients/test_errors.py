"""Errors of the client as errors of Python."""

import copy
import pickle

import limber
import pytest
from limber import errors
from limber.v1 import common_pb2 as common

OF_CODES = {"TIMEOUT": TimeoutError, "INVALID_ARGUMENT": ValueError, "OUT_OF_RANGE": ValueError, "IO": OSError}


def received(code, field=""):
    return errors.from_message(common.Error(code=common.ErrorCode.Value(f"ERROR_CODE_{code}"), message="why", field=field,
                                            details={"limit": "7"}))


@pytest.mark.parametrize("code", [name.removeprefix("ERROR_CODE_") for name in common.ErrorCode.keys()])
def test_an_error_is_what_its_code_says(code):
    error = received(code, "scene.frames")
    assert isinstance(error, limber.LimberError) and error.code == code
    for kind in set(OF_CODES.values()) - {OSError}:
        assert isinstance(error, kind) == (OF_CODES.get(code) is kind), kind
    assert isinstance(error, OSError) == (code in ("IO", "TIMEOUT"))  # a TimeoutError is one, too
    assert not isinstance(error, FileNotFoundError)


def test_a_file_that_is_not_there_is_a_file_not_found_error(tmp_path):
    for call in (lambda: limber.load_scene(tmp_path / "none.json"), lambda: limber.mesh_file(tmp_path / "none.msh"),
                 lambda: limber.connect("tcp://127.0.0.1:1", server_key=tmp_path / "none.pub", key=tmp_path / "none")):
        with pytest.raises(FileNotFoundError) as caught:
            call()
        assert isinstance(caught.value, limber.LimberError) and caught.value.code == "IO" and caught.value.errno == 2
    assert isinstance(received("NOT_FOUND", "open_session.scene.mesh.path"), FileNotFoundError)
    assert not isinstance(received("NOT_FOUND", "session"), OSError)
    with pytest.raises(OSError) as caught:
        limber.mesh_file(tmp_path)
    assert not isinstance(caught.value, FileNotFoundError) and "s a directory" in str(caught.value)


def test_what_is_refused_before_it_is_sent_is_a_value_error(tmp_path):
    for call in (lambda: limber.move(1, (0, 0)), lambda: limber.beam_scene({"nodes": 3}), lambda: limber.force(1, "x")):
        with pytest.raises(ValueError):
            call()
    (tmp_path / "bad.json").write_text('{"frames": 3, "frames": 4}')
    with pytest.raises(limber.LimberError, match="frames is given twice") as caught:  # not "is not JSON"
        limber.load_scene(tmp_path / "bad.json")
    assert caught.value.field == "scene.frames"


def test_a_server_that_was_stopped_is_no_timeout():
    assert isinstance(limber.ServerUnreachable("nobody"), TimeoutError)
    assert not isinstance(limber.ServerStopped("stopped"), TimeoutError)
    assert isinstance(limber.ServerStopped("stopped"), limber.ServerUnreachable)
    assert not isinstance(limber.ServerRestarted("again"), OSError)


@pytest.mark.parametrize("error", [
    received("TIMEOUT", "timeout_s"), received("INVALID_ARGUMENT", "x"), received("NOT_FOUND", "session"), received("IO"),
    received("NOT_FOUND", "scene.mesh.path"), received("RESTARTED", "job"), received("SHUTTING_DOWN"),
    limber.ServerUnreachable("nobody"), errors.of_file(PermissionError(13, "no"), "cannot read a", "path")],
    ids=lambda error: f"{type(error).__name__}_{error.code}")
def test_errors_are_pickled_and_copied(error):
    for made in (pickle.loads(pickle.dumps(error)), copy.copy(error), copy.deepcopy(error)):
        assert type(made) is type(error) and str(made) == str(error) and made.args == error.args
        assert (made.code, made.message, made.field, made.details) == (error.code, error.message, error.field, error.details)
        assert getattr(made, "errno", None) == getattr(error, "errno", None)

"""What `limber wait` shows of a build, against a fake limberd that is as slow as it says."""

import os
import pty
import subprocess

import pytest
from limber.launching import find_binary
from limber.v1 import common_pb2 as common
from limber.v1 import service_pb2 as service

pytestmark = pytest.mark.timeout(30)


@pytest.fixture
def building(fake):
    """The model is half built at the first look, nearly at the second; then there is a result."""
    waits = []

    def wait(request):
        waits.append(request.wait)
        if len(waits) <= 2:
            return service.Reply(version=1, id=request.id, error=common.Error(
                code=common.ERROR_CODE_TIMEOUT, message="no such result within 0.4 s", field="timeout_s"))
        return service.WaitResponse(result=service.ResultInfo(revision=0, converged=True))

    def status(request):
        return service.GetSessionResponse(status=service.SessionStatus(
            session="a", state=service.SESSION_STATE_BUILDING,
            progress=service.Progress(stage="cubature", fraction=0.52 if len(waits) < 2 else 0.91)))

    fake.handlers |= {"wait": wait, "get_session": status}
    return fake


def command(fake, *more):
    return [str(find_binary("limber")), "--endpoint", fake.requests, "wait", "a", "--revision", "0", *more]


def test_a_bar_on_a_terminal(building):
    main, follower = pty.openpty()
    process = subprocess.Popen(command(building), stderr=follower, stdout=subprocess.DEVNULL)
    os.close(follower)
    seen = b""
    while True:
        try:
            data = os.read(main, 4096)
        except OSError:
            break
        if not data:
            break
        seen += data
    os.close(main)
    assert process.wait(10) == 0
    assert b"\rcubature" in seen and b"###" in seen and b" 52 %" in seen and b" 91 %" in seen


def test_lines_elsewhere(building):
    done = subprocess.run(command(building), capture_output=True, text=True, timeout=20)
    assert done.returncode == 0 and "final" in done.stdout
    assert done.stderr.splitlines() == ["cubature: 50 %", "cubature: 90 %"]


def test_the_whole_time_counts_not_the_stretches(building):
    building.handlers["wait"] = lambda request: service.Reply(version=1, id=request.id, error=common.Error(
        code=common.ERROR_CODE_TIMEOUT, message="no such result within 0.1 s", field="timeout_s"))
    late = subprocess.run(command(building, "--wait", "0.2"), capture_output=True, text=True, timeout=20)
    assert late.returncode == 4 and "no such result within 0.2 s" in late.stderr


def test_an_iterate_is_shown_as_of_its_sessions_kind(building):
    """Of a kind that limber.v1 does not know, only final results need bring something of their own."""
    building.handlers |= {
        "get_session": lambda request: service.GetSessionResponse(status=service.SessionStatus(
            session="a", kind="springs", state=service.SESSION_STATE_READY)),
        "wait": lambda request: service.WaitResponse(result=service.ResultInfo(revision=0))}
    done = subprocess.run(command(building, "--until", "first"), capture_output=True, text=True, timeout=20)
    assert done.returncode == 0, done.stderr
    assert [line.split("  ")[0] for line in done.stdout.splitlines()] == ["revision", "status", "energy", "since the edit"]

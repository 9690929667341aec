"""limber status: one picture of the server."""

import json
import os
import re
import resource
import subprocess

import limber
import pytest
from conftest import small_scene, tip_of
from limber.launching import find_binary


@pytest.fixture
def status(limberd):
    def run(server, *arguments, endpoint=None):
        endpoint = endpoint or server.connection.endpoint
        return subprocess.run([str(find_binary("limber")), "status", *map(str, arguments)], capture_output=True, text=True,
                              timeout=60, env={**os.environ, "LIMBER_ENDPOINT": endpoint})
    return run


def test_it_tells_of_an_idle_server(launch, status):
    process = status(launch(), "--measure", 0)
    assert process.returncode == 0, process.stderr
    assert re.match(r"limberd \S+ at \S+, ready, up ", process.stdout)
    assert "sessions   none" in process.stdout and "store      none" in process.stdout
    assert "FAULT" not in process.stdout and "slowest" not in process.stdout


def test_it_tells_of_sessions_rates_and_the_slowest(launch, status, tmp_path):
    server = launch("--data", str(tmp_path / "data"), "--web", "127.0.0.1:0")
    session = server.open(small_scene(), session="flower", progress=False)
    for step in range(3):
        session.add(node=tip_of(session), frame=20, displacement=(0, 0.01 * step, 0))
    session.wait()
    process = status(server, "--measure", 0.1)
    assert process.returncode == 0, process.stderr
    row, = re.findall(r"^flower .*$", process.stdout, re.MULTILINE)
    name, kind, state, people, memory, unit, edits = row.split()[:7]
    assert (name, kind, state, people, edits) == ("flower", "bodies", "ready", "1", "3")
    assert float(memory) > 0 and unit in ("kB", "MB")
    for words in ("edits      0.0/s now", "acks       half within", "slowest    session flower:", "dropped    0 requests, 0 replies",
                  "store      1 session (0 parked)", "process "):
        assert words in process.stdout, process.stdout
    assert server.info().web_token not in process.stdout


def test_json_has_everything_and_rates(launch, status):
    server = launch("--web", "127.0.0.1:0")
    session = server.open(small_scene(), session="s", progress=False)
    session.add(node=tip_of(session), frame=20, displacement=(0, 0.01, 0))
    process = status(server, "--json", "--measure", 0.1)
    told = json.loads(process.stdout)
    assert process.returncode == 0 and process.stdout.count("\n") == 1
    assert told["rates"]["edits"]["since_start_per_s"] > 0 and told["rates"]["edits"]["now_per_s"] == 0
    assert told["status"]["phase"] == "PHASE_READY" and told["status"]["sessions"][0]["session"] == "s"
    assert not told.get("web_token")


def test_a_fault_is_told_and_ends_with_1(launch, status, tmp_path):
    server = launch("--data", str(tmp_path / "data"))
    session = server.open(small_scene(), session="s", progress=False)
    size = server.info().store.bytes
    resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
    with pytest.raises(limber.LimberError):
        for _ in range(500):
            session.add(node=tip_of(session), frame=20, displacement=(0, 0.1, 0))
    process = status(server, "--measure", 0)
    assert process.returncode == 1
    assert "NOT READY  nothing can be stored now" in process.stdout and "FAULT      nothing can be stored" in process.stdout
    resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def test_without_a_server_it_says_so(status):
    process = status(None, endpoint="tcp://127.0.0.1:1")
    assert process.returncode == 3 and "127.0.0.1:1" in process.stderr

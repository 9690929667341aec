"""Streams that nobody reads while their server ends: libzmq once aborted the whole process of such a client."""

import os
import subprocess
import sys
import time

import pytest

UNREAD = """
import os, signal, sys, time
import limber
from conftest import small_scene, tip_of
with limber.connect(sys.argv[1]) as server:
    session = server.open(small_scene(), progress=False)
    held = session.add(node=tip_of(session), frame=30, displacement=(0, 0.1, 0))
    stream = session.stream(encoding="positions")
    for step in range(40):
        held.move((0, 0.1 + 0.01 * step, 0))
        session.wait()
    time.sleep(1)  # the last frames are in transit
    os.kill(int(sys.argv[2]), signal.SIGKILL)
    time.sleep(4)  # the socket notices, and connects anew
    read = []
    try:
        while True:
            read.append(stream.next(30))
    except limber.ServerUnreachable:
        print(len(read), read[-1].result.revision == session.revision, stream.missed > 0)
"""


@pytest.mark.parametrize("transport", ["ipc", "tcp"])
def test_the_end_of_the_server_is_an_exception(launch, transport):
    server = launch(transport=transport)
    start = time.monotonic()
    path = os.pathsep.join([os.path.dirname(__file__), *sys.path])
    ran = subprocess.run([sys.executable, "-c", UNREAD, server.connection.endpoint, str(server.process.pid)],
                         env=dict(os.environ, PYTHONPATH=path), capture_output=True, text=True, timeout=50)
    assert (ran.returncode, ran.stdout.split()) == (0, ["8", "True", "True"]), ran.stderr
    assert time.monotonic() - start < 30

"""Servers of limber.launch() end with the process that launched them, however it ends."""

import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import limber
import pytest

LAUNCHED = """
import os, sys, threading, time
import limber
server = limber.launch(sys.argv[1])
print(server.process.pid, server.folder, flush=True)
time.sleep(60)
"""


def is_there(pid):
    """Whether a process runs; of one that ended and that nobody waited for, the command line is empty."""
    try:
        return bool(pathlib.Path(f"/proc/{pid}/cmdline").read_bytes())
    except OSError:
        return False


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_launched_server_ends_when_its_launcher_dies(limberd, number):
    launcher = subprocess.Popen([sys.executable, "-c", LAUNCHED, str(limberd)], stdout=subprocess.PIPE, text=True)
    try:
        pid, folder = launcher.stdout.readline().split()
        assert is_there(pid)
        launcher.send_signal(number)
        launcher.wait(5)
        deadline = time.monotonic() + 4
        while (is_there(pid) or os.path.exists(folder)) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not is_there(pid) and not os.path.exists(folder)
    finally:
        launcher.kill()
        launcher.wait()
        launcher.stdout.close()


def test_a_launched_server_outlives_the_thread_that_launched_it(launch):
    servers = []
    thread = threading.Thread(target=lambda: servers.append(launch()))
    thread.start()
    thread.join()
    time.sleep(0.3)
    assert servers[0].process.poll() is None and servers[0].info().server_version


def test_a_closed_server_leaves_nothing(launch):
    server = launch()
    guard = server.guard._process
    server.close()
    assert server.process.poll() is not None and guard.poll() == 0 and not server.folder.exists()
    server.close()


def test_what_does_not_start_leaves_no_guard(tmp_path):
    with pytest.raises(limber.LimberError, match="did not start"):
        limber.launch("/bin/false")

"""What limberd tells a service manager, and the unit in packaging/."""

import contextlib
import os
import pathlib
import re
import select
import shutil
import signal
import socket
import subprocess
import time

import pytest
from conftest import ROOT

UNIT = ROOT / "packaging" / "limberd.service"


class Supervised:
    """limberd as systemd starts a unit with Type=notify."""

    def __init__(self, limberd, folder, *arguments, **environment):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(folder / "notify"))
        self.ready_file = folder / "ready"
        self.log = folder / "log"
        command = [str(limberd), "--bind", "tcp://127.0.0.1:0", "--stream", "tcp://127.0.0.1:0", "--no-cache",
                   "--ready-file", str(self.ready_file), *map(str, arguments)]
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(command, stderr=log, env={
                **os.environ, "NOTIFY_SOCKET": str(folder / "notify"), **environment})

    def hear(self, seconds=20):
        """The next message, as a dictionary; nothing in that time: None."""
        if not select.select([self.socket], [], [], seconds)[0]:
            return None
        return dict(line.split("=", 1) for line in self.socket.recv(4096).decode().splitlines())

    def hear_of(self, word):
        """The next message that is no more than a sign of life."""
        while (message := self.hear()) == {"WATCHDOG": "1"}:
            pass
        assert message and word in message, (message, self.log.read_text())
        return message

    def close(self):
        self.process.kill()
        self.process.wait()
        self.socket.close()


@pytest.fixture
def supervise(limberd, tmp_path):
    with contextlib.ExitStack() as stack:
        def start(*arguments, **environment):
            started = Supervised(limberd, tmp_path, *arguments, **environment)
            stack.callback(started.close)
            return started
        yield start


def test_it_says_when_it_is_ready_reloads_and_stops(supervise):
    server = supervise()
    assert server.hear_of("READY")["READY"] == "1"
    assert server.ready_file.exists(), "ready is told once everybody can come"
    server.process.send_signal(signal.SIGHUP)
    reloading = server.hear_of("RELOADING")
    assert reloading["RELOADING"] == "1"
    now = time.clock_gettime_ns(time.CLOCK_MONOTONIC) / 1e3
    assert 0 <= now - int(reloading["MONOTONIC_USEC"]) < 60e6
    assert server.hear_of("READY")["STATUS"] == "Serving"
    server.process.send_signal(signal.SIGTERM)
    assert server.hear_of("STOPPING") == {"STOPPING": "1", "STATUS": "Draining"}
    assert server.process.wait(20) == 0


def test_a_watchdog_is_fed_while_the_server_runs(supervise):
    server = supervise("--web", "127.0.0.1:0", WATCHDOG_USEC="400000")
    fed = sum(server.hear() == {"WATCHDOG": "1"} for _ in range(10))
    assert fed >= 8
    # A process that does not come round does not feed it.
    server.process.send_signal(signal.SIGSTOP)
    while server.hear(0.5):
        pass
    server.process.send_signal(signal.SIGCONT)
    assert server.hear() == {"WATCHDOG": "1"}


def test_without_a_watchdog_nobody_is_fed(supervise):
    server = supervise()
    server.hear_of("READY")
    assert server.hear(1) is None


def test_a_watchdog_of_another_process_is_not_ours(supervise):
    server = supervise(WATCHDOG_USEC="400000", WATCHDOG_PID="1")
    server.hear_of("READY")
    assert server.hear(1) is None


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="systemd-analyze is not installed")
def test_the_unit_is_sound_and_shut_in(limberd, tmp_path):
    unit = tmp_path / "limberd.service"
    unit.write_text(UNIT.read_text().replace("/usr/bin/limberd", str(pathlib.Path(limberd).resolve())))
    verified = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True)
    assert verified.returncode == 0 and not verified.stderr, verified.stderr
    rated = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=15", "--no-pager", unit],
                           capture_output=True, text=True)
    assert rated.returncode == 0, rated.stdout
    score, = re.findall(r"exposure level for \S+: (\S+)", rated.stdout)
    assert f"limberd.service: {score} " in (ROOT / "docs" / "operations.md").read_text(), "as the documentation says"


def test_options_of_the_unit_are_options(limberd):
    line, = re.findall(r"^ExecStart=(.*?[^\\])$", UNIT.read_text(), re.MULTILINE | re.DOTALL)
    words = [word.replace("/etc/limber", str(ROOT / "packaging")) for word in line.replace("\\\n", " ").split()]
    checked = subprocess.run([str(limberd), *words[1:], "--check-config"], capture_output=True, text=True, timeout=20)
    assert checked.returncode == 0, checked.stderr

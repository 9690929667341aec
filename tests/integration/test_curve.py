"""Beyond loopback: keys, and who is let in."""

import os
import signal
import subprocess

import limber
import pytest
from conftest import encrypting, small_scene, tip_of
from limber.v1 import service_pb2 as service


@pytest.fixture
def keys(limberd, tmp_path):
    for name in ("server", "friend", "stranger"):
        subprocess.run([str(limberd), "keygen", tmp_path / f"{name}.key"], check=True, capture_output=True, timeout=20)
    (tmp_path / "allowed").write_text((tmp_path / "friend.key.pub").read_text())
    return tmp_path


@pytest.fixture
def running(limberd, keys, cache_dir):
    with encrypting(limberd, keys, cache_dir) as ready:
        yield ready


@pytest.fixture
def endpoint(running):
    return running["requests"]


def test_who_is_let_in(endpoint, keys, cli):
    with limber.connect(endpoint, server_key=keys / "server.key.pub", key=keys / "friend.key") as server:
        session = server.open(small_scene(), progress=False)
        with session.stream(timeout=20) as stream:
            session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.1))
            assert any(frames.result.revision == 1 for frames in stream)
    for arguments in ({}, {"server_key": keys / "server.key.pub", "key": keys / "stranger.key"},
                      {"server_key": keys / "friend.key.pub", "key": keys / "friend.key"}):
        with pytest.raises(limber.ServerUnreachable) as caught:
            limber.connect(endpoint, timeout=0.4, **arguments)
        expected = "does not take these keys: a wrong server_key" if arguments else "a client without keys"
        assert expected in str(caught.value)
    public = (keys / "server.key.pub").read_text().strip()
    assert "protocol 1" in cli("--server-key", public, "--key", keys / "friend.key", "info", endpoint=endpoint).stdout
    refused = cli("--server-key", keys / "server.key.pub", "--key", keys / "stranger.key", "--timeout", 0.4, "info",
                  endpoint=endpoint)
    assert refused.returncode == 3
    assert "does not take these keys: a wrong server key" in refused.stderr and "limber start" not in refused.stderr
    assert "a client without keys" in cli("--timeout", 0.4, "info", endpoint=endpoint).stderr
    assert cli("--key", keys / "friend.key", "info", endpoint=endpoint).returncode == 1


def test_keys_where_there_are_none(server, keys, cli, tmp_path):
    """The opposite case: a limberd without keys, nobody, and a limberd that hangs."""
    key = {"server_key": keys / "server.key.pub", "key": keys / "friend.key"}
    options = ("--server-key", key["server_key"], "--key", key["key"], "--timeout", 0.4, "info")
    with pytest.raises(limber.ServerUnreachable, match="or a limberd without keys"):
        limber.connect(server.connection.endpoint, timeout=0.4, **key)
    assert "or a limberd without keys" in cli(*options, endpoint=server.connection.endpoint).stderr
    for nobody in (f"ipc://{tmp_path}/nobody", "tcp://127.0.0.1:9"):
        with pytest.raises(limber.ServerUnreachable, match="nothing listens there"):
            limber.connect(nobody, timeout=0.4, **key)
        assert "nothing listens there" in cli(*options, endpoint=nobody).stderr


def test_a_limberd_that_hangs_is_distinguished_from_wrong_keys(launch, cli):
    server = launch()
    server.process.send_signal(signal.SIGSTOP)
    try:
        with pytest.raises(limber.ServerUnreachable) as caught:
            limber.connect(server.connection.endpoint, timeout=3)
        assert "no limberd answers" in str(caught.value) and "nothing listens" not in str(caught.value)
    finally:
        server.process.send_signal(signal.SIGCONT)


def test_bad_key_files(keys):
    (keys / "bad").write_text("x" * 39)
    (keys / "bad.pub").write_text("x" * 40)
    for arguments, field in (({"server_key": keys / "bad", "key": keys / "friend.key"}, "server_key"),
                             ({"server_key": keys / "server.key.pub", "key": keys / "bad"}, "key"),
                             ({"server_key": keys / "server.key.pub", "key": keys / "none"}, "key"),
                             ({"server_key": keys / "server.key.pub"}, "key")):
        with pytest.raises(limber.LimberError) as caught:
            limber.connect("tcp://127.0.0.1:1", **arguments)
        assert caught.value.field == field
        assert "x" * 39 not in str(caught.value), "keys are not shown"


def test_a_list_of_keys_that_changes_is_read_again(running, keys):
    """SIGHUP: who was added is let in, who was taken off is cut off; a list that cannot be read changes nothing."""
    connect = lambda name, timeout: limber.connect(  # noqa: E731
        running["requests"], server_key=keys / "server.key.pub", key=keys / f"{name}.key", timeout=timeout)

    def hang_up():
        os.kill(running["pid"], signal.SIGHUP)

    def until(name):
        for _ in range(40):
            try:
                return connect(name, 0.5)
            except limber.ServerUnreachable:
                pass
        raise AssertionError(f"{name} is not let in")

    with connect("friend", 20) as friend:
        with pytest.raises(limber.ServerUnreachable):
            connect("stranger", 0.4)
        (keys / "allowed").write_text("no key")
        hang_up()
        assert friend.info().protocol_versions == [1]
        (keys / "allowed").write_text((keys / "stranger.key.pub").read_text())
        hang_up()
        with until("stranger") as stranger:
            assert stranger.info().counters["cut_off"] >= 1
            with pytest.raises(limber.LimberError):
                friend.connection.call("get_server_info", service.GetServerInfoRequest(), timeout=1.0)
            assert stranger.info().protocol_versions == [1]

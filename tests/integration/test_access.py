"""Who may do what: keys with roles, pages with roles, changes while clients are connected."""

import contextlib
import json
import stat
import subprocess
import threading

import limber
import pytest
from conftest import encrypting, small_scene, tip_of
from limber.v1 import service_pb2 as service

ROLES = ("view", "edit", "administer")


@pytest.fixture
def keys(limberd, tmp_path):
    """Of a server and of a client of each role, and the server's list."""
    for name in ("server", *ROLES, "stranger"):
        subprocess.run([str(limberd), "keygen", tmp_path / f"{name}.key"], check=True, capture_output=True, timeout=20)
    lines = [f"{(tmp_path / f'{role}.key.pub').read_text().strip()} {role} the-{role}  # of the test" for role in ROLES]
    (tmp_path / "allowed").write_text("# who may do what\n" + "\n".join(lines) + "\n")
    return tmp_path


@contextlib.contextmanager
def running(limberd, keys, cache_dir):
    """A server with these keys, a page and stored sessions: its endpoint for requests."""
    with encrypting(limberd, keys, cache_dir, "--web", "127.0.0.1:0", "--data", keys / "data", "--allow-shutdown") as ready:
        yield ready["requests"]


@pytest.fixture
def endpoint(limberd, keys, cache_dir):
    with running(limberd, keys, cache_dir) as requests:
        yield requests


def connected(endpoint, keys, name, **options):
    return limber.connect(endpoint, server_key=keys / "server.key.pub", key=keys / f"{name}.key", **options)


@pytest.fixture
def connect(endpoint, keys):
    return lambda name, **options: connected(endpoint, keys, name, **options)


@pytest.fixture
def run(cli, endpoint, keys):
    """The command line with the key of that name."""
    def ran(name, *arguments):
        return cli("--server-key", keys / "server.key.pub", "--key", keys / f"{name}.key", *arguments, endpoint=endpoint)
    return ran


def test_who_looks_sees_everything_and_changes_nothing(connect):
    with connect("edit") as editing, connect("view") as looking:
        made = editing.open(small_scene(), session="s", progress=False)
        seen = looking.session("s")
        with seen.stream(timeout=20) as stream:
            made.add(node=tip_of(made), frame=30, displacement=(0, 0, 0.1))
            assert any(frames.result.revision == 1 for frames in stream)
        seen.frames()
        assert seen.explain().choices is not None
        for attempt in (lambda: seen.undo(), lambda: seen.close(), lambda: looking.open(small_scene(), progress=False),
                        lambda: looking.shutdown(), lambda: looking.allowed()):
            with pytest.raises(limber.LimberError) as caught:
                attempt()
            assert caught.value.code == "PERMISSION_DENIED" and caught.value.details["has"] == "view", caught.value
            assert "needs the role" in str(caught.value)
        with pytest.raises(limber.LimberError, match="shutdown needs the role administer"):
            editing.shutdown()


def test_keys_come_and_go_while_the_server_runs(connect, keys):
    with connect("administer") as administering:
        assert [(key.role, key.name) for key in administering.allowed()] == [(role, f"the-{role}") for role in ROLES]
        with pytest.raises(limber.ServerUnreachable):
            connect("stranger", timeout=0.4)
        made = administering.allow(keys / "stranger.key", "edit", "ana")  # the secret key's name: the public one is sent
        assert made == limber.AllowedKey((keys / "stranger.key.pub").read_text().strip(), "edit", "ana")
        with connect("stranger") as ana:
            session = ana.open(small_scene(), session="s", progress=False)
            stream = session.stream(timeout=60)
            ended = threading.Event()

            def follow():
                try:
                    for _ in stream:
                        pass
                except limber.LimberError:
                    ended.set()

            following = threading.Thread(target=follow)
            following.start()
            assert administering.revoke("ana").role == "edit"
            with pytest.raises(limber.ServerUnreachable):
                ana.connection.call("get_server_info", service.GetServerInfoRequest(), timeout=1.0)
            assert ended.wait(30), "the stream has ended, with an error"
            following.join()
            stream.close()
        with pytest.raises(limber.ServerUnreachable):
            connect("stranger", timeout=0.4)
        text = (keys / "allowed").read_text()
        assert text.startswith("# who may do what\n") and text.count("# of the test") == 3 and "ana" not in text
        assert "s" in [one.session for one in administering.sessions()], "sessions stay"
        for wrong in (lambda: administering.allow(keys / "stranger.key", "reign"), lambda: administering.revoke("nobody"),
                      lambda: administering.allow("no key", "view"), lambda: administering.revoke("the-administer")):
            with pytest.raises(limber.LimberError):
                wrong()


def test_the_command_line_changes_the_list_of_a_server(run, keys):
    allowed = run("administer", "allow", keys / "stranger.key.pub", "--role", "view", "--name", "ana")
    assert allowed.returncode == 0 and "view ana" in allowed.stdout, allowed.stderr
    assert "you may   view" in run("stranger", "info").stdout
    refused = run("stranger", "open", "--sample", "beam")
    assert refused.returncode == 1 and "needs the role edit" in refused.stderr and "PERMISSION_DENIED" in refused.stderr
    assert run("stranger", "allowed").returncode == 1
    changed = run("administer", "allow", keys / "stranger.key", "--role", "edit")
    assert "edit ana" in changed.stdout and "(it was view before)" in changed.stdout
    listed = run("administer", "allowed").stdout
    assert listed.count("\n") == 5 and "ana" in listed
    assert json.loads(run("administer", "--json", "allowed").stdout)["keys"][3]["role"] == "ROLE_EDIT"
    assert "is revoked" in run("administer", "revoke", "ana").stdout
    assert run("stranger", "--timeout", 0.4, "info").returncode == 3
    assert run("administer", "revoke", "ana").returncode == 1
    assert run("edit", "stop").returncode == 1


def test_the_list_itself_where_no_server_runs(cli, keys):
    file, public = keys / "allowed", (keys / "stranger.key.pub").read_text().strip()
    added = cli("allow", keys / "stranger.key.pub", "--role", "view", "--name", "ana", "--file", file)
    assert added.returncode == 0 and added.stdout == f"{public} view ana\n", added.stderr
    assert file.read_text().endswith(f"\n{public} view ana\n")
    dash = "-" + public[1:]
    assert cli("allow", dash, "--role", "edit", "--file", file).stdout == f"{dash} edit\n"
    assert cli("allowed", "--file", file).stdout.count("\n") == 5
    assert cli("revoke", "ana", "--file", file).returncode == 0
    assert cli("revoke", dash, "--file", file).returncode == 0
    assert public not in file.read_text() and dash not in file.read_text()
    again = cli("revoke", "ana", "--file", file)
    assert again.returncode == 1 and "neither a key nor a name" in again.stderr
    assert cli("allow", public, "--role", "reign", "--file", file).returncode == 2
    first = cli("allow", public, "--role", "administer", "--file", keys / "new")
    assert first.returncode == 0 and (keys / "new").read_text() == f"{public} administer\n", first.stderr
    assert stat.S_IMODE((keys / "new").stat().st_mode) == 0o600
    assert cli("allow", "short", "--role", "view", "--file", file).returncode == 1


def test_files_without_roles_mean_edit(limberd, keys, cli, tmp_path, cache_dir):
    lines = [(keys / f"{role}.key.pub").read_text() for role in ROLES]
    (keys / "allowed").write_text("".join(lines))
    assert cli("allowed", "--file", keys / "allowed").stdout.count(" edit\n") == 3


def test_pages_may_do_what_their_token_says(connect, run):
    with connect("administer") as administering, connect("view") as looking:
        info = administering.info()
        assert [token.role for token in info.web_tokens] == [1, 2, 3] and info.web_token == info.web_tokens[2].token
        assert looking.info().web_token == info.web_tokens[0].token and len(looking.info().web_tokens) == 1
        view = run("administer", "web", "--no-open", "--role", "view").stdout
        assert view.strip().endswith("token=" + info.web_tokens[0].token)
        assert run("administer", "web", "--no-open").stdout.strip().endswith("token=" + info.web_token)
    refused = run("view", "web", "--no-open", "--role", "edit")
    assert refused.returncode == 1 and "PERMISSION_DENIED" in refused.stderr
    assert "token" not in run("administer", "--json", "info").stdout.replace("web_tokens\":[]", "").replace("web_token\":\"\"", "")


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o644])
def test_secret_keys_that_others_may_read_are_refused(limberd, keys, cli, mode):
    key = keys / "edit.key"
    assert stat.S_IMODE(key.stat().st_mode) == 0o600
    key.chmod(mode)
    command = f"chmod 600 {key}"
    with pytest.raises(limber.LimberError) as caught:
        limber.connect("tcp://127.0.0.1:1", server_key=keys / "server.key.pub", key=key)
    assert caught.value.field == "key" and command in str(caught.value)
    ran = cli("--server-key", keys / "server.key.pub", "--key", key, "info", endpoint="tcp://127.0.0.1:1")
    assert ran.returncode == 1 and command in ran.stderr
    ran = subprocess.run([str(limberd), "--curve-secret-file", key, "--curve-allow", keys / "allowed", "--bind",
                          "tcp://127.0.0.1:0", "--stream", "tcp://127.0.0.1:0"], capture_output=True, text=True, timeout=20)
    assert ran.returncode == 1 and command in ran.stderr


def test_keys_are_made_in_a_folder_of_their_own(limberd, tmp_path):
    subprocess.run([str(limberd), "keygen", tmp_path / "new" / "deep" / "a.key"], check=True, capture_output=True, timeout=20)
    for folder in ("new", "new/deep"):
        assert stat.S_IMODE((tmp_path / folder).stat().st_mode) == 0o700
    assert stat.S_IMODE((tmp_path / "new" / "deep" / "a.key").stat().st_mode) == 0o600


def test_folders_that_a_server_makes_are_its_owners(endpoint, keys):
    assert stat.S_IMODE((keys / "data").stat().st_mode) == 0o700
    for file in (keys / "data").iterdir():
        assert stat.S_IMODE(file.stat().st_mode) & 0o077 == 0, file


def test_whose_edit_is_in_the_way_is_told_by_the_name_of_the_key(connect):
    with connect("edit") as one, connect("administer") as other:
        made = one.open(small_scene(), session="s", progress=False)
        held = made.add(node=tip_of(made), frame=20, displacement=(0, 0.4, 0))
        of_other = other.session("s")
        with pytest.raises(limber.LimberError, match="the newest edit is by the-edit: ask"):
            of_other.undo()
        of_other.edit([limber.move(held.id, (0, 0.6, 0))])
        with pytest.raises(limber.LimberError, match="was changed since by the-administer: undo"):
            made.undo()

"""What one client, one file or one path must not do to a server: each a named error or a clean end."""

import json
import os
import signal
import subprocess
import time

import limber
import pytest
import zmq
from conftest import small_scene, tip_of
from limber.v1 import beams_pb2 as beams
from limber.v1 import scene_pb2 as scene_messages
from limber.v1 import service_pb2 as service
from refusals import refusal


def memory_of(pid):
    """Resident bytes."""
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


# ---- pipes ----

@pytest.fixture
def pipe(tmp_path):
    path = tmp_path / "pipe.msh"
    os.mkfifo(path)
    return path


def test_a_pipe_as_a_mesh_below_the_servers_folder(launch, pipe, tmp_path):
    server = launch("--mesh-root", tmp_path)
    scene = small_scene()
    scene.mesh.path = pipe.name
    with pytest.raises(limber.LimberError) as caught:
        server.connection.call("open_session", service.OpenSessionRequest(scene=scene), timeout=10)
    assert (caught.value.code, caught.value.field.removeprefix("open_session.")) == ("NOT_FOUND", "scene.mesh.path")
    # Beside a file that is one: the other half of TetGen's pair.
    (tmp_path / "half.node").write_text("1 3 0 0\n1 0 0 0\n")
    os.mkfifo(tmp_path / "half.ele")
    scene.mesh.path = "half.node"
    with pytest.raises(limber.LimberError) as caught:
        server.connection.call("open_session", service.OpenSessionRequest(scene=scene), timeout=10)
    assert caught.value.field.removeprefix("open_session.") == "scene.mesh.path"


def test_pipes_as_files_of_the_command_lines(limberd, cli, pipe, tmp_path):
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps({"mesh": {"path": pipe.name}, "frames": 60}))
    for arguments in (("validate", pipe), ("validate", scene), ("simulate", scene, "-o", tmp_path / "out.pc2")):
        ran = subprocess.run([str(limberd), *map(str, arguments)], capture_output=True, text=True, timeout=20)
        assert ran.returncode == 1 and "not a regular file" in ran.stdout + ran.stderr, arguments
    for arguments in (("open", pipe), ("open", scene), ("--key", pipe, "--server-key", pipe, "info")):
        ran = cli(*arguments, timeout=20)
        assert ran.returncode == 1 and "no regular file" in ran.stderr, (arguments, ran.stderr)


def test_pipes_as_files_of_the_package(server, pipe, tmp_path):
    for call in (lambda: limber.scene_from_mesh(pipe), lambda: limber.load_scene(pipe),
                 lambda: limber.connect(server.connection.endpoint, server_key=pipe, key=pipe)):
        with pytest.raises(limber.LimberError, match="no regular file") as caught:
            call()
        assert caught.value.code == "IO"


# ---- nested JSON ----

@pytest.mark.parametrize("begin, end", [('{"mesh":', "}"), ('{"nodes":[', "]}"), ("[", "]"), ('{"', "")],
                         ids=["messages", "structure", "arrays", "cut"])
@pytest.mark.parametrize("levels", [10_000, 1_000_000])
def test_nested_json_is_refused(limberd, cli, tmp_path, begin, end, levels):
    file = tmp_path / "scene.json"
    file.write_text(begin * levels + end * levels)
    ran = subprocess.run([str(limberd), "validate", str(file)], capture_output=True, text=True, timeout=20)
    assert ran.returncode == 1 and "INVALID_ARGUMENT" in ran.stdout, ran
    if end:
        assert "nested deeper than 100 levels at line 1 column" in ran.stdout
    ran = cli("open", file, timeout=20)
    assert ran.returncode == 1 and "INVALID_ARGUMENT" in ran.stderr, ran
    with pytest.raises(limber.LimberError) as caught:
        limber.load_scene(file)
    assert (caught.value.code, caught.value.field) == ("INVALID_ARGUMENT", "scene")


@pytest.mark.parametrize("levels", [10_000, 1_000_000])
def test_nested_json_of_a_job_is_refused(server, limberd, tmp_path, levels):
    content = '{"mesh filename": "m.ply", "label": ' + "[" * levels + "]" * levels + "}"
    (tmp_path / "SimulationJob.json").write_text(content)
    ran = subprocess.run([str(limberd), "validate", str(tmp_path)], capture_output=True, text=True, timeout=20)
    assert ran.returncode == 1 and "nested deeper than 100 levels" in ran.stdout + ran.stderr, ran
    request = beams.SolveBeamsRequest()
    request.job.name, request.job.content = "SimulationJob.json", content.encode()
    with pytest.raises(limber.LimberError, match="nested deeper than 100 levels") as caught:
        server.connection.call("solve_beams", request, timeout=20)
    assert caught.value.code == "INVALID_ARGUMENT"


def test_json_of_a_hundred_levels_is_read(limberd, tmp_path):
    """Brackets in texts do not count."""
    file = tmp_path / "scene.json"
    file.write_text(json.dumps({"name": "[" * 5000 + '\\"{' * 5000, "frames": 60}))
    ran = subprocess.run([str(limberd), "validate", str(file)], capture_output=True, text=True, timeout=20)
    assert "nested" not in ran.stdout and "mesh" in ran.stdout


# ---- numbers ----

@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e-13, 1e13, 1e300])
def test_scales_of_placements_that_leave_the_range_of_numbers(server, scale):
    corners = [(x, y, 0.1 * x * y) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)]
    assert refusal(lambda: server.starting_grid(corners, scale=scale, section={"rectangle": (0.02, 0.004)})) == (
        "INVALID_ARGUMENT", "placement.scale")


# ---- subscriptions ----

@pytest.mark.parametrize("transport", ["ipc", "tcp"])
def test_a_hundred_thousand_subscriptions_of_one_client(launch, transport):
    server = launch(transport=transport)
    session = server.open(small_scene(), progress=False)
    before = memory_of(server.process.pid)
    context = zmq.Context()
    greedy, modest = context.socket(zmq.SUB), context.socket(zmq.SUB)
    try:
        modest.connect(server.stream_endpoint)
        modest.subscribe("session/")
        greedy.sndhwm = 0  # else libzmq itself drops what is beyond a thousand
        cut = greedy.get_monitor_socket(zmq.EVENT_DISCONNECTED)
        greedy.connect(server.stream_endpoint)
        for i in range(100_000):
            greedy.subscribe(f"session/{i:06}/" + "x" * 100)
        deadline = time.monotonic() + 30
        slowest = 0.0
        while server.info().counters["cut_off"] == 0:
            assert time.monotonic() < deadline, "nobody was cut off"
            begin = time.monotonic()
            server.info()
            slowest = max(slowest, time.monotonic() - begin)
        assert cut.poll(5000), "the connection has ended"
        assert memory_of(server.process.pid) - before < 400 << 20
        # Others are served meanwhile; whoever was cut off comes again and again.
        added = session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.1))
        assert added and session.wait().revision == 1
        heard = 0
        while modest.poll(5000) and heard < 3:
            modest.recv_multipart()
            heard += 1
        assert heard == 3
        assert slowest < 5
    finally:
        context.destroy(linger=0)
    assert server.info().protocol_versions == [1]


# ---- endpoints ----

def start(limberd, bind, ready, *more):
    ready.unlink(missing_ok=True)
    return subprocess.Popen([str(limberd), "--bind", bind, "--stream", f"{bind}.stream", "--ready-file", str(ready),
                             "--no-cache", *more], stderr=subprocess.PIPE, text=True)


def await_ready(process, ready):
    for _ in range(1000):
        if ready.exists():
            return
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.02)
    raise AssertionError("limberd did not become ready")


def test_a_second_server_on_one_ipc_path_is_refused(limberd, tmp_path):
    bind, ready = f"ipc://{tmp_path}/requests", tmp_path / "ready"
    first = start(limberd, bind, ready)
    try:
        await_ready(first, ready)
        for state in ("running", "stopped"):
            if state == "stopped":
                first.send_signal(signal.SIGSTOP)
            second = subprocess.run([str(limberd), "--bind", bind, "--stream", f"ipc://{tmp_path}/other", "--no-cache"],
                                    capture_output=True, text=True, timeout=20)
            assert second.returncode == 1, state
            assert "--bind" in second.stderr and "another server listens there" in second.stderr
            stream = subprocess.run([str(limberd), "--bind", f"ipc://{tmp_path}/third", "--stream", f"{bind}.stream",
                                     "--no-cache"], capture_output=True, text=True, timeout=20)
            assert stream.returncode == 1 and "--stream" in stream.stderr, state
        first.send_signal(signal.SIGCONT)
        with limber.connect(bind) as server:
            assert server.info().protocol_versions == [1], "the first one is untouched"
    finally:
        first.send_signal(signal.SIGCONT)
        first.terminate()
        assert first.wait(10) == 0
        first.stderr.close()


def test_the_socket_of_a_killed_server_is_taken_over(limberd, tmp_path):
    bind, ready = f"ipc://{tmp_path}/requests", tmp_path / "ready"
    first = start(limberd, bind, ready)
    await_ready(first, ready)
    first.kill()
    first.wait()
    first.stderr.close()
    assert (tmp_path / "requests").exists(), "the file is left"
    second = start(limberd, bind, ready)
    try:
        await_ready(second, ready)
        with limber.connect(bind) as server:
            assert server.info().protocol_versions == [1]
    finally:
        second.terminate()
        assert second.wait(10) == 0
        second.stderr.close()


def test_a_file_at_an_ipc_path_is_not_overwritten(limberd, tmp_path):
    (tmp_path / "notes").write_text("mine")
    ran = subprocess.run([str(limberd), "--bind", f"ipc://{tmp_path}/notes", "--stream", f"ipc://{tmp_path}/s",
                          "--no-cache"], capture_output=True, text=True, timeout=20)
    assert ran.returncode == 1 and "no socket" in ran.stderr
    assert (tmp_path / "notes").read_text() == "mine"


# ---- files that are no text ----

@pytest.mark.parametrize("name, content", [("a.inp", b"*NODE\n1, 0,0,0\n*ELEMENT, TYPE=\xff\xfe\n1, 1,2,3,4\n"), ("a.inp", b"\x00\xff"),
                                           ("a.msh", b"$MeshFormat\n\xff"), ("\x00.node", b"1")],
                         ids=["kind", "zero", "version", "name"])
def test_refusals_of_bytes_that_are_no_text_can_be_read(server, name, content):
    """The words of readers repeat what they read; a reply with such bytes would be none to any client."""
    scene = scene_messages.Scene(frames=20)
    scene.mesh.file.name, scene.mesh.file.content = name, content
    with pytest.raises(limber.LimberError) as caught:
        server.open(scene, progress=False)
    assert caught.value.code in ("INVALID_ARGUMENT", "UNSUPPORTED", "NOT_FOUND") and caught.value.message


def test_warnings_of_bytes_that_are_no_text_can_be_read(server):
    scene = scene_messages.Scene(frames=20)
    scene.mesh.file.name = "a.veg"
    scene.mesh.file.content = (b"*VERTICES\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n*ELEMENTS\nTET\n1 4 0\n1 1 2 3 4\n"
                               b"*INCLUDE \xc3.veg\n")
    issues = server.connection.call("validate_scene", service.ValidateSceneRequest(scene=scene), timeout=10).issues
    assert any("is not there" in issue.message for issue in issues)


def test_a_small_file_does_not_take_much_memory(server):
    """A list that is included a thousand times: 600 kB that took gigabytes."""
    mesh = b"*VERTICES\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n*ELEMENTS\nTET\n1 4 0\n1 1 2 3 4\n"
    scene = scene_messages.Scene(frames=20)
    scene.mesh.file.name = "a.veg"
    scene.mesh.file.content = mesh + b"".join(b"*SET s%d\n*INCLUDE ids.veg\n" % i for i in range(900))
    scene.mesh.file.companions["ids.veg"] = b"1," * 300_000 + b"1\n"
    before = memory_of(server.process.pid)
    with pytest.raises(limber.LimberError) as caught:
        server.open(scene, progress=False)
    assert caught.value.code == "LIMIT_EXCEEDED" and "include each file once" in str(caught.value)
    assert memory_of(server.process.pid) < before + 100e6

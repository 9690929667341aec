"""Files that clients name by path: nothing outside of --mesh-root is read, nothing is waited for, nothing is told of what is there."""

import os
import stat
import threading

import limber
import pytest
from conftest import small_scene
from limber.v1 import scene_pb2 as scenes
from limber.v1 import service_pb2 as service

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
LINES = "v 0 0 0\nv 1 0 0\nl 1 2\n"


@pytest.fixture
def folders(tmp_path):
    """The server's folder with all that leads out of it, and a secret beside it."""
    root, outside = tmp_path / "root", tmp_path / "outside"
    for folder in (root, root / "inside", outside):
        folder.mkdir()
    (outside / "secret.mtl").write_text("newmtl secret\nKd 1 0 0\n")
    (root / "inside" / "body.obj").write_text("mtllib body.mtl ../../outside/secret.mtl\n" + OBJ)
    (root / "inside" / "body.mtl").write_text("newmtl body\nKd 0 1 0\n")
    (root / "links").mkdir()
    (root / "links" / "folder").symlink_to(outside, target_is_directory=True)
    (root / "links" / "process").symlink_to("/proc/self")
    for end in (".obj", ".pc2"):
        (outside / f"secret{end}").write_text(OBJ)
        (root / "links" / f"file{end}").symlink_to(outside / f"secret{end}")
        (root / "links" / f"relative{end}").symlink_to(f"../../outside/secret{end}")
        (root / "links" / f"endless{end}").symlink_to("/dev/zero")
        (root / "links" / f"round{end}").symlink_to(f"round{end}")
        os.mkfifo(root / f"pipe{end}")
        try:
            os.mknod(root / f"zero{end}", 0o666 | stat.S_IFCHR, os.makedev(1, 5))
        except PermissionError:
            pass  # only root makes devices
    return root, outside


@pytest.fixture
def server(launch, folders):
    return launch("--mesh-root", folders[0])


def leading_out(folders):
    root, outside = folders
    return ["../outside/secret.obj", "inside/../../outside/secret.obj", str(outside / "secret.obj"), f"{root}/../outside/secret.obj",
            "links/file.obj", "links/relative.obj", "links/folder/secret.obj", "links/process/environ", "links/process/root/etc/passwd",
            f"links/process/cwd/{outside.name}", "links/endless.obj", "links/round.obj", "/proc/self/environ", "/proc/self/fd/0", "/dev/zero",
            "/etc/passwd", "pipe.obj", "zero.obj", "inside", ".", "..", "", "inside/body.obj/", "inside/body.obj\0.obj", "x" * 5000,
            "../outside/nothing.obj"]


def by_mesh(path):
    scene = small_scene()
    scene.mesh.path = path
    return scene, "scene.mesh.path"


def by_surface(path):
    scene = small_scene()
    scene.surface.path = path
    return scene, "scene.surface.path"


def by_base_motion(path):
    scene = small_scene()
    scene.base_motion.path = path.replace(".obj", ".pc2")
    return scene, "scene.base_motion.path"


def by_series(path):
    scene = small_scene()
    scene.base_motion.vtu_series.paths.append(path)
    return scene, "scene.base_motion.vtu_series.paths"


def by_keyframe(path):
    scene = small_scene()
    scene.keyframes.add(id=1, frame=20, path=path)
    return scene, "scene.keyframes[0].path"


def by_lines(path):
    scene = scenes.Scene()
    scene.linkage.lines.path = path
    scene.linkage.section.rectangle.width = scene.linkage.section.rectangle.height = 0.01
    return scene, "scene.linkage.lines.path"


def refusal(server, scene):
    """Code, field and message; a request that hangs fails by its deadline."""
    with pytest.raises(limber.LimberError) as caught:
        server.connection.call("open_session", service.OpenSessionRequest(scene=scene), timeout=20)
    return caught.value.code, caught.value.field, caught.value.message


@pytest.mark.parametrize("source", [by_mesh, by_surface, by_base_motion, by_series, by_keyframe, by_lines])
def test_nothing_leads_out(server, folders, source):
    told = set()
    for path in leading_out(folders):
        scene, field = source(path)
        code, at, message = refusal(server, scene)
        if source is by_base_motion and code == "INVALID_ARGUMENT" and not path.endswith(".obj"):
            assert "neither a .pc2" in message or len(path) > 1000, path[:100]  # refused before anything is looked at
            continue
        assert at.startswith(field), (path, at, message)
        assert code in ("NOT_FOUND", "MALFORMED", "INVALID_ARGUMENT"), (path, code, message)
        if 0 < len(path) < 1000 and "\0" not in path:
            assert code == "NOT_FOUND", (path, code, message)
            told.add(message.replace(path.replace(".obj", ".pc2") if source is by_base_motion else path, "PATH"))
        for secret in ("newmtl", "PATH=", "root:", "Kd"):
            assert secret not in message
    assert len(told) == 1, f"what is there does not look like what is not: {told}"
    assert server.process.poll() is None


def test_what_is_inside_is_read(server):
    scene = small_scene()
    scene.surface.path = "inside/body.obj"
    response = server.connection.call("validate_scene", service.ValidateSceneRequest(scene=scene), timeout=20)
    assert not any(issue.field == "scene.surface.path" for issue in response.issues), response
    scene.surface.path = "inside/./../inside/body.obj"
    response = server.connection.call("validate_scene", service.ValidateSceneRequest(scene=scene), timeout=20)
    assert not any(issue.field == "scene.surface.path" for issue in response.issues), response


def test_files_that_name_others_do_not_lead_out(server, folders):
    """Material files of an .obj, frames of a .pvd, includes of a .veg, the other half of TetGen's pair."""
    root, outside = folders
    (root / "motion.pvd").write_text('<VTKFile type="Collection"><Collection><DataSet timestep="0" file="../outside/secret.obj"/>'
                                     '<DataSet timestep="1" file="/etc/passwd"/></Collection></VTKFile>')
    scene = small_scene()
    scene.base_motion.path = "motion.pvd"
    assert refusal(server, scene)[:2] == ("NOT_FOUND", "scene.base_motion.path")
    (root / "mesh.veg").write_text("*VERTICES\n*INCLUDE ../outside/secret.obj\n*ELEMENTS\n*INCLUDE /etc/passwd\n")
    scene = small_scene()
    scene.mesh.path = "mesh.veg"
    code, field, message = refusal(server, scene)
    assert field.startswith("scene.mesh.path") and "root:" not in message, message
    half = root / "half"
    half.mkdir()
    (half / "tet.node").write_text("4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n")
    (outside / "tet.ele").write_text("1 4 0\n0 0 1 2 3\n")
    (half / "tet.ele").symlink_to(outside / "tet.ele")
    scene.mesh.path = "half/tet.node"
    assert refusal(server, scene)[:2] == ("NOT_FOUND", "scene.mesh.path")
    (half / "tet.ele").unlink()
    os.mkfifo(half / "tet.ele")
    assert refusal(server, scene)[1].startswith("scene.mesh.path")
    surface = root / "colours"
    surface.mkdir()
    (surface / "a.obj").write_text("mtllib a.mtl\n" + OBJ)
    os.mkfifo(surface / "a.mtl")
    scene = small_scene()
    scene.surface.path = "colours/a.obj"  # without its colours it is a surface
    server.connection.call("validate_scene", service.ValidateSceneRequest(scene=scene), timeout=20)


@pytest.mark.timeout(180)
def test_a_file_that_grows_is_read_to_an_end(server, folders):
    root, _ = folders
    path = root / "grows.msh"
    path.write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1000000000\n")
    ended = threading.Event()

    def grow():
        line = b"1 0 0 0\n" * 8192
        written = 0
        while not ended.is_set() and written < 32 << 20:
            with open(path, "ab") as file:
                written += file.write(line)

    growing = threading.Thread(target=grow)
    growing.start()
    try:
        scene = small_scene()
        scene.mesh.path = "grows.msh"
        for _ in range(3):
            with pytest.raises(limber.LimberError) as caught:
                server.connection.call("open_session", service.OpenSessionRequest(scene=scene), timeout=50)
            assert caught.value.field.startswith("scene.mesh.path"), caught.value
    finally:
        ended.set()
        growing.join()
    assert server.process.poll() is None


def test_a_root_that_is_a_link_or_moves_away(launch, tmp_path, folders):
    root, outside = folders
    alias = tmp_path / "alias"
    alias.symlink_to(root, target_is_directory=True)
    server = launch("--mesh-root", alias)
    scene = small_scene()
    scene.surface.path = "inside/body.obj"
    call = lambda: server.connection.call("validate_scene", service.ValidateSceneRequest(scene=scene), timeout=20)  # noqa: E731
    assert not any(issue.field == "scene.surface.path" for issue in call().issues)
    alias.unlink()
    assert any(issue.field == "scene.surface.path" for issue in call().issues)

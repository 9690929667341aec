"""Motions taken away as one page, pictures and films of the page, and the page of a session."""

import base64
import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import urllib.request

import limber
import numpy as np
import pytest
from conftest import tip_of
from limber import browsing, headless, player, rendering
from limber.v1 import service_pb2 as service
from linkage_inputs import linkage  # noqa: F401
from test_pictures import beams  # noqa: F401

ENDINGS = {".png": b"\x89PNG", ".jpg": b"\xff\xd8\xff"}

needs_player = pytest.mark.skipif(not player.TEMPLATE.exists(), reason="built without the page: scripts/build-web")
needs_chromium = pytest.mark.skipif(not any(map(shutil.which, headless.NAMES)), reason="no Chromium")
needs_ffmpeg = pytest.mark.skipif(not shutil.which("ffmpeg"), reason="no ffmpeg")


@contextlib.contextmanager
def refused(code="INVALID_ARGUMENT", says="", field=""):
    with pytest.raises(limber.LimberError) as caught:
        yield
    assert caught.value.code == code and says in str(caught.value) and field in ("", caught.value.field)


def stored(path):
    """The motion in a saved page."""
    return json.loads(re.search(r'id="motion">(.*?)</script>', path.read_text(), re.DOTALL).group(1))


def unpacked(packed):
    low, step = (np.frombuffer(base64.b64decode(packed[name]), "<f4").astype(float) for name in ("low", "step"))
    numbers = np.frombuffer(base64.b64decode(packed["numbers"]), "<u2").reshape(packed["rows"], packed["columns"])
    return low + step * numbers


@needs_player
def test_a_saved_page_has_the_motion_within_its_tolerance(session, tmp_path):
    session.add(node=tip_of(session), frame=30, displacement=(0, 0.4, 0))
    session.wait()
    saved = session.save_html(tmp_path / "motion.html")
    surface = session.moving_surface()
    assert 0 < saved.error < 1.2e-4 * surface.size and saved.frames == 60
    motion = stored(saved.files[0])
    assert motion["kind"] == "bodies" and motion["up"] == "y" and motion["rate"] == surface.frames_per_second
    assert saved.files[0].stat().st_size < 2e6
    geometry = service.GetGeometryResponse.FromString(base64.b64decode(motion["geometry"]))
    rest = np.frombuffer(geometry.rest.data, "<f4").astype(float)
    found = rest + unpacked(motion["frames"]) @ unpacked(motion["basis"]).T
    apart = np.linalg.norm(found.reshape(surface.positions.shape) - surface.positions, axis=2).max()
    assert apart <= 1.0001 * saved.error + 1e-9
    coarse = session.save_html(tmp_path / "coarse.html", tolerance=0.05)
    assert coarse.targets < saved.targets and coarse.error > saved.error


@needs_player
def test_paths_of_linkages_and_beams_are_saved_as_they_are(linkage, beams, tmp_path):  # noqa: F811
    linkage.deploy(60)
    linkage.wait()
    for opened in (linkage, beams):
        saved = opened.save_html(tmp_path / "path.html", frames_per_second=10)
        motion = stored(saved.files[0])
        numbers = opened.frames(encoding="coordinates")
        assert np.abs(unpacked(motion["frames"]) - numbers).max() <= np.ptp(numbers, axis=0).max() / player.LEVELS + 1e-6
        assert motion["rate"] == 10 and motion["up"] == "z"


@needs_player
def test_a_carried_surface_is_what_is_saved(session, tmp_path):
    tetrahedron = tmp_path / "inside.obj"
    tetrahedron.write_text("v 1 .2 .2\nv 1.3 .2 .2\nv 1 .5 .2\nv 1 .2 .5\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    saved = session.save_html(tmp_path / "motion.html", surface=tetrahedron)
    assert saved.vertices == 4


def test_bad_options_of_pages_and_pictures(session, linkage, tmp_path):  # noqa: F811
    path = tmp_path / "x.html"
    for field, options in {"tolerance": {"tolerance": 0}, "up": {"up": "x"}, "frames_per_second": {"frames_per_second": -1}}.items():
        with refused(field=field):
            session.save_html(path, **options)
    with refused(field="path"):
        session.save_html(tmp_path / "motion.gltf")
    with refused(field="path"):
        session.render(tmp_path / "picture.bmp")
    with refused(field="size"):
        session.render(tmp_path / "picture.png", size=(10, 100000))
    with refused(field="view"):
        session.render(tmp_path / "picture.png", view=(1, 2, 3))
    if player.TEMPLATE.exists():
        with refused("OUT_OF_RANGE", field="frame"):
            session.render(tmp_path / "picture.png", frame=60)
        with refused(field="surface"):
            linkage.save_html(path, surface=_obj(tmp_path))
    assert not path.exists()


def _obj(folder):
    (folder / "t.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    return folder / "t.obj"


def test_without_a_player_or_a_browser_it_says_so(session, tmp_path, monkeypatch):
    if player.TEMPLATE.exists():
        monkeypatch.setenv("LIMBER_CHROMIUM", "no-such-program")
        with refused("NOT_FOUND", field="LIMBER_CHROMIUM"):
            session.render(tmp_path / "picture.png")
        monkeypatch.setattr(shutil, "which", lambda name: None)
        with refused("NOT_FOUND", "ffmpeg"):
            session.render(tmp_path / "film.mp4")
    monkeypatch.setattr(player, "TEMPLATE", tmp_path / "nowhere.html")
    with refused("NOT_FOUND", "build-web"):
        session.save_html(tmp_path / "motion.html")


@needs_player
@needs_chromium
@pytest.mark.timeout(300)
def test_pictures_are_rendered_of_the_frame_that_is_asked_for(session, tmp_path):
    session.add(node=tip_of(session), frame=30, displacement=(0, 0.4, 0))
    session.wait()
    made = {frame: session.render(tmp_path / f"{frame}.png", frame=frame, size=(320, 240)).read_bytes() for frame in (0, 30, -1)}
    assert all(content.startswith(ENDINGS[".png"]) for content in made.values()) and made[0] != made[30]
    assert made[-1] == session.render(tmp_path / "59.png", frame=59, size=(320, 240)).read_bytes()
    image = pytest.importorskip("matplotlib.image")
    pixels = image.imread(tmp_path / "30.png")[:, :, :3]
    assert pixels.shape == (240, 320, 3)
    orange = (pixels.max(axis=2) - pixels.min(axis=2)) > 0.2
    assert 0.03 < orange.mean() < 0.9
    rim = np.concatenate([orange[0], orange[-1], orange[:, 0], orange[:, -1]])
    assert not rim.any(), "the body is cut off"
    side = session.render(tmp_path / "side.png", frame=30, size=(320, 240), view=(0, 0))  # along the bar's length
    assert orange.mean() > 1.2 * ((p := image.imread(side)[:, :, :3]).max(axis=2) - p.min(axis=2) > 0.2).mean() > 0.01


@needs_player
@needs_chromium
@needs_ffmpeg
@pytest.mark.timeout(300)
def test_the_command_line_renders_films(server, limberd, beams, tmp_path):  # noqa: F811
    film, picture = tmp_path / "path.gif", tmp_path / "path.png"
    command = [str(limberd.parent / "limber"), "--endpoint", server.connection.endpoint, "render", beams.id, "--size", "160x120"]
    environment = {**os.environ, "LIMBER_PYTHON": sys.executable}
    for path in (film, picture):
        made = subprocess.run([*command, "-o", str(path)], env=environment, capture_output=True, text=True)
        assert made.returncode == 0 and made.stdout.strip() == str(path), made.stderr
    assert film.read_bytes().startswith(b"GIF89a") and picture.read_bytes().startswith(ENDINGS[".png"])
    mp4 = beams.render(tmp_path / "path.mp4", size=(161, 121), frames_per_second=12)
    probed = subprocess.run(["ffprobe", "-v", "error", "-show_entries", "stream=width,height,nb_frames,avg_frame_rate", "-of", "json",
                             str(mp4)], capture_output=True, text=True, check=True)
    stream, = json.loads(probed.stdout)["streams"]
    assert (stream["width"], stream["height"], stream["avg_frame_rate"]) == (162, 122, "12/1")
    assert int(stream["nb_frames"]) == len(beams.frames())
    wrong = subprocess.run([*command, "-o", str(tmp_path / "path.bmp")], env=environment, capture_output=True, text=True)
    assert wrong.returncode == 1 and ".mp4" in wrong.stderr


def test_fast_films_leave_frames_out_of_gifs():
    assert rendering._shown(10, 24, rendering.GIF_RATE) == (list(range(10)), 24)
    assert rendering._shown(10, 100, rendering.GIF_RATE) == ([0, 4, 8], 25)
    assert rendering._shown(5, 120, np.inf) == (list(range(5)), 120)


def test_a_session_is_shown_on_its_page(launch, monkeypatch, tmp_path):
    server = launch(web=True, embed_in=["http://localhost:8888"])
    session = server.open(sample="beam", session="a.name", wait=False, progress=False)
    page = session.show(browser=False, height=400)
    info = server.info()
    assert page.url == f"{info.web}/?token={info.web_token}#a.name"
    frame = page._repr_html_()
    assert "<iframe" in frame and 'height="400"' in frame and info.web_token in frame
    assert info.web_token not in repr(page), "it would be in logs"
    with urllib.request.urlopen(page.url) as answer:
        assert "http://localhost:8888" in answer.headers["Content-Security-Policy"]

    opened = []
    monkeypatch.setattr(browsing.webbrowser, "open", lambda url: opened.append(url) or True)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    session.show()
    leads, = tmp_path.glob("limber/*.html")
    assert opened == [leads.as_uri()], "the token is not for a command line"
    assert page.url in leads.read_text() and leads.stat().st_mode & 0o077 == 0
    monkeypatch.setattr(browsing.webbrowser, "open", lambda url: False)
    with refused("FAILED_PRECONDITION", field="browser"):
        session.show()
    session.close()
    with refused("NOT_FOUND"):
        session.show(browser=False)


def test_in_a_notebook_no_browser_is_opened(launch, monkeypatch):
    session = launch(web=True).open(sample="beam", wait=False, progress=False)
    monkeypatch.setattr(browsing, "in_notebook", lambda: True)
    monkeypatch.setattr(browsing.webbrowser, "open", lambda url: pytest.fail("opened"))
    assert "<iframe" in session.show()._repr_html_()


def test_a_server_without_pages_says_how_to_get_them(session):
    with refused("FAILED_PRECONDITION", "--web", field="web"):
        session.show(browser=False)
    with refused(field="embed_in"):
        limber.launch(embed_in=["http://localhost:8888"])

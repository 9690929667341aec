"""Loops, holds and paths, local edits, inertia and animated pins, as an animator has them: by a server, in every client."""

import contextlib
import json

import glb_files
import limber
import numpy as np
import pytest
from conftest import bar, small_scene, tip_of

HEIGHT = 0.3


@pytest.fixture
def body(server):
    session = server.open(small_scene(), progress=False)
    session.wait()
    yield session
    session.close()


def tip_path(session):
    """frames x 3, of the tip from its rest."""
    tip = tip_of(session)
    return session.frames()[:, tip] - session.geometry().rest[tip]


def test_a_hold_is_met_in_all_its_frames_and_moves_as_one(body):
    hold = body.add(node=tip_of(body), frame=20, displacement=(0, 0, HEIGHT), until=35, exact=True)
    body.wait()
    assert np.abs(tip_path(body)[20:36] - (0, 0, HEIGHT)).max() < 1e-5
    hold.move((0, HEIGHT, 0))
    hold.retime(shift=5)
    body.wait()
    assert np.abs(tip_path(body)[25:41] - (0, HEIGHT, 0)).max() < 1e-5
    assert hold.path == ((25, (0, HEIGHT, 0)), (40, (0, HEIGHT, 0)))
    body.undo()
    body.undo()
    body.wait()
    assert np.abs(tip_path(body)[20:36] - (0, 0, HEIGHT)).max() < 1e-5
    assert len(body.constraints()) == 1


def test_a_path_goes_from_key_to_key(body):
    path = body.add(node=tip_of(body), frame=10, displacement=(0, 0, 0), exact=True, ease_in=0,
                    path=[(20, (0, 0, HEIGHT)), (30, None), (45, (0, HEIGHT, 0))])
    body.wait()
    shown = tip_path(body)
    assert np.abs(shown[20:31] - (0, 0, HEIGHT)).max() < 1e-5
    assert np.abs(shown[45] - (0, HEIGHT, 0)).max() < 1e-5
    assert np.all(np.diff(shown[10:21, 2]) > 0)
    assert shown[11, 2] > 0.05 * HEIGHT, "begins at its speed"
    assert HEIGHT - shown[19, 2] < 0.05 * HEIGHT, "comes to rest"
    path.retime(first=10, last=55)
    body.wait()
    assert np.abs(tip_path(body)[55] - (0, HEIGHT, 0)).max() < 1e-5
    path.move((0, 0, 0.1))
    assert [target for _, target in path.path] == pytest.approx(
        [(0, 0, 0.1), (0, 0, 0.4), (0, 0, 0.4), (0, 0.3, 0.1)])
    scene = body.settings()
    assert [key.frame for key in scene.constraints[0].path] == [23, 36, 55] and scene.constraints[0].ease_in == 0


def test_the_command_line_takes_holds_paths_loops_and_reach(cli, body):
    tip = str(tip_of(body))
    held = cli("add", body.id, "--node", tip, "--frame", 20, "--displacement", 0, 0, HEIGHT, "--until", 30, "--exact")
    assert held.returncode == 0, held.stderr
    moved = cli("add", body.id, "--node", tip, "--frame", 40, "--displacement", 0, 0, 0, "--path", "45,0,0.1,0", "--path",
                "50,0,0,0.1", "--ease-out", 0, "--reach", 0.4)
    assert moved.returncode == 0, moved.stderr
    hold, path = body.settings().constraints
    assert [key.frame for key in hold.path] == [30] and hold.exact
    assert [key.frame for key in path.path] == [45, 50] and path.ease_out == 0 and path.reach == 0.4
    listed = cli("show", body.id).stdout
    assert " 20-30 " in listed and " 40-50 within 0.4 s " in listed
    assert cli("ends", body.id, "--first", "cyclic", "--last", "cyclic").returncode == 0
    wrong = cli("ends", body.id, "--first", "cyclic", "--last", "free")
    assert wrong.returncode != 0 and "either both ends are cyclic" in wrong.stderr
    wrong = cli("add", body.id, "--node", tip, "--frame", 20, "--displacement", 0, 0, 0, "--path", "45,0")
    assert wrong.returncode != 0 and "a key is a frame and a target" in wrong.stderr


def test_a_loop_comes_round(server, body):
    tip = tip_of(body)
    body.ends("cyclic")
    body.add(node=tip, frame=2, displacement=(0, 0, HEIGHT), exact=True)
    body.add(node=tip, frame=32, displacement=(0, HEIGHT, 0), exact=True)
    result = body.wait()
    assert result.status == "CONVERGED"
    shown = tip_path(body)
    around = np.concatenate([shown, shown])
    steps = np.linalg.norm(np.diff(around, axis=0), axis=1)
    assert steps[59] < 1.2 * steps.max() and steps[59] > 1e-3, "the last frame leads into the first, in motion"
    # The same keys, turned around the seam.
    turned = small_scene(first_end="cyclic", last_end="cyclic")
    with contextlib.closing(server.open(turned, progress=False)) as other:
        other.add(node=tip, frame=42, displacement=(0, 0, HEIGHT), exact=True)
        other.add(node=tip, frame=12, displacement=(0, HEIGHT, 0), exact=True)
        other.wait()
        assert np.abs(np.roll(tip_path(other), 20, axis=0) - shown).max() < 1e-5


def test_a_saved_loop_is_closed(body, tmp_path):
    body.ends("cyclic")
    body.add(node=tip_of(body), frame=2, displacement=(0, 0, HEIGHT), exact=True)
    body.add(node=tip_of(body), frame=32, displacement=(0, HEIGHT, 0), exact=True)
    body.wait()
    assert body.save(tmp_path / "loop.glb").frames == 60
    document, values = glb_files.read(tmp_path / "loop.glb")
    [sampler] = document["animations"][0]["samplers"]
    times = values(sampler["input"])
    weights = values(sampler["output"]).reshape(len(times), -1)
    assert len(times) == 61 and times[-1] == pytest.approx(60 / 30)
    assert np.array_equal(weights[0], weights[-1])


def test_a_local_edit_leaves_the_rest(body):
    tip = tip_of(body)
    body.add(node=tip, frame=10, displacement=(0, 0, HEIGHT))
    body.add(node=tip, frame=50, displacement=(0, HEIGHT, 0))
    body.wait()
    before = body.frames()
    local = body.add(node=tip, frame=30, displacement=(0, 0, -HEIGHT), exact=True, reach=0.3)
    body.wait()
    change = np.abs(body.frames() - before).max(axis=(1, 2))
    assert change[:21].max() < 3e-6 and change[40:].max() < 3e-6 and change[30] > 0.1
    local.remove()
    body.wait()
    assert np.abs(body.frames() - before).max() < 1e-4


def carried_scene(**options):
    """The bar of small_scene(), whose pins go up and down."""
    nodes, _ = bar()
    nodes = np.asarray(nodes, dtype=float)
    pins = nodes[nodes[:, 0] == 0]
    way = 0.2 * np.sin(2 * np.pi * np.arange(60) / 60)
    paths = pins[None] + way[:, None, None] * (0, 0, 1)
    return way, small_scene(base_motion=limber.animated_pins(paths), first_end="cyclic", last_end="cyclic",
                            damping_ratio=0.15, **options)


def test_pins_carry_the_body_and_inertia_makes_it_lag(server):
    way, scene = carried_scene()
    with contextlib.closing(server.open(scene, progress=False)) as session:
        session.wait()
        tip = tip_of(session)
        follows = session.frames()[:, tip, 2] - session.geometry().rest[tip, 2]
        assert np.abs(follows - way).max() < 1e-4
        session.dynamics(inertia=1)
        session.wait()
        lags = session.frames()[:, tip, 2] - session.geometry().rest[tip, 2]
        swing = np.fft.rfft(lags)[1] / np.fft.rfft(way)[1]
        assert 1.1 < np.abs(swing) < 1.4, "a slow swing is amplified by about 1 / (1 - (25 / 60)^2)"
        assert -0.5 < np.angle(swing) < -0.02, "and comes later than the pins"
        session.undo()
        session.wait()
        assert np.abs(session.frames()[:, tip, 2] - session.geometry().rest[tip, 2] - way).max() < 1e-4


def test_paths_of_pins_are_edited_live(server, tmp_path):
    way, scene = carried_scene()
    with contextlib.closing(server.open(scene, progress=False)) as session:
        session.wait()
        tip, rest = tip_of(session), session.geometry().rest
        pins = rest[session.settings().fixed_nodes]
        held = session.add(node=tip, frame=30, displacement=(0, 0, 0.1), exact=True)
        session.wait()
        before = session.frames()
        session.move_pins(pins[None] + 2 * way[:, None, None] * (0, 1, 0))
        session.wait()
        frames = session.frames()
        assert np.abs(frames[:, session.settings().fixed_nodes, 1] - pins[None, :, 1] - 2 * way[:, None]).max() < 1e-4
        assert np.abs(frames[30, tip] - rest[tip] - (0, 0, 0.1)).max() < 1e-5
        [path] = [path for path in session.export(tmp_path, formats=("scene",)) if str(path).endswith(".json")]
        session.undo()
        session.wait()
        assert np.abs(session.frames() - before).max() < 1e-5
        with pytest.raises(limber.LimberError, match="frames") as refused:
            session.move_pins(pins[None])
        assert refused.value.field == "edits[0].set_pins.pins.shape[0]"
        session.remove(held)
    with contextlib.closing(server.open(path, progress=False)) as again:
        again.wait()
        assert np.abs(again.frames() - frames).max() < 2e-3


def test_inertia_is_an_option_of_scenes(server, tmp_path):
    _, scene = carried_scene(inertia=1)
    other = limber.scenes.to_message(scene)
    other.dynamics.ClearField("inertia")
    other.base_motion.inertia = 1
    shown = []
    for one in (scene, other):
        with contextlib.closing(server.open(one, progress=False)) as session:
            session.wait()
            shown.append(session.frames())
            assert session.settings().dynamics.inertia == 1
            [path] = [path for path in session.export(tmp_path, formats=("scene",)) if str(path).endswith(".json")]
            assert json.loads(path.read_text())["dynamics"]["inertia"] == 1
    assert np.abs(shown[0] - shown[1]).max() < 1e-6


@pytest.mark.parametrize("options, field", [
    ({"until": 20}, "path[0].frame"),
    ({"path": [(30, None), (25, None)]}, "path[1].frame"),
    ({"until": 70}, "path[0].frame"),
    ({"until": 30, "ease_in": 2}, "ease_in"),
    ({"reach": 0}, "reach"),
    ({"reach": float("inf")}, "reach"),
])
def test_what_is_no_path_is_refused_by_its_field(body, options, field):
    with pytest.raises(limber.LimberError) as caught:
        body.add(node=tip_of(body), frame=20, displacement=(0, 0, 0), **options)
    assert field in str(caught.value.field)


def test_wrong_pins_are_refused(server):
    for paths, text in ((np.zeros((59, 9, 3)), "frames"), (np.zeros((60, 2, 3)), "2"), (np.full((60, 9, 3), np.nan), "finite")):
        scene = small_scene(base_motion=limber.animated_pins(paths))
        with pytest.raises(limber.LimberError, match=text) as caught:
            server.open(scene, progress=False)
        assert "base_motion.pins" in caught.value.field


def test_both_until_and_path_is_an_error():
    with pytest.raises(limber.LimberError, match="one of until and path"):
        limber.add(node=1, frame=2, displacement=(0, 0, 0), until=3, path=[(4, None)])

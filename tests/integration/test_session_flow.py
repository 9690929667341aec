"""One session from opening to closing, through the Python package and a real limberd."""

import math
import threading
import time

import limber
import meshio
import numpy as np
import pytest
from conftest import bar, small_scene, tip_of
from limber.v1 import service_pb2 as service


def test_open_edit_wait_frames(session):
    status = session.status()
    assert (status.nodes, status.tets, status.frames, status.constraints) == (63, 144, 60, 0)
    assert 0 < status.model.error_mean < 0.15
    assert status.model.met_tolerance == (status.model.error_mean <= 0.05), "what it says is so"
    tip = tip_of(session)
    rest = session.geometry().rest
    held = session.add(node=tip, frame=30, displacement=(0, 0, 0.4))
    result = session.wait()
    assert result.converged and result.status == "CONVERGED"
    assert result.revision == session.revision == 1
    assert result.energy == pytest.approx(result.force_energy + result.constraint_energy, rel=1e-12)
    motion = session.frames()
    assert motion.shape == (60, 63, 3) and np.isfinite(motion).all()
    error = np.abs(motion[30, tip] - rest[tip] - (0, 0, 0.4)).max()
    assert error == pytest.approx(result.max_error, abs=3e-4)
    assert error < 0.1, "the soft constraint pulls the tip most of the distance"
    np.testing.assert_allclose(motion[0], rest, atol=1e-4)   # both ends are pinned in position and velocity
    np.testing.assert_allclose(motion[1], rest, atol=1e-4)
    np.testing.assert_allclose(motion[-1], rest, atol=1e-4)
    held.remove()
    assert session.wait().energy == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(session.frames(), np.broadcast_to(rest, motion.shape), atol=1e-4)


def test_exact_constraint_is_met(session):
    tip = tip_of(session)
    rest = session.geometry().rest[tip]
    session.add(node=tip, frame=25, position=rest + (0, 0.3, 0), exact=True)
    result = session.wait()
    assert result.max_error < 1e-6
    np.testing.assert_allclose(session.frames(25, 1)[0, tip], rest + (0, 0.3, 0), atol=1e-5)


def test_the_error_of_exact_constraints_is_reported_separately(session):
    tip = tip_of(session)
    session.add(node=tip, frame=25, displacement=(0, 0.3, 0), exact=True)
    session.add(node=tip, frame=28, displacement=(0, -0.3, 0), weight=1)
    result = session.wait()
    assert result.max_exact_error < 1e-6 < 1e-3 < result.max_error
    assert not result.solve_failed


def test_what_has_no_effect_is_reported(session):
    fixed = int(session.scene().fixed_nodes[0])
    assert session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.1)).issues == ()
    on_fixed = session.add(node=fixed, frame=30, displacement=(0, 0, 0.1))
    assert len(on_fixed.issues) == 1
    assert on_fixed.issues[0].startswith("warning: edits[0].add.constraint.nodes: ")
    receipt = session.edit([limber.add(node=tip_of(session), frame=59, displacement=(0, 0, 0.1))])
    assert [issue.split(": ")[1] for issue in receipt.issues] == ["edits[0].add.constraint.frame"]
    assert on_fixed.replace(node=tip_of(session), frame=20, displacement=(0, 0, 0.1)).issues == () == on_fixed.issues


def test_partial_axes_leave_the_others_free(session):
    tip = tip_of(session)
    session.add(node=tip, frame=25, displacement=(9, 9, 0.3), axes="z", exact=True)
    result = session.wait()
    assert result.max_error < 1e-6
    moved = session.frames(25, 1)[0, tip] - session.geometry().rest[tip]
    assert moved[2] == pytest.approx(0.3, abs=1e-5) and abs(moved[0]) < 1 and abs(moved[1]) < 1


def test_encodings_agree_and_coordinates_are_given_as_such(session):
    session.add(node=tip_of(session), frame=30, displacement=(0, 0, 0.4))
    session.wait()
    by_coordinates = session.frames(final=True)
    by_positions = session.frames(final=True, encoding="positions")
    np.testing.assert_allclose(by_coordinates, by_positions, atol=1e-4)
    raw = session.raw_frames(final=True, encoding="quantised")
    assert 0 < raw.quantisation_error < 1e-3
    assert np.abs(session.frames(final=True, encoding="quantised") - by_positions).max() <= 1.01 * raw.quantisation_error
    coordinates = session.frames(final=True, encoding="coordinates")
    assert coordinates.shape == (len(by_positions), session.geometry().basis.shape[2])
    np.testing.assert_array_equal(session.geometry().positions(coordinates), by_coordinates)
    # A product of other width may add in another order: the last bit of a float is free.
    np.testing.assert_allclose(session.frames(10, 5, encoding="positions"), by_positions[10:15], rtol=2e-7, atol=1e-9)


def test_batch_is_one_revision_and_all_or_nothing(session):
    tip = tip_of(session)
    receipt = session.edit([limber.add(node=tip, frame=20, displacement=(0, 0, 0.2)),
                            limber.add(node=tip, frame=40, displacement=(0, 0, -0.2))])
    assert receipt.revision == 1 and len(set(receipt.constraint_ids)) == 2 and 0 not in receipt.constraint_ids
    with pytest.raises(limber.LimberError) as caught:
        session.edit([limber.move(receipt.constraint_ids[0], (0, 0, 1)), limber.remove(987654)])
    assert caught.value.code == "NOT_FOUND" and caught.value.field.startswith("edits[1]")
    assert [c.target for c in session.constraints()] == [(0, 0, 0.2), (0, 0, -0.2)]
    assert session.status().revision == 1


def test_undo_redo_restore_the_solution(session):
    tip = tip_of(session)
    session.add(node=tip, frame=20, displacement=(0, 0.2, 0))
    before = session.wait()
    session.add(node=tip, frame=40, displacement=(0, 0, 0.3))
    after = session.wait()
    session.undo()
    assert session.wait().energy == pytest.approx(before.energy, rel=1e-6)
    session.redo()
    assert session.wait().energy == pytest.approx(after.energy, rel=1e-6)
    assert session.revision == 4 and len(session.constraints()) == 2
    with pytest.raises(limber.LimberError) as caught:
        session.redo()
    assert caught.value.code == "FAILED_PRECONDITION"


def test_ends_and_optimistic_locking(session):
    tip = tip_of(session)
    session.add(node=tip, frame=59, displacement=(0, 0, 0.3))
    pinned = session.wait().energy
    session.ends("position_velocity", "free")
    assert session.wait().energy < 0.5 * pinned
    with pytest.raises(limber.LimberError) as caught:
        session.edit([limber.undo()], expected_revision=1)
    assert caught.value.code == "FAILED_PRECONDITION"
    assert session.edit([limber.undo()], expected_revision=2).revision == 3


def test_dynamics_keep_what_is_not_given(server, session):
    assert session.dynamics(period_frames=33).revision == 1
    session.dynamics(damping_ratio=0.125)
    receipt = session.edit([limber.dynamics(frames_per_second=24), limber.ends("free", "free")])
    assert receipt.revision == 3
    now = session.scene().dynamics
    assert (now.frames_per_second, now.period_frames, now.damping_ratio) == (24, 33, 0.125)
    with pytest.raises(limber.LimberError) as caught:
        session.edit([limber.dynamics(period_frames=40)], expected_revision=1)
    assert caught.value.code == "FAILED_PRECONDITION"
    with limber.connect(server.connection.endpoint) as other:  # two clients, each of which changes one number
        mine, its = session, other.session(session.id)
        threads = [threading.Thread(target=lambda: [mine.dynamics(period_frames=30 + i) for i in range(20)]),
                   threading.Thread(target=lambda: [its.dynamics(damping_ratio=i / 100) for i in range(20)])]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(30)
    now = session.scene().dynamics
    assert (now.frames_per_second, now.period_frames, now.damping_ratio) == (24, 49, 0.19)


def test_arguments_of_the_wrong_type_are_refused_by_name(server, session):
    for field, call in (("edits", lambda: session.edit(3)), ("edits", lambda: session.edit("undo")),
                        ("expected_revision", lambda: session.edit([limber.undo()], expected_revision="1")),
                        ("revision", lambda: session.wait(revision=1.5)), ("until", lambda: session.wait(until=["final"])),
                        ("timeout", lambda: session.wait(timeout="5")), ("first_frame", lambda: session.frames(-1)),
                        ("first_frame", lambda: session.frames(1.5)), ("frame_count", lambda: session.frames(0, "2")),
                        ("encoding", lambda: session.frames(encoding=3)), ("final", lambda: session.frames(final="yes")),
                        ("formats", lambda: session.export("out", formats=[3])),
                        ("stem", lambda: session.export("out", stem=3)), ("encoding", lambda: session.stream(encoding=None)),
                        ("timeout", lambda: session.stream(timeout="1")), ("session", lambda: server.session(3)),
                        ("session", lambda: server.open(small_scene(), session=3)), ("name", lambda: server.sample(3)),
                        ("job", lambda: server.wait_job("1")), ("job", lambda: server.cancel_job(1.5)),
                        ("folder", lambda: session.export(5)), ("timeout", lambda: session.stream(timeout=math.nan)),
                        ("timeout", lambda: server.open(small_scene(), timeout=math.nan)),
                        ("timeout", lambda: session.wait(timeout=math.inf)), ("surface", lambda: server.tetrahedralize(5)),
                        ("scene", lambda: server.open(3)), ("scene", lambda: server.validate(None))):
        with pytest.raises(limber.LimberError) as caught:
            call()
        assert (caught.value.code, caught.value.field) == ("INVALID_ARGUMENT", field)
    assert session.status().revision == 0, "nothing was sent"


def test_move_changes_kind_on_request(session):
    tip = tip_of(session)
    rest = session.geometry().rest[tip]
    held = session.add(node=tip, frame=30, displacement=(0, 0, 0.2), weight=50)
    by_displacement = session.wait().energy
    held.move(position=rest + (0, 0, 0.2))
    assert held.kind == "position" and session.constraints()[0].message == held.message
    assert session.wait().energy == pytest.approx(by_displacement, rel=1e-4)
    assert session.constraints()[0].message.weight == 50


def test_cold_solve_agrees_with_the_warm_one(server, session):
    tip = tip_of(session)
    for frame in (15, 30, 45):
        session.add(node=tip, frame=frame, displacement=(0, 0.1, 0.2))
    warm = session.wait()
    server.wait_job(session.solve_cold(), progress=False)
    assert session.wait().energy == pytest.approx(warm.energy, rel=1e-6)


def test_a_cancelled_cold_solve_replaces_nothing(server):
    session = server.open(sample="flower", progress=False)
    solved, motion = session.wait(), session.frames()
    cancelled = 0
    for attempt in range(40):   # a solve takes a few milliseconds: often it is done before cancel() is heard
        if cancelled > 0 and attempt >= 6:
            break
        job = session.solve_cold()
        session.cancel()
        try:
            server.wait_job(job, progress=False)   # it may have been quicker
        except limber.LimberError as error:
            assert error.code == "CANCELLED"
            cancelled += 1
        # The job is over as soon as cancel() is heard; the solve may still show its first frames.
        deadline = time.monotonic() + 20
        newest = limber.Result.from_message(session.status().result)
        calm_since = time.monotonic()
        while not (newest.final and time.monotonic() > calm_since + 0.3) and time.monotonic() < deadline:
            time.sleep(0.02)
            before, newest = newest, limber.Result.from_message(session.status().result)
            if newest.sequence != before.sequence:
                calm_since = time.monotonic()
        assert newest.converged and newest.status == "CONVERGED"
        assert newest.energy == pytest.approx(solved.energy, rel=1e-6)
    assert cancelled > 0
    np.testing.assert_allclose(session.frames(), motion, atol=1e-4)
    session.close()


def test_stream_shows_every_edit_and_ends_with_the_session(server):
    session = server.open(small_scene(), progress=False)
    tip = tip_of(session)
    with session.stream(timeout=20) as stream:
        revisions = []
        for step in range(3):
            session.add(node=tip, frame=20 + step, displacement=(0, 0, 0.1))
            while True:
                frames = stream.next(20)
                if frames.result.revision == session.revision and frames.result.final:
                    break
            revisions.append(frames.result.revision)
        np.testing.assert_allclose(frames.positions, session.frames(), atol=1e-6)
        assert revisions == [1, 2, 3]
        session.close()
        for frames in stream:
            assert frames.result.revision == 3  # what was still in transit


@pytest.mark.timeout(120)
def test_an_unread_stream_holds_few_messages(server):
    """Motions of megabytes: what waits here is this process's memory."""
    session = server.open(sample="flower", progress=False)
    tip = tip_of(session)
    held = session.add(node=tip, frame=100, displacement=(0, 0, 0.1))
    with session.stream(encoding="positions", snapshot=False) as stream:
        for step in range(60):
            held.move((0, 0, 0.1 + 0.001 * step))
            session.wait()
            time.sleep(0.02)  # until it is encoded: what comes meanwhile would be skipped
        time.sleep(0.5)
        unread = []
        while len(unread) < 100:
            try:
                unread.append(stream.next(1.0))
            except limber.LimberError as error:
                assert error.code == "TIMEOUT"
                break
        assert len(unread[0].raw.data.data) > 1 << 20, "larger than what the kernel keeps"
        assert len(unread) == 8
        assert unread[-1].result.revision == session.revision, "who pauses finds the newest motion"
        assert stream.missed == sum(frames.missed for frames in unread) > 20
    session.close()


def test_exports(session, tmp_path):
    tip = tip_of(session)
    session.add(node=tip, frame=30, displacement=(0, 0, 0.4))
    session.wait()
    motion, geometry = session.frames(), session.geometry()
    calls = []
    files = session.export(tmp_path, formats=("pvd", "pc2", "scene"), stem="bar",
                           progress=lambda stage, fraction: calls.append((stage, fraction)))
    assert {stage for stage, _ in calls} == {"exporting pvd", "exporting pc2", "exporting scene"}
    assert all(0 < fraction <= 1 for _, fraction in calls) and all(file.is_file() for file in files)
    frames = sorted(file for file in files if file.suffix == ".vtu" and file.parent != tmp_path) \
        or sorted(tmp_path.glob("bar*.vtu"))
    frames = [file for file in frames if "mesh" not in file.name]
    collection = (tmp_path / "bar.pvd").read_text()
    assert len(frames) >= 60 and collection.count("<DataSet") == 60
    named = [part.split('"')[0] for part in collection.split('file="')[1:]]
    mesh = meshio.read(tmp_path / named[30])
    points = mesh.points.copy()
    displaced = next((np.asarray(d) for n, d in mesh.point_data.items() if "displacement" in n.lower()), None)
    if displaced is not None and np.allclose(points, geometry.rest, atol=1e-6):
        points += displaced
    np.testing.assert_allclose(points, motion[30], atol=1e-4)
    np.testing.assert_array_equal(np.sort(mesh.cells_dict["tetra"]), np.sort(geometry.tets))

    cache = (tmp_path / "bar.pc2").read_bytes()
    assert cache[:12] == b"POINTCACHE2\0"
    version, points = np.frombuffer(cache, "<i4", 2, 12)
    first, rate = np.frombuffer(cache, "<f4", 2, 20)
    samples = np.frombuffer(cache, "<i4", 1, 28)[0]
    surface = meshio.read(tmp_path / "bar.obj")
    assert (version, points, samples) == (1, len(surface.points), 60) and rate > 0
    values = np.frombuffer(cache, "<f4", -1, 32).reshape(samples, points, 3)
    assert len(cache) == 32 + values.nbytes
    # The surface's vertices are nodes of the mesh: at rest (frame 0) and in every frame they are where those are.
    nearest = np.linalg.norm(surface.points[:, None] - geometry.rest[None], axis=2).argmin(axis=1)
    np.testing.assert_allclose(values[30], motion[30][nearest], atol=1e-4)

    scene = limber.load_scene(next(file for file in files if file.suffix == ".json"))
    reopened = session.server.open(scene, progress=False)
    assert reopened.wait().energy == pytest.approx(session.wait().energy, rel=1e-5)
    reopened.close()


def test_mesh_of_meshio_and_of_a_file(server, tmp_path):
    nodes, tets = bar()
    mesh = meshio.Mesh(nodes, [("tetra", tets)])
    meshio.write(tmp_path / "bar.vtk", mesh)
    held = list(range(9))
    options = {"frames": 40, "fixed_nodes": held, "modes": 6, "tolerance": 0.03}
    sizes = []
    for scene in (limber.scene_from_mesh(mesh, **options), limber.scene_from_mesh(tmp_path / "bar.vtk", **options)):
        session = server.open(scene, progress=False)
        sizes.append((session.status().nodes, session.status().tets))
        np.testing.assert_allclose(session.geometry().rest, nodes, atol=1e-6)
        session.close()
    assert sizes == [(63, 144)] * 2


def test_progress_is_reported_and_bad_scenes_are_refused(server, tmp_path):
    calls = []
    scene = small_scene(modes=9)
    session = server.open(scene, progress=lambda stage, fraction: calls.append(fraction))
    assert calls and calls[-1] == 1.0 and all(0 <= fraction <= 1 for fraction in calls)
    session.close()
    scene.fixed_nodes.append(10 ** 6)
    issues = server.validate(scene)
    assert any(issue.startswith("error") and "fixed_nodes" in issue for issue in issues)
    with pytest.raises(limber.LimberError) as caught:
        server.open(scene)
    assert caught.value.code in ("OUT_OF_RANGE", "INVALID_ARGUMENT") and "fixed_nodes" in caught.value.field


@pytest.mark.timeout(120)
def test_all_parts_of_an_export_are_of_one_result(server):
    """The flower's frames take several parts; an edit between two of them does not mix motions."""
    session = server.open(sample="flower", progress=False)
    request = service.ExportRequest(session=session.id, format=service.EXPORT_FORMAT_PVD)
    first = session.connection.call("export", request, timeout=60)
    assert first.part_count > 1
    session.add(node=tip_of(session), frame=200, displacement=(0.2, 0, 0))
    assert session.wait().revision == 1
    request.part, request.result_sequence = 1, first.result.sequence
    second = session.connection.call("export", request, timeout=60)
    assert second.result == first.result and second.result.revision == 0
    session.close()


def test_a_wait_that_runs_out_of_time_names_session_revision_and_state(server):
    session = server.open(small_scene(), session="late", progress=False)
    session.wait(until="checked")  # nothing follows
    with pytest.raises(TimeoutError, match=r"^session late: no final result of revision 99 within 0\.2 s; it is at revision 0, ready; its newest "
                                           r"result is of revision 0, final \(field timeout_s\)") as caught:
        session.wait(revision=99, timeout=0.2)
    assert caught.value.code == "TIMEOUT" and isinstance(caught.value, limber.LimberError)
    with session.stream(snapshot=False) as stream:
        stream.next(5)  # what there is
        with pytest.raises(TimeoutError, match="^session late: no frames within 0.3 s; it is at"):
            stream.next(0.3)
    session.close()

"""Long motions in parts, by a real limberd whose session goes on being edited."""

import threading

import limber
import numpy as np
import pytest
from conftest import small_scene, tip_of
from limber import arrays

FRAMES = 6000  # 63 nodes: 4.5 MB of positions


@pytest.mark.timeout(120)
def test_all_parts_are_of_one_result_while_somebody_drags(server, monkeypatch):
    session = server.open(small_scene(frames=FRAMES), progress=False)
    session.wait()
    held = session.add(node=tip_of(session), frame=300, displacement=(0, 0.05, 0))
    session.wait()
    answers = []
    call = server.connection.call

    def noting(kind, *rest, **more):
        answer = call(kind, *rest, **more)
        if kind == "get_frames":
            answers.append(answer)
        return answer

    monkeypatch.setattr(server.connection, "call", noting)
    stop = threading.Event()

    def drag():
        with limber.connect(server.connection.endpoint) as other:
            same = other.session(session.id)
            for step in range(10_000):
                if stop.is_set():
                    return
                same.move(held.id, (0, 0.05 + 1e-4 * (step % 500), 0))

    dragging = threading.Thread(target=drag)
    dragging.start()
    try:
        seen = set()
        while len(seen) < 4:
            answers.clear()
            frames = session.raw_frames(encoding="positions")
            assert frames.frame_count == FRAMES and arrays.to_numpy(frames.data, "frames").shape == (FRAMES, 63, 3)
            assert len(answers) > 2 and {one.frames.result.sequence for one in answers} == {frames.result.sequence}
            assert [one.frames_left > 0 for one in answers] == [True] * (len(answers) - 1) + [False]
            seen.add(frames.result.sequence)
    finally:
        stop.set()
        dragging.join()
    session.wait(revision=session.status().revision, until="checked")  # no other result follows
    whole, quantised = session.frames(encoding="positions"), session.frames(encoding="quantised")
    assert np.abs(whole - quantised).max() < 1e-3
    assert np.abs(whole - session.frames()).max() < 1e-4
    assert np.abs(whole[2500:2600] - session.frames(2500, 100, encoding="positions")).max() < 1e-5

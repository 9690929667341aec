"""What one client has built leaves others room to open."""

import os
import time

import limber
from conftest import small_scene
from limber.messages import service

BUILDING = service.SESSION_STATE_BUILDING


def test_long_builds_of_one_client_leave_threads_to_others(launch):
    server = launch("--max-jobs", "1")
    threads = 1 + max(2, os.cpu_count())
    with limber.connect(server.connection.endpoint, name="many") as many:
        scene = many.sample("dino")
        del scene.constraints[:]
        for number in range(threads + 1):
            scene.material.poissons_ratio = 0.401 + 0.001 * number  # no model is in the cache
            many.open(scene, session=f"long{number}", wait=False)
        time.sleep(0.5)
        begin = time.monotonic()
        with limber.connect(server.connection.endpoint, name="one") as one:
            assert one.open(small_scene(), progress=False).wait(timeout=30).converged
        states = [status.state for status in server.sessions() if status.session.startswith("long")]
        assert states.count(BUILDING) >= threads, f"they are long: it took {time.monotonic() - begin:.1f} s"
        for number in range(threads + 1):
            many.session(f"long{number}").close()

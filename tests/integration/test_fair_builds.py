"""What one client has built leaves others room to open."""

import os
import time

import limber
import numpy as np
from conftest import small_scene
from design_inputs import strip_scene, until
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


def test_eight_paused_designs_of_one_client_keep_nobody_from_opening(launch):
    """They take no thread, and a place of --max-jobs each (8 by default) that openings do not need."""
    server = launch()
    with limber.connect(server.connection.endpoint, name="many") as many:
        for number in range(8):
            linkage = many.open(strip_scene(), session=f"design{number}", progress=False)
            linkage.wait()
            joints = np.array(linkage.shape().joints)
            targets = joints + np.random.default_rng(number).uniform(-3, 3, joints.shape)  # [mm], not to be reached
            design = linkage.design(targets=targets, distance_weight=1e6, flat_height=0.3, max_iterations=100000)
            design.pause()
            until(lambda paused=design: paused.info().state == "paused")
        with limber.connect(server.connection.endpoint, name="one") as one:
            assert one.open(small_scene(), progress=False).wait(timeout=30).converged
            assert one.open(strip_scene(), progress=False).wait(timeout=30).converged
        assert len([job for job in server.jobs() if job.kind == "design"]) == 8, "all are still there"

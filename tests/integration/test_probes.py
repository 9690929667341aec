"""/healthz, /readyz and /metrics of `limberd --web`, and GetServerInfo's status, which metrics are made of."""

import resource

import exposition
import limber
import pytest
from conftest import small_scene
from pages import ask, ready_file

WEB = ("--web", "127.0.0.1:0")


def address_of(server):
    return ready_file(server)["web"].removeprefix("http://")


def metrics_of(server):
    status, fields, body = ask(address_of(server), "/metrics")
    assert status == 200 and fields["content-type"] == "text/plain; version=0.0.4; charset=utf-8"
    return exposition.read(body.decode())


def status_of(server):
    return server.info(status=True).status


@pytest.fixture
def server(launch):
    return launch(*WEB)


def test_probes_answer_without_a_token_and_only_to_names_of_the_server(server):
    address = address_of(server)
    for path, words in ("/healthz", b"ok\n"), ("/readyz", b"ready\n"):
        status, fields, body = ask(address, path)
        assert (status, body) == (200, words) and fields["cache-control"] == "no-store"
    for path in "/healthz", "/readyz", "/metrics":
        assert ask(address, path, "HEAD")[0] == 200
        assert ask(address, path, "POST")[0] == 405
        assert ask(address, path, Host="evil.example")[0] == 403
        assert ask(address, path + "/more")[0] == 404


def test_metrics_are_in_the_text_format_and_count(server):
    samples, types = metrics_of(server)
    assert samples["limber_ready", ()] == 1 and samples["limber_faults", ()] == 0
    assert samples["limber_build_info", (("version", server.info().server_version),)] == 1
    assert not [name for name, _ in samples if name == "limber_sessions"]
    assert samples["limber_edit_acknowledgement_seconds_count", ()] == 0
    assert samples["process_resident_memory_bytes", ()] > 1e6 and samples["process_open_fds", ()] > 5
    assert types["limber_edit_acknowledgement_seconds"] == "histogram"
    assert not [name for name in types if name.startswith("limber_store")], "there is no store"

    session = server.open(small_scene(), session="a-secret-name")
    for step in range(5):
        session.add(node=0, frame=5, displacement=(0, 0.01 * step, 0))
    session.wait()
    later, _ = metrics_of(server)
    assert later["limber_sessions", (("kind", "bodies"), ("state", "ready"))] == 1
    assert later["limber_session_clients", ()] == 1
    assert later["limber_edit_acknowledgement_seconds_count", ()] == 5
    assert 0 < later["limber_edit_acknowledgement_seconds_sum", ()] < 60
    for counted in "limber_requests_total", "limber_replies_total", "process_cpu_seconds_total":
        assert later[counted, ()] > samples[counted, ()]
    assert "a-secret-name" not in ask(address_of(server), "/metrics")[2].decode()


def test_a_store_has_metrics_and_its_fault_is_why_the_server_is_not_ready(launch, tmp_path):
    """Files of the server may not grow any more: a full disk."""
    server = launch(*WEB, "--data", str(tmp_path / "data"))
    session = server.open(small_scene(), session="s")
    session.wait()
    samples, _ = metrics_of(server)
    assert samples["limber_store_transactions_total", ()] > 0 and samples["limber_store_fault", ()] == 0
    assert samples["limber_store_synced_transactions_total", ()] > 0 and samples["limber_store_bytes", ()] > 0
    assert samples["limber_store_syncs_total", ()] >= samples["limber_store_synced_transactions_total", ()]
    assert samples["limber_store_sync_seconds_total", ()] > 0
    size = server.info().store.bytes
    resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
    with pytest.raises(limber.LimberError, match="stored"):
        for _ in range(500):
            session.add(node=0, frame=5, displacement=(0, 0.01, 0))
    status, _, body = ask(address_of(server), "/readyz")
    assert status == 503 and b"nothing can be stored now: " in body
    assert ask(address_of(server), "/healthz")[0] == 200
    samples, _ = metrics_of(server)
    assert samples["limber_ready", ()] == 0 and samples["limber_store_fault", ()] == 1
    assert status_of(server).faults[0].startswith("nothing can be stored now: ")
    resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def test_the_status_is_told_where_it_is_asked_for(server):
    assert not server.info().HasField("status")
    session = server.open(small_scene(), session="s")
    session.add(node=0, frame=5, displacement=(0, 0.01, 0))
    session.wait()
    status = status_of(server)
    assert status.phase == status.PHASE_READY and not status.not_ready and not status.faults
    use, = status.sessions
    assert (use.session, use.kind, use.state, use.edits, use.people) == ("s", "bodies", "ready", 1, 1)
    assert use.uid == session.uid and use.solves >= 1
    assert 0 < use.newest_solve_s <= use.longest_solve_s < 60
    latencies = status.acknowledgements
    assert len(latencies.counts) == len(latencies.bounds_s) + 1 and sum(latencies.counts) == 1
    assert latencies.longest_s == latencies.sum_s > 0
    assert status.process.resident_bytes > 1e6 and status.process.threads > 3


def test_a_store_that_outlives_the_process_alone_syncs_no_transaction(launch, tmp_path):
    server = launch(*WEB, "--data", str(tmp_path / "data"), "--data-outlives", "process")
    session = server.open(small_scene(), session="s")
    before, _ = metrics_of(server)
    for _ in range(5):
        session.add(node=0, frame=5, displacement=(0, 0.01, 0))
    after, _ = metrics_of(server)
    assert after["limber_store_transactions_total", ()] >= before["limber_store_transactions_total", ()] + 5
    assert after["limber_store_synced_transactions_total", ()] == 0
    assert after["limber_store_syncs_total", ()] == before["limber_store_syncs_total", ()]

"""Requests and replies against a fake limberd."""

import concurrent.futures
import threading
import time

import limber
import pytest
from limber.connection import Connection
from limber.v1 import common_pb2 as common
from limber.v1 import service_pb2 as service

pytestmark = pytest.mark.timeout(30)


def test_connect_reads_the_stream_endpoint(fake):
    with limber.connect(fake.requests) as server:
        assert server.stream_endpoint == fake.stream


def test_nobody_there(tmp_path):
    start = time.monotonic()
    with pytest.raises(limber.ServerUnreachable) as caught:
        limber.connect(f"ipc://{tmp_path}/nobody", timeout=0.2)
    assert caught.value.code == "TIMEOUT" and "limber start" in str(caught.value)
    assert time.monotonic() - start < 2
    start = time.monotonic()
    with pytest.raises(limber.ServerUnreachable):
        limber.connect(f"ipc://{tmp_path}/nobody")
    assert time.monotonic() - start < 4, "long answers may take their time, the first one not"


def test_malformed_endpoint():
    with pytest.raises(limber.LimberError, match="look like tcp://HOST:PORT") as caught:
        limber.connect("no endpoint")
    assert caught.value.code == "INVALID_ARGUMENT" and caught.value.field == "endpoint"


def test_a_wait_notices_that_the_server_is_gone(fake, monkeypatch):
    monkeypatch.setattr(limber.connection, "SILENCE", 0.2)
    monkeypatch.setattr(limber.connection, "PATIENCE", 0.2)
    fake.handlers["get_session"] = lambda request: service.GetSessionResponse()
    with limber.connect(fake.requests) as server:
        session = server.session("a")
        fake.handlers.pop("wait", None)  # what is waited for takes its time
        threading.Timer(1, lambda: fake.handlers.pop("get_server_info")).start()
        start = time.monotonic()
        with pytest.raises(limber.ServerUnreachable):
            session.wait(timeout=60)
        assert 1 < time.monotonic() - start < 4


def test_a_stopped_server_is_unreachable(fake):
    fake.handlers["list_jobs"] = lambda request: service.Reply(
        id=request.id, error=common.Error(code=common.ERROR_CODE_SHUTTING_DOWN, message="the server is going down"))
    with limber.connect(fake.requests) as server:
        with pytest.raises(limber.ServerUnreachable, match="going down") as caught:
            server.jobs()
    assert isinstance(caught.value, limber.ServerStopped) and caught.value.code == "SHUTTING_DOWN"


@pytest.mark.parametrize("says_again, outcome", [(True, "answered"), (False, "SHUTTING_DOWN")])
def test_what_a_server_refuses_at_its_end_is_sent_again_where_it_says_so(fake, says_again, outcome):
    asked = []

    def ending(request):
        asked.append(request.id)
        if len(asked) > 1:
            return service.GetSessionResponse()
        return service.Reply(id=request.id, error=common.Error(
            code=common.ERROR_CODE_SHUTTING_DOWN, message="the server is going down",
            details={"send_again": "true"} if says_again else {}))

    with limber.connect(fake.requests, timeout=2) as server:
        fake.handlers["get_session"] = ending
        try:
            server.connection.call("get_session", service.GetSessionRequest(session="a"))
            assert outcome == "answered"
        except limber.ServerStopped as error:
            assert error.code == outcome
    assert len(set(asked)) == 1, "under the same id, which is done once"


def test_a_job_ends_with_its_server(fake):
    fake.handlers["get_job"] = lambda request: service.Reply(id=request.id, error=common.Error(
        code=common.ERROR_CODE_SHUTTING_DOWN, message="the server is going down", details={"send_again": "true"}))
    with limber.connect(fake.requests) as server, pytest.raises(limber.ServerStopped):
        begin = time.monotonic()
        server.wait_job(1)
    assert time.monotonic() - begin < 2


def test_other_protocol_version_is_named(fake):
    fake.versions = [2, 3]
    with pytest.raises(limber.LimberError, match="speaks protocol 2, 3") as caught:
        limber.connect(fake.requests)
    assert caught.value.code == "UNSUPPORTED"


@pytest.mark.parametrize("versions, side", [([2, 3], "client"), ([0], "server")])
def test_the_side_that_is_older_is_named(fake, versions, side):
    fake.versions = versions
    with pytest.raises(limber.LimberError, match=f"this client .{limber.__version__}. protocol 1: update the {side}"):
        limber.connect(fake.requests)


def test_the_version_is_told_where_the_server_knows_of_it(fake):
    """A server of before refuses the field, and is asked again without it."""
    told = []

    def older(request):
        told.append(request.get_server_info.client_version)
        if told[-1]:
            return service.Reply(version=1, id=request.id, error=common.Error(
                code=common.ERROR_CODE_INVALID_ARGUMENT, message="unknown field number 1 in GetServerInfoRequest"))
        return fake.info(request)

    fake.handlers["get_server_info"] = older
    with limber.connect(fake.requests):
        assert told == [limber.__version__, ""]


def test_what_a_newer_server_answers_is_no_answer_of_another_kind(fake):
    fake.handlers["list_jobs"] = lambda request: service.Reply(version=1, id=request.id)
    with limber.connect(fake.requests) as server:
        with pytest.raises(limber.LimberError, match="of a kind that this client .* does not know") as caught:
            server.jobs()
    assert caught.value.code == "MALFORMED"


def test_a_server_of_another_protocol_says_which_side_is_older(fake):
    """It answers no request at all, the greeting neither; its words are passed on."""
    fake.handlers["get_server_info"] = lambda request: service.Reply(version=2, id=request.id, error=common.Error(
        code=common.ERROR_CODE_UNSUPPORTED, field="version",
        message="this client speaks protocol 1, this server (2.0) protocol 2: update the client"))
    with pytest.raises(limber.LimberError, match="update the client") as caught:
        limber.connect(fake.requests)
    assert caught.value.code == "UNSUPPORTED"


def test_refusal_becomes_an_exception_with_code_and_field(fake):
    fake.handlers["edit"] = lambda request: service.Reply(version=1, id=request.id, error=common.Error(
        code=common.ERROR_CODE_OUT_OF_RANGE, message="frame 900 of 120", field="edits[0].add.constraint.frame",
        details={"limit": "120"}))
    fake.handlers["get_session"] = lambda request: service.GetSessionResponse()
    with limber.connect(fake.requests) as server:
        with pytest.raises(limber.LimberError) as caught:
            server.session("a").add(node=1, frame=900, position=(0, 0, 0))
    assert caught.value.code == "OUT_OF_RANGE"
    assert caught.value.field == "edits[0].add.constraint.frame"
    assert caught.value.details == {"limit": "120"}
    assert str(caught.value) == "frame 900 of 120 (field edits[0].add.constraint.frame) [OUT_OF_RANGE]"


def test_an_unknown_error_code_is_still_an_error(fake):
    fake.handlers["list_jobs"] = lambda request: service.Reply(id=request.id, error=common.Error(code=99, message="new"))
    with limber.connect(fake.requests) as server, pytest.raises(limber.LimberError) as caught:
        server.jobs()
    assert caught.value.code == "99"


def test_a_request_is_sent_twice_under_one_id_a_shutdown_once(fake):
    fake.handlers["list_sessions"] = lambda request: None if fake.seen.count("list_sessions") == 1 \
        else service.ListSessionsResponse()
    connection = Connection(fake.requests, timeout=0.3)
    assert connection.call("list_sessions", service.ListSessionsRequest()) is not None
    assert fake.seen.count("list_sessions") == 2
    edits = []
    fake.handlers["edit"] = lambda request: edits.append(request.SerializeToString())
    with pytest.raises(limber.ServerUnreachable):
        connection.call("edit", service.EditRequest())
    assert len(edits) == 2 and edits[0] == edits[1]
    assert service.Request.FromString(edits[0]).client == connection.client and len(connection.client) == 32
    with pytest.raises(limber.ServerUnreachable):
        connection.call("shutdown", service.ShutdownRequest())
    time.sleep(0.2)
    assert fake.seen.count("shutdown") == 1
    connection.close()


def test_a_timeout_is_the_whole_time_of_a_request(fake):
    connection = Connection(fake.requests, timeout=1.0)
    start = time.monotonic()
    with pytest.raises(limber.ServerUnreachable, match="within 1 s"):
        connection.call("list_sessions", service.ListSessionsRequest())
    assert 0.95 < time.monotonic() - start < 1.7
    assert fake.seen.count("list_sessions") == 2
    connection.close()


def test_a_slow_answer_counts_though_the_request_was_repeated(fake):
    fake.handlers["list_jobs"] = lambda request: time.sleep(0.7) or service.ListJobsResponse(
        jobs=[service.JobStatus(job=fake.seen.count("list_jobs"))])
    with limber.connect(fake.requests, timeout=1.0) as server:
        assert [job.job for job in server.jobs()] == [1]


def test_garbage_and_replies_to_nobody_are_skipped(fake):
    fake.handlers["list_jobs"] = lambda request: [
        b"\xff\xff garbage", service.Reply(id=request.id + 1000, list_jobs=service.ListJobsResponse()),
        service.ListJobsResponse(jobs=[service.JobStatus(job=7)])]
    with limber.connect(fake.requests) as server:
        assert [job.job for job in server.jobs()] == [7]


def test_an_answer_of_the_wrong_kind_is_refused(fake):
    fake.handlers["list_jobs"] = lambda request: service.Reply(id=request.id, shutdown=service.ShutdownResponse())
    with limber.connect(fake.requests) as server, pytest.raises(limber.LimberError) as caught:
        server.jobs()
    assert caught.value.code == "MALFORMED"


def test_answers_out_of_order_reach_their_threads(fake):
    held = []

    def hold(request):
        held.append(request)
        if len(held) < 5:
            return None
        return [service.Reply(id=r.id, get_session=service.GetSessionResponse(
            status=service.SessionStatus(session=r.get_session.session))) for r in reversed(held)]

    fake.handlers["get_session"] = hold
    connection = Connection(fake.requests, timeout=10)
    names = [f"s{i}" for i in range(5)]
    with concurrent.futures.ThreadPoolExecutor(5) as pool:
        answers = list(pool.map(lambda name: connection.call(
            "get_session", service.GetSessionRequest(session=name)).status.session, names))
    assert answers == names
    connection.close()


def test_closing_ends_requests_in_flight(fake):
    connection = Connection(fake.requests, timeout=20)
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        call = pool.submit(connection.call, "edit", service.EditRequest())
        while "edit" not in fake.seen:
            time.sleep(0.01)
        connection.close()
        with pytest.raises(limber.LimberError) as caught:
            call.result(5)
    assert caught.value.code == "CANCELLED"
    with pytest.raises(limber.LimberError, match="closed"):
        connection.call("edit", service.EditRequest())


def test_a_secret_key_is_not_taken_for_a_public_one(tmp_path):
    from limber.connection import public_key
    secret = tmp_path / "own.key"
    secret.write_text("x" * 40 + "\n")
    secret.chmod(0o600)
    with pytest.raises(limber.LimberError, match="may hold a secret key"):
        public_key(secret, "key")
    (tmp_path / "own.key.pub").write_text("p" * 40 + "\n")
    assert public_key(secret, "key") == public_key(tmp_path / "own.key.pub", "key") == public_key("p" * 40, "key") == "p" * 40

"""What the command line says of a limberd of another version, against a fake one."""

import subprocess

import pytest
from limber.launching import find_binary
from limber.v1 import common_pb2 as common
from limber.v1 import service_pb2 as service

pytestmark = pytest.mark.timeout(30)


def run(fake, *command):
    return subprocess.run([str(find_binary("limber")), "--endpoint", fake.requests, *command], capture_output=True, text=True,
                          timeout=20)


@pytest.mark.parametrize("versions, side", [([2, 3], "client"), ([0], "server")])
def test_the_side_that_is_older_is_named(fake, versions, side):
    fake.versions = versions
    ran = run(fake, "info")
    assert ran.returncode == 1 and f"protocol 1: update the {side}" in ran.stderr, ran.stderr
    assert "UNSUPPORTED" in ran.stderr


def test_the_words_of_a_server_that_answers_nothing_are_passed_on(fake):
    fake.handlers["get_server_info"] = lambda request: service.Reply(version=2, id=request.id, error=common.Error(
        code=common.ERROR_CODE_UNSUPPORTED, field="version",
        message="this client speaks protocol 1, this server (2.0) protocol 2: update the client"))
    ran = run(fake, "info")
    assert ran.returncode == 1 and "update the client" in ran.stderr


def test_a_server_of_before_is_asked_without_the_version(fake):
    def older(request):
        if request.get_server_info.client_version:
            return service.Reply(version=1, id=request.id, error=common.Error(
                code=common.ERROR_CODE_INVALID_ARGUMENT, message="unknown field number 1 in GetServerInfoRequest"))
        return fake.info(request)

    fake.handlers["get_server_info"] = older
    ran = run(fake, "info")
    assert ran.returncode == 0 and "limberd fake, protocol 1" in ran.stdout, ran.stderr
    asked = run(fake, "web", "--no-open", "--role", "view")
    assert asked.returncode == 1, "it serves no pages"

"""What scripts/build-web and scripts/test-web say where the packages of the page cannot be installed."""

import os
import pathlib
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture
def call(tmp_path):
    """Runs a script in a folder of its own, with an npm that fails."""
    (tmp_path / "clients" / "web").mkdir(parents=True)
    (tmp_path / "clients" / "web" / "package-lock.json").write_text("{}")
    shutil.copytree(ROOT / "scripts", tmp_path / "scripts")
    (tmp_path / "bin").mkdir()
    npm = tmp_path / "bin" / "npm"
    npm.write_text("#!/bin/sh\necho no registry >&2\nexit 1\n")
    npm.chmod(0o755)

    def run(script, *arguments, **variables):
        inherited = {name: value for name, value in os.environ.items() if name not in ("CI", "LIMBER_WITHOUT_WEB")}
        environment = dict(inherited, PATH=f"{npm.parent}:{os.environ['PATH']}", **variables)
        return subprocess.run([tmp_path / "scripts" / script, *arguments], env=environment, capture_output=True, text=True)

    return run


def test_a_person_gets_a_limberd_and_is_told(call):
    answer = call("build-web")
    assert answer.returncode == 0 and "THE PAGE IS NOT BUILT" in answer.stderr


@pytest.mark.parametrize("script, arguments, variables", [
    ("build-web", (), {"CI": "true"}),
    ("build-web", ("--check",), {}),
    ("test-web", (), {}),
    ("test-web", (), {"CI": "true"}),
])
def test_checks_fail_without_the_packages(call, script, arguments, variables):
    answer = call(script, *arguments, **variables)
    assert answer.returncode != 0 and "no registry" in answer.stderr and "LIMBER_WITHOUT_WEB=1" in answer.stderr


@pytest.mark.parametrize("script", ["build-web", "test-web"])
def test_the_page_is_left_out_only_where_that_is_asked_for(call, script):
    answer = call(script, LIMBER_WITHOUT_WEB="1", CI="true")
    assert answer.returncode == 0 and "SKIPPED" in answer.stderr and "no registry" not in answer.stderr

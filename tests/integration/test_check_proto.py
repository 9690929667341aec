"""proto/baseline.binpb, against which changes of the wire are checked, and what scripts/check-proto says without its tools."""

import importlib
import os
import pathlib
import shutil
import subprocess

import pytest
from google.protobuf import descriptor_pb2

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROTOS = sorted((ROOT / "proto" / "limber" / "v1").glob("*.proto"))


def parts_of(message, prefix):
    """Fields, values and messages of a message, each as text that changes where the wire does."""
    name = f"{prefix}.{message.name}"
    yield name
    for field in message.field:
        yield f"{name}.{field.name} = {field.number} {field.type} {field.type_name} {field.label}"
    for enum in message.enum_type:
        yield from values_of(enum, name)
    for nested in message.nested_type:
        yield from parts_of(nested, name)


def values_of(enum, prefix):
    yield from (f"{prefix}.{enum.name}.{value.name} = {value.number}" for value in enum.value)


def parts_of_file(file):
    for message in file.message_type:
        yield from parts_of(message, file.package)
    for enum in file.enum_type:
        yield from values_of(enum, file.package)


def test_the_baseline_knows_todays_messages():
    """Else a change to what it does not know would be no break: run scripts/check-proto --accept."""
    baseline = descriptor_pb2.FileDescriptorSet.FromString((ROOT / "proto" / "baseline.binpb").read_bytes())
    known = {part for file in baseline.file for part in parts_of_file(file)}
    assert len(PROTOS) > 5
    missing = []
    for path in PROTOS:
        file = descriptor_pb2.FileDescriptorProto()
        importlib.import_module(f"limber.v1.{path.stem}_pb2").DESCRIPTOR.CopyToProto(file)
        missing += [part for part in parts_of_file(file) if part not in known]
    assert not missing, f"not in the baseline (scripts/check-proto --accept): {missing[:10]} and {len(missing)} in all"


@pytest.fixture
def call(tmp_path):
    """Runs scripts/check-proto in a folder of its own, with an npm that fails."""
    (tmp_path / "scripts").mkdir()
    (tmp_path / "proto").mkdir()
    shutil.copy(ROOT / "scripts" / "check-proto", tmp_path / "scripts")
    (tmp_path / "bin").mkdir()
    npm = tmp_path / "bin" / "npm"
    npm.write_text("#!/bin/sh\necho no registry >&2\nexit 1\n")
    npm.chmod(0o755)

    def run(*arguments, **variables):
        inherited = {name: value for name, value in os.environ.items() if name not in ("CI", "LIMBER_WITHOUT_NPM")}
        environment = dict(inherited, PATH=f"{npm.parent}:{os.environ['PATH']}", **variables)
        return subprocess.run([tmp_path / "scripts" / "check-proto", *arguments], env=environment, capture_output=True, text=True,
                              timeout=60)

    return run


@pytest.mark.parametrize("arguments, variables", [((), {}), ((), {"CI": "true"}), (("--accept",), {}),
                                                  (("--accept",), {"LIMBER_WITHOUT_NPM": "1"})])
def test_without_its_tools_it_fails(call, arguments, variables):
    answer = call(*arguments, **variables)
    assert answer.returncode == 1 and "FAILED" in answer.stderr and "LIMBER_WITHOUT_NPM=1" in answer.stderr


def test_it_is_left_out_where_that_is_said(call):
    answer = call(LIMBER_WITHOUT_NPM="1")
    assert answer.returncode == 0 and "SKIPPED" in answer.stderr


def test_it_is_never_left_out_in_ci(call):
    answer = call(LIMBER_WITHOUT_NPM="1", CI="true")
    assert answer.returncode == 1 and "FAILED" in answer.stderr

"""The Python package from the sources, and a fake limberd that answers as a test tells it to."""

import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "clients" / "python"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from fake_server import FakeServer  # noqa: E402


@pytest.fixture
def fake(tmp_path):
    with FakeServer(tmp_path) as server:
        yield server

"""Real limberd processes: where they are, one for reading tests, one per test that hurts its server."""

import contextlib
import json
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
for folder in (ROOT / "clients" / "python", ROOT / "examples", pathlib.Path(__file__).resolve().parent):
    sys.path.insert(0, str(folder))
# For the processes that tests start.
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT / "clients" / "python"), os.environ.get("PYTHONPATH")]))

import limber  # noqa: E402
from balances import checked_balances  # noqa: E402
from limber.launching import find_binary  # noqa: E402


def pytest_collection_modifyitems(items):
    for item in items:
        if not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(60))


@pytest.fixture(scope="session", autouse=True)
def balances():
    """Every solution of a linkage or of beams that a test fetches."""
    with checked_balances():
        yield


@pytest.fixture(scope="session")
def limberd():
    """The server binary. Not skipped if absent: these tests are about it."""
    path = find_binary("limberd")
    os.environ["LIMBER_BIN"] = str(path.parent)
    return path


@pytest.fixture(scope="session")
def cache_dir(tmp_path_factory):
    """Models are built once per test run."""
    return tmp_path_factory.mktemp("models")


@pytest.fixture
def launch(limberd, cache_dir):
    """A function that starts a server of the test's own; all are stopped afterwards."""
    started = []

    def start(*arguments, **options):
        server = limber.launch(limberd, cache_dir=cache_dir, arguments=arguments, **options)
        started.append(server)
        return server

    yield start
    for server in started:
        server.close()


@pytest.fixture(scope="module")
def server(limberd, cache_dir):
    """One server for the tests of a module that leave it intact."""
    with limber.launch(limberd, cache_dir=cache_dir) as running:
        yield running
        assert running.process.poll() is None, "limberd died: " + running.log


@pytest.fixture
def session(server):
    """A small body, solved."""
    opened = server.open(small_scene(), progress=False)
    yield opened
    try:
        opened.close()
    except limber.LimberError as error:
        assert error.code in ("NOT_FOUND", "FAILED_PRECONDITION")


def bar(cells=(6, 2, 2), size=(3.0, 1.0, 1.0)):
    """Nodes and tets of a bar: cubes of six tets each around a diagonal, all of positive volume."""
    import numpy as np
    nx, ny, nz = cells
    grid = np.stack(np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), np.arange(nz + 1), indexing="ij"), axis=-1)
    nodes = grid.reshape(-1, 3) * (np.array(size) / cells)

    def index(i, j, k):
        return (i * (ny + 1) + j) * (nz + 1) + k

    tets = []
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                c = [index(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2)) for b in range(8)]
                for a, b in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1)):
                    tets.append([c[0], c[a], c[b], c[7]])
    tets = np.array(tets)
    edges = nodes[tets[:, 1:]] - nodes[tets[:, :1]]
    flipped = np.linalg.det(edges) < 0
    tets[flipped] = tets[flipped][:, [0, 2, 1, 3]]
    return nodes, tets


def small_scene(frames=60, **options):
    """A bar of 144 tets that is held at x = 0: its model is built in a moment."""
    nodes, tets = bar()
    held = [i for i, node in enumerate(nodes) if node[0] == 0]
    settings = {"name": "bar", "fixed_nodes": held, "modes": 8, "tolerance": 0.05, "youngs_modulus": 1e5,
                "period_frames": 25}
    return limber.scene_from_arrays(nodes, tets, frames=frames, **(settings | options))


def two_material_scene(**options):
    """The bar of small_scene(); its outer half is of a second material."""
    scene = small_scene(**options)
    nodes, tets = bar()
    outer = nodes[tets].mean(axis=1)[:, 0] > 1.5
    group = scene.material_groups.add(tets=[i for i, is_outer in enumerate(outer) if is_outer])
    group.material.youngs_modulus, group.material.poissons_ratio, group.material.density = 1e6, 0.2, 3000
    return scene


def tip_of(session):
    """The node at the free end's corner."""
    return int(session.geometry().rest.sum(axis=1).argmax())


@pytest.fixture
def cli(limberd, server):
    """Runs `limber` against the module's server."""
    binary = find_binary("limber")

    def run(*arguments, endpoint=None, timeout=60, **options):
        environment = dict(os.environ, LIMBER_ENDPOINT=endpoint or server.connection.endpoint)
        return subprocess.run([str(binary), *map(str, arguments)], env=environment, capture_output=True, text=True,
                              timeout=timeout, **options)

    return run


@contextlib.contextmanager
def encrypting(limberd, keys, cache_dir, *more):
    """A server with the keys of a folder: what its ready file says. The package's launch() is for servers without keys."""
    ready = keys / "ready"
    process = subprocess.Popen([str(limberd), "--bind", "tcp://127.0.0.1:0", "--stream", "tcp://127.0.0.1:0",
                                "--ready-file", ready, "--cache-dir", cache_dir, "--curve-secret-file", keys / "server.key",
                                "--curve-allow", keys / "allowed", *more], stderr=subprocess.DEVNULL)
    try:
        for _ in range(500):
            if ready.exists():
                break
            with pytest.raises(subprocess.TimeoutExpired):
                process.wait(0.02)
        yield json.loads(ready.read_text())
    finally:
        process.terminate()
        assert process.wait(10) == 0

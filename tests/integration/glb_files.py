"""Reads .glb files back, and has the Khronos validator read them."""

import json
import shutil
import struct
import subprocess

import numpy as np
import pytest
from conftest import ROOT

FORMATS = ROOT / "tests" / "formats"
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
TYPES = {5126: "<f4", 5125: "<u4"}


def read(path):
    """Document and a function from an accessor's number to its values."""
    content = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack_from("<I4s", content, 12)
    assert kind == b"JSON"
    document = json.loads(content[20:20 + size])
    assert content[24 + size:28 + size] == b"BIN\0"
    binary = content[28 + size:]

    def values(number):
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        width = WIDTHS[accessor["type"]]
        flat = np.frombuffer(binary, TYPES[accessor["componentType"]], accessor["count"] * width, view["byteOffset"])
        return flat.reshape(-1, width) if width > 1 else flat

    return document, values


def played(path):
    """Faces, positions in each frame (frames x vertices x 3, of the mesh itself) and the times of frames."""
    document, values = read(path)
    primitives = document["meshes"][0]["primitives"]
    primitive = primitives[0]
    assert all((part["attributes"], part.get("targets")) == (primitive["attributes"], primitive.get("targets"))
               for part in primitives)
    base = values(primitive["attributes"]["POSITION"]).astype(float)
    faces = np.concatenate([values(part["indices"]).reshape(-1, 3) for part in primitives])
    if "animations" not in document:
        return faces, base[None], np.zeros(1)
    targets = np.array([values(target["POSITION"]) for target in primitive["targets"]], dtype=float)
    (sampler,) = document["animations"][0]["samplers"]
    times = values(sampler["input"])
    weights = values(sampler["output"]).reshape(len(times), -1).astype(float)
    return faces, base + np.einsum("fk,kvx->fvx", weights, targets), times


def validate(*paths):
    """Fails where the validator finds an error or a warning."""
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("npm is not installed")
    if not (FORMATS / "node_modules" / "gltf-validator").is_dir():
        made = subprocess.run([npm, "ci", "--no-audit", "--no-fund"], cwd=FORMATS, capture_output=True, text=True, timeout=120)
        assert made.returncode == 0, made.stderr
    done = subprocess.run(["node", "validate.js", *map(str, paths)], cwd=FORMATS, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    reports = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(reports) == len(paths)
    for report in reports:
        assert (report["numErrors"], report["numWarnings"]) == (0, 0), report["messages"]
    return reports

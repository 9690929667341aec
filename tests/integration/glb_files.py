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

    check(document, len(binary))

    def values(number):
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        width = WIDTHS[accessor["type"]]
        flat = np.frombuffer(binary, TYPES[accessor["componentType"]], accessor["count"] * width, view["byteOffset"])
        return flat.reshape(-1, width) if width > 1 else flat

    return document, values


def check(document, size):
    """What glTF 2.0 demands of the parts that these files have: bounds, alignment, counts."""
    views, accessors = document["bufferViews"], document["accessors"]
    (buffer,) = document["buffers"]
    assert 0 <= size - buffer["byteLength"] < 4
    for view in views:
        assert view["buffer"] == 0 and view["byteOffset"] % 4 == 0 and view["byteOffset"] + view["byteLength"] <= buffer["byteLength"]
    for accessor in accessors:
        assert accessor["count"] > 0
        assert 4 * WIDTHS[accessor["type"]] * accessor["count"] == views[accessor["bufferView"]]["byteLength"]
    (mesh,) = document["meshes"]
    (scene,), (node,) = document["scenes"], document["nodes"]
    assert scene["nodes"] == [0] and node["mesh"] == 0
    targets = len(mesh.get("weights", []))
    for primitive in mesh["primitives"]:
        assert accessors[primitive["indices"]]["count"] % 3 == 0 and len(primitive.get("targets", [])) == targets
        count = accessors[primitive["attributes"]["POSITION"]]["count"]
        for attributes in (primitive["attributes"], *primitive.get("targets", [])):
            assert {"POSITION", "NORMAL"} <= set(attributes)
            assert all(accessors[number]["count"] == count for number in attributes.values())
            assert {"min", "max"} <= set(accessors[attributes["POSITION"]])
        assert 0 <= primitive["material"] < len(document["materials"])
    for animation in document.get("animations", []):
        for channel in animation["channels"]:
            assert channel["target"] == {"node": 0, "path": "weights"}
            sampler = animation["samplers"][channel["sampler"]]
            frames = accessors[sampler["input"]]
            assert accessors[sampler["output"]]["count"] == frames["count"] * targets
            assert (frames["min"][0], len(frames["max"])) == (0, 1)


def played(path):
    """Faces, positions in each frame (frames x vertices x 3, of the mesh itself) and the times of frames. Of vertices that are at
    one place in all frames, those at sharp edges and seams, the first one."""
    faces, positions, times = shown(path)[:3]
    _, first, number = np.unique(positions.transpose(1, 0, 2).reshape(positions.shape[1], -1), axis=0, return_index=True,
                                 return_inverse=True)
    order = np.argsort(first)
    place = np.empty(len(order), dtype=int)
    place[order] = np.arange(len(order))
    return place[number.reshape(-1)][faces], positions[:, first[order]], times


def shown(path):
    """Faces, positions and times as the file has them, and normals (frames x vertices x 3, not of unit length)."""
    document, values = read(path)
    primitives = document["meshes"][0]["primitives"]
    primitive = primitives[0]
    assert all((part["attributes"], part.get("targets")) == (primitive["attributes"], primitive.get("targets"))
               for part in primitives)
    base = values(primitive["attributes"]["POSITION"]).astype(float)
    faces = np.concatenate([values(part["indices"]).reshape(-1, 3) for part in primitives])
    if "animations" not in document:
        return faces, base[None], np.zeros(1), values(primitive["attributes"]["NORMAL"])[None]
    targets, added = (np.array([values(target[name]) for target in primitive["targets"]], dtype=float)
                      for name in ("POSITION", "NORMAL"))
    (sampler,) = document["animations"][0]["samplers"]
    times = values(sampler["input"])
    weights = values(sampler["output"]).reshape(len(times), -1).astype(float)
    normals = values(primitive["attributes"]["NORMAL"]) + np.einsum("fk,kvx->fvx", weights, added)
    return faces, base + np.einsum("fk,kvx->fvx", weights, targets), times, normals


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

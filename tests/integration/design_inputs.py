"""What tests of designs give to the service, and how they ask it."""

import json
import os
import struct
import subprocess
import time

import limber
import numpy as np
from limber.launching import find_binary


def sheet(x, y, z):
    """Vertices and triangles of a grid of points, each n x m."""
    at = np.arange(x.size).reshape(x.shape)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def write_obj(path, vertices, triangles):
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in vertices) +
                    "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles))


def write_ply(path, vertices, triangles):
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\n"
                    f"property double z\nelement face {len(triangles)}\nproperty list uchar int vertex_indices\n"
                    "end_header\n" + "".join(f"{x} {y} {z}\n" for x, y, z in vertices) +
                    "".join(f"3 {a} {b} {c}\n" for a, b, c in triangles))


def write_stl(path, vertices, triangles):
    corners = vertices[triangles].reshape(-1, 9)
    records = np.zeros(len(corners), dtype=[("numbers", "<f4", 12), ("attribute", "<u2")])
    records["numbers"][:, 3:] = corners
    path.write_bytes(bytes(80) + np.uint32(len(corners)).astype("<u4").tobytes() + records.tobytes())


def write_off(path, vertices, triangles):
    path.write_text(f"OFF\n{len(vertices)} {len(triangles)} 0\n" + "".join(f"{x} {y} {z}\n" for x, y, z in vertices)
                    + "".join(f"3 {a} {b} {c}\n" for a, b, c in triangles))


def write_glb(path, vertices, triangles):
    """Half as large, in a node that doubles it; indices of two bytes."""
    points, corners = (vertices / 2).astype("<f4").tobytes(), triangles.astype("<u2").tobytes()
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "scale": [2, 2, 2]}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": len(vertices)},
                              {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": triangles.size}],
                "bufferViews": [{"buffer": 0, "byteLength": len(points)},
                                {"buffer": 0, "byteOffset": len(points), "byteLength": len(corners)}],
                "buffers": [{"byteLength": len(points) + len(corners)}]}
    text, binary = json.dumps(document).encode(), points + corners
    text, binary = text + b" " * (-len(text) % 4), binary + bytes(-len(binary) % 4)
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A) + text
                     + struct.pack("<II", len(binary), 0x004E4942) + binary)


def run(server, *arguments):
    environment = {**os.environ, "LIMBER_ENDPOINT": server.connection.endpoint}
    return subprocess.run([str(find_binary("limber")), *arguments], env=environment, capture_output=True, text=True,
                          timeout=60)


def strips(lines=5):
    """Two families of strips aslant, in millimetres, their lengths a little uneven."""
    points, edges = [], []
    for i in range(lines):
        for k in range(lines):
            x, y = 40 * (i + k * np.cos(0.6)), 40 * k * np.sin(0.6)
            x += 4 * np.sin(0.03 * y)
            points.append((x, y + 3 * np.sin(0.025 * x), 6 * np.sin(0.02 * (x + y))))
            edges += [(i * lines + k - lines, i * lines + k)] * (i > 0) + [(i * lines + k - 1, i * lines + k)] * (k > 0)
    return np.array(points), np.array(edges)


def strip_scene():
    points, edges = strips()
    scene = limber.linkage_scene(points, edges, section={"rectangle": (6, 1.5)}, edges_per_segment=5, name="strips",
                                 length_unit_in_metres=1e-3)
    scene.linkage.conditions.mean_angle_degrees = 57
    return scene


def cap(joints, lift):
    """A hill through the joints, as triangles of a grid."""
    low, high, middle = joints.min(axis=0), joints.max(axis=0), joints.mean(axis=0)
    n = 20
    x, y = np.meshgrid(np.linspace(low[0], high[0], n), np.linspace(low[1], high[1], n), indexing="ij")
    u, v = (x - middle[0]) / (high[0] - low[0]), (y - middle[1]) / (high[1] - low[1])
    return sheet(x, y, middle[2] + lift * (1 - u ** 2 - v ** 2))


def until(condition, seconds=20):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)

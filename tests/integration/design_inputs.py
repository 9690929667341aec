"""What tests of designs give to the service, and how they ask it."""

import os
import subprocess

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


def run(server, *arguments):
    environment = {**os.environ, "LIMBER_ENDPOINT": server.connection.endpoint}
    return subprocess.run([str(find_binary("limber")), *arguments], env=environment, capture_output=True, text=True,
                          timeout=60)

"""What Blender shows is what the session holds."""

import contextlib
import json
import shutil
import subprocess

import numpy as np
import pytest

PLAY = """
import json, sys, bpy
obj, cache, frames, out = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.obj_import(filepath=obj, forward_axis="Y", up_axis="Z")
body = bpy.context.selected_objects[0]
modifier = body.modifiers.new("motion", "MESH_CACHE")
modifier.cache_format, modifier.filepath = "PC2", cache
modifier.forward_axis, modifier.up_axis = "POS_Y", "POS_Z"
modifier.frame_start = 0
shapes = []
for frame in range(int(frames)):
    bpy.context.scene.frame_set(frame)
    shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    shapes.append([list(body.matrix_world @ vertex.co) for vertex in shown.data.vertices])
json.dump(shapes, open(out, "w"))
"""


def surface_of(folder):
    """Vertices and triangles of the only .obj, positions (frames x vertices x 3) of the only .pc2."""
    (obj,), (cache,) = folder.glob("*.obj"), folder.glob("*.pc2")
    words = [line.split() for line in obj.read_text().splitlines()]
    vertices = np.array([word[1:] for word in words if word and word[0] == "v"], dtype=float)
    faces = np.array([word[1:] for word in words if word and word[0] == "f"], dtype=int) - 1
    content = cache.read_bytes()
    count, frames = np.frombuffer(content, "<i4", 1, 16)[0], np.frombuffer(content, "<i4", 1, 28)[0]
    return obj, cache, vertices, faces, np.frombuffer(content, "<f4", offset=32).reshape(frames, count, 3)


@pytest.fixture
def exported(server, tmp_path):
    with contextlib.closing(server.open(server.sample("flower"))) as session:
        session.wait()
        session.export(tmp_path, formats="blender")
        geometry = session.geometry()
        nodes = np.unique(geometry.surface)
        assert len(nodes) < len(geometry.rest)  # there are inner nodes to be left out
        yield tmp_path, session.frames()[:, nodes]


def test_exports_for_blender_hold_the_surface_alone(exported):
    folder, expected = exported
    _, _, vertices, faces, positions = surface_of(folder)
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))
    assert positions.shape == expected.shape
    assert np.abs(positions - expected).max() < 1e-5 * np.ptp(vertices)


def test_blender_plays_the_motion(exported):
    blender = shutil.which("blender")
    if blender is None:
        pytest.skip("blender is not installed (apt-get install blender)")
    folder, expected = exported
    obj, cache, *_ = surface_of(folder)
    script, out = folder / "play.py", folder / "shapes.json"
    script.write_text(PLAY)
    subprocess.run([blender, "--background", "--factory-startup", "--python-exit-code", "1", "--python", script, "--", obj,
                    cache, str(len(expected)), out], check=True, capture_output=True, text=True, timeout=110)
    shown = np.array(json.loads(out.read_text()))
    assert shown.shape == expected.shape
    assert np.abs(shown - expected).max() < 1e-4 * np.ptp(expected)

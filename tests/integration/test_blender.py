"""What Blender shows is what the session holds."""

import contextlib
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from conftest import ROOT

# Behind the block of the guide, which defines `body`.
LOOK = """
import json, sys
frames, out = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
shapes = []
for frame in range(int(frames)):
    scene.frame_set(scene.frame_start + frame)
    shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    shapes.append([list(body.matrix_world @ vertex.co) for vertex in shown.data.vertices])
json.dump(shapes, open(out, "w"))
"""


def block_of_the_guide():
    """For a file beside motion_surface.obj and motion_surface.pc2."""
    (block,) = [text for text in re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "guide.md").read_text(), re.DOTALL)
                if "import bpy" in text]
    return block


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


def test_the_guide_plays_motions_in_step():
    block = block_of_the_guide()
    assert 'filepath="motion_surface.obj"' in block and '"//motion_surface.pc2"' in block
    assert "cache.frame_start = scene.frame_start" in block
    compile(block, "guide", "exec")


def test_blender_plays_the_motion(exported):
    """By the script of the guide, letter for letter."""
    blender = shutil.which("blender")
    if blender is None:
        pytest.skip("blender is not installed (apt-get install blender)")
    folder, expected = exported
    obj, cache, *_ = surface_of(folder)
    obj.rename(folder / "motion_surface.obj")
    cache.rename(folder / "motion_surface.pc2")
    script, out = folder / "play.py", folder / "shapes.json"
    script.write_text(block_of_the_guide() + LOOK)
    subprocess.run([blender, "--background", "--factory-startup", "--python-exit-code", "1", "--python", script, "--",
                    str(len(expected)), out], check=True, capture_output=True, text=True, timeout=110, cwd=folder)
    shown = np.array(json.loads(out.read_text()))
    assert shown.shape == expected.shape
    assert np.abs(shown - expected).max() < 1e-4 * np.ptp(expected)


# Imports a .glb as Blender's own importer reads it, and tells where its vertices are in the world.
IMPORT = """
import bpy, json, numpy, sys
numpy.bool = bool  # the importer of Debian's Blender 3.4 uses a name that its numpy has no more
file, frames, rate, out = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
scene.render.fps = int(rate)
bpy.ops.import_scene.gltf(filepath=file)
(body,) = [thing for thing in bpy.context.selected_objects if thing.type == "MESH"]
shapes = []
for frame in range(int(frames)):
    scene.frame_set(frame)
    shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    shapes.append([list(shown.matrix_world @ vertex.co) for vertex in shown.data.vertices])
json.dump({"shapes": shapes, "keys": len(body.data.shape_keys.key_blocks) - 1}, open(out, "w"))
"""


@pytest.mark.timeout(150)
def test_blender_plays_a_glb(server, tmp_path):
    """Its morph targets, in step with a timeline of the scene's rate, upright and in metres."""
    blender = shutil.which("blender")
    if blender is None:
        pytest.skip("blender is not installed (apt-get install blender)")
    with contextlib.closing(server.open(server.sample("flower"))) as session:
        session.wait()
        saved = session.save(tmp_path / "motion.glb", up="z")
        rate = session.scene().dynamics.frames_per_second
        expected = session.frames()[:, np.unique(session.geometry().surface)] * session.scene().length_unit_in_metres
    script, out = tmp_path / "import.py", tmp_path / "shapes.json"
    script.write_text(IMPORT)
    subprocess.run([blender, "--background", "--factory-startup", "--python-exit-code", "1", "--python", script, "--",
                    saved.files[0], str(len(expected)), str(round(rate)), out], check=True, capture_output=True, text=True, timeout=110)
    seen = json.loads(out.read_text())
    assert seen["keys"] == saved.targets
    shown = np.array(seen["shapes"])
    shown = shown[:, :expected.shape[1]]  # copies at sharp edges follow
    assert np.abs(shown - expected).max() < 3e-4 * np.ptp(expected)

"""Runs in Blender: add-on, surface, endpoint and folder are behind `--`; writes seen.json."""

import json
import pathlib
import sys
import time

import bpy
import numpy as np

addon, drawn, endpoint, folder = sys.argv[sys.argv.index("--") + 1:]
folder = pathlib.Path(folder)
bpy.ops.preferences.addon_install(filepath=addon)
bpy.ops.preferences.addon_enable(module="limber_blender")
import limber  # noqa: E402
from limber_blender import operators, scene_link  # noqa: E402

seen = {"client": limber.__file__}
scene = bpy.context.scene
bpy.data.objects.remove(bpy.data.objects["Cube"])
scene.frame_start, scene.frame_end = 10, 69
scene.render.fps, scene.render.fps_base = 25, 1.0
bpy.ops.wm.obj_import(filepath=drawn, forward_axis="Y", up_axis="Z")
spot = bpy.context.selected_objects[0]
spot.name = "spot"
spot.location, spot.rotation_euler, spot.scale = (1, 2, 3), (0.3, 0.2, 0.1), (2, 2, 2)
bpy.context.view_layer.update()
spot.data.materials.append(bpy.data.materials.new("coat"))
drawn_at = np.array([vertex.co for vertex in spot.data.vertices])


def kept():
    mesh = spot.data
    return ([loop.vertex_index for loop in mesh.loops], [tuple(item.uv) for item in mesh.uv_layers.active.data],
            [polygon.material_index for polygon in mesh.polygons] + [slot.material.name for slot in spot.material_slots])


def shown(frame):
    """Vertices as Blender shows them, in the object's space."""
    scene.frame_set(frame)
    evaluated = spot.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([vertex.co for vertex in evaluated.data.vertices])


def wait(condition):
    """As Blender's timer would."""
    deadline = time.monotonic() + 200
    while not condition():
        assert link.live.state != "failed", link.live.error
        assert time.monotonic() < deadline, (link.live.state, link.live.error)
        operators.tick()
        time.sleep(0.01)
    operators.tick()


def far(one, other):
    return float(np.linalg.norm(one - other, axis=-1).max())


before, counts = kept(), [len(spot.data.vertices)]
group = spot.vertex_groups.new(name=scene_link.FIXED)
group.add([int(i) for i in np.flatnonzero(drawn_at[:, 1] < np.quantile(drawn_at[:, 1], 0.03))], 1.0, "REPLACE")
settings = scene.limber
settings.tets, settings.modes, settings.tolerance, settings.endpoint = 1500, 12, 0.2, endpoint


def start():
    bpy.context.view_layer.objects.active = spot
    assert bpy.ops.limber.start() == {"FINISHED"}
    return scene_link.LINKS["spot"]


link = start()
wait(lambda: link.live.picture)
seen["early_states"] = far(shown(30), drawn_at)
scene.frame_set(30)
top = spot.matrix_world @ spot.data.vertices[int(drawn_at[:, 1].argmax())].co
scene.cursor.location = top
assert bpy.ops.limber.add_handle() == {"FINISHED"}
handle = bpy.context.object
picked = int(np.linalg.norm(link.world(drawn_at) - np.array(handle.location), axis=1).argmin())
first = np.array(handle.location)
for step in range(10):  # a drag
    handle.location = first + (0.04 * (step + 1), 0, 0)
    bpy.context.view_layer.update()
    operators.tick()
wait(lambda: link.live.settled(link.asked))
world = link.world(shown(30))
seen["miss"] = float(np.linalg.norm(world[picked] - np.array(handle.location)))
seen["drag_moved"] = float(np.linalg.norm(world[picked] - first))
handle.keyframe_insert("location", frame=30)
handle.location = first
handle.keyframe_insert("location", frame=45)
handle.location = first + (0, 0, 5)  # far away, before the timeline and after it
for frame in (2, 9, 70, 90):
    handle.keyframe_insert("location", frame=frame)
scene.frame_set(30)
operators.tick()
wait(lambda: link.live.settled(link.asked))
seen["wished_frames"] = sorted(wish.frame for wish in link.wishes())
seen["constraint_frames"] = sorted(constraint.frame for constraint in link.live._session.constraints())
inside = [wish.position for wish in link.wishes()]
scene.frame_set(90)
assert [wish.position for wish in link.wishes()] == inside, "what is shown in a frame outside is no wish for the last one"
seen["wished_outside"] = sorted(wish.frame for wish in link.wishes())
try:
    scene_link.add_handle(link, first, 90)
    seen["handle_outside"] = ""
except ValueError as error:
    seen["handle_outside"] = str(error)
scene.frame_set(30)
counts.append(len(spot.data.vertices))

shapes = link.shapes()
seen["before_start"] = far(shown(5), shapes[0])
from limber_blender import baking  # noqa: E402
seen["keys"], seen["keys_told"] = baking.as_shape_keys(link)
seen["keys_error"] = max(far(shown(10 + frame), shapes[frame]) for frame in range(60))
counts.append(len(spot.data.vertices))
for ending in ("mdd", "pc2"):
    baking.as_cache(link, folder / f"baked.{ending}")
    seen[f"{ending}_error"] = max(far(shown(10 + frame), shapes[frame]) for frame in range(60))
    assert not any(key.name.startswith("limber") for key in spot.data.shape_keys.key_blocks)
scene.render.fps = 50  # the motion's seconds stay
baking.as_cache(link, folder / "baked.pc2")
seen["faster_error"] = max(far(shown(10 + 2 * frame), shapes[frame]) for frame in range(60))
scene.render.fps = 25
baking.remove_baked(spot)
bpy.context.view_layer.objects.active = spot
assert bpy.ops.limber.stop() == {"FINISHED"} and not scene_link.LINKS
link.live._thread.join(30)
seen["stopped"] = far(shown(30), drawn_at)
counts.append(len(spot.data.vertices))
seen["vertices"] = counts
seen["kept"] = dict(zip(("loops", "uv", "materials"), (a == b for a, b in zip(before, kept()))))
(folder / "seen.json").write_text(json.dumps(seen))
bpy.ops.preferences.addon_disable(module="limber_blender")

"""Between an object of Blender's scene and a live session: all that reads and writes bpy's data."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix, Vector

from . import live
from .frames import Clock

KEY = "limber"            # the shape key that shows the motion
FIXED = "limber fixed"    # the vertex group that is held
HANDLE = "limber_object"  # property of an empty: whose handle it is
LINKS: "dict[str, Link]" = {}  # by the object's name


def rate_of(scene) -> float:
    return scene.render.fps / scene.render.fps_base


def manner_of(settings) -> live.Manner:
    return live.Manner(settings.calm, settings.loop)


def weights(mesh, group) -> np.ndarray:
    """The weight of each vertex in a vertex group; 0 if it is not in the group."""
    return np.array([next((item.weight for item in vertex.groups if item.group == group.index), 0.0) for vertex in mesh.vertices])


class Link:
    """One object and its session."""

    def __init__(self, object, settings, endpoint: str = "", binary: str = ""):
        scene, mesh = bpy.context.scene, object.data
        self.name, self.scene_name = object.name, scene.name
        self.start = scene.frame_start
        self.frames = max(scene.frame_end - scene.frame_start + 1, 3)
        self.rate = rate_of(scene)
        self.to_world = np.array(object.matrix_world, dtype=float)
        self.to_local = np.linalg.inv(self.to_world)
        if mesh.shape_keys is None:
            object.shape_key_add(name="Basis")
        basis = mesh.shape_keys.key_blocks[0]
        flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
        basis.data.foreach_get("co", flat)
        self.drawn = flat.reshape(-1, 3).astype(float)
        mesh.calc_loop_triangles()
        triangles = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        group = object.vertex_groups.get(FIXED)
        fixed = [vertex.index for vertex in mesh.vertices
                 if group and any(item.group == group.index and item.weight > 0.5 for item in vertex.groups)]
        stiff = object.vertex_groups.get(settings.stiff_group) if settings.stiff_group else None
        self.body = live.Body(name=object.name, vertices=self.world(self.drawn), triangles=triangles.reshape(-1, 3),
                              frames=self.frames, rate=self.rate, metres=scene.unit_settings.scale_length,
                              fixed=np.array(fixed, dtype=int), tets=settings.tets,
                              youngs_modulus=settings.youngs_modulus,
                              stiffness=None if stiff is None else settings.stiffest ** weights(mesh, stiff),
                              density=settings.density, period=settings.period, manner=manner_of(settings),
                              modes=settings.modes, tolerance=settings.tolerance)
        self.live = live.Live(self.body, endpoint, binary)
        self._wished: "tuple[list[live.Wish], live.Manner] | None" = None
        self.asked = 0
        self.showing = True  # false once the motion is baked
        self._shown = (-1, None)

    # ---- places ----

    def world(self, points: np.ndarray) -> np.ndarray:
        return points @ self.to_world[:3, :3].T + self.to_world[:3, 3]

    def local(self, points: np.ndarray) -> np.ndarray:
        return points @ self.to_local[:3, :3].T + self.to_local[:3, 3]

    @property
    def object(self):
        return bpy.data.objects.get(self.name)

    @property
    def scene(self):
        return bpy.data.scenes[self.scene_name]

    @property
    def clock(self) -> Clock:
        return Clock(self.start, rate_of(self.scene), self.rate, self.frames)

    # ---- from the scene to the session ----

    def handles(self) -> list:
        return sorted((empty for empty in self.scene.objects if empty.get(HANDLE) == self.name), key=lambda e: e.name)

    def wishes(self) -> "list[live.Wish]":
        """Targets of the empties: in each frame with a key of their location, else in the frame they were made in."""
        made, clock = [], self.clock
        now = clock.edited_frame(self.scene.frame_current)
        for empty in self.handles():
            node = int(empty["limber_node"])
            offset = np.array(empty["limber_offset"], dtype=float)
            for frame, place in places(empty, clock):
                if frame == now:  # as it is dragged, before a key is set
                    place = np.array(empty.matrix_world.translation)
                position = tuple(float(np.float32(x)) + float(y) for x, y in zip(place, offset))
                held = int(empty.get("limber_hold", 0))
                until = min(frame + held, self.frames - 1) if held > 0 and frame < self.frames - 1 else None
                made.append(live.Wish(empty.name, frame, node, position, bool(empty.get("limber_exact", False)), until))
        return made

    def push(self) -> bool:
        """Sends changes to the session; True if there were any."""
        if self.live.state in ("connecting", "filling", "building", "failed", "closed"):
            return False
        wished = self.wishes(), manner_of(self.scene.limber)
        if wished == self._wished:
            return False
        self._wished = wished
        self.asked = self.live.wish(*wished)
        return True

    # ---- from the session to the scene ----

    def pull(self) -> bool:
        """Shows the newest motion in the current frame; True: the mesh has changed."""
        picture, object = self.live.picture, self.object
        frame = self.clock.motion_frame(self.scene.frame_current)
        if not self.showing or picture is None or object is None or self._shown == (picture.number, frame):
            return False
        keys = object.data.shape_keys
        key = keys.key_blocks.get(KEY) or object.shape_key_add(name=KEY, from_mix=False)
        key.value = 1.0
        key.data.foreach_set("co", self.local(picture.shape(frame)).astype(np.float32).ravel())
        object.data.update()
        self._shown = (picture.number, frame)
        return True

    def shapes(self) -> np.ndarray:
        """frames x vertices x 3, in the object's own space."""
        if self.live.picture is None:
            raise RuntimeError("there is no motion yet")
        return self.local(self.live.picture.shapes()).astype(np.float32)

    def remove_preview(self) -> None:
        """The motion is shown no more."""
        self.showing = False
        object = self.object
        if object and object.data.shape_keys and object.data.shape_keys.key_blocks.get(KEY):
            object.shape_key_remove(object.data.shape_keys.key_blocks[KEY])

    def close(self, wait: bool = False) -> None:
        self.live.stop(wait)
        self.remove_preview()
        LINKS.pop(self.name, None)


def places(empty, clock: Clock) -> "list[tuple[int, np.ndarray]]":
    """Frames of the motion with keys of the empty's location, and where the keys put it in the world. Keys before the motion
    and after it do not count."""
    curves = [curve for curve in (empty.animation_data.action.fcurves if empty.animation_data and empty.animation_data.action
                                  else []) if curve.data_path == "location"]
    at = sorted({key.co[0] for curve in curves for key in curve.keyframe_points})
    if not at:
        only = clock.edited_frame(empty["limber_frame"])
        return [] if only is None else [(only, np.array(empty.matrix_world.translation))]
    parent = (empty.parent.matrix_world @ empty.matrix_parent_inverse) if empty.parent else Matrix.Identity(4)
    by_frame = {}
    for frame in at:
        edited = clock.edited_frame(frame)
        if edited is None:
            continue
        location = list(empty.location)
        for curve in curves:
            location[curve.array_index] = curve.evaluate(frame)
        by_frame[edited] = np.array(parent @ Vector(location))
    return sorted(by_frame.items())


def add_handle(link: Link, place, frame: int):
    """An empty where the surface node nearest to a place (in the world) is in a frame of Blender's timeline."""
    picture = link.live.picture
    if picture is None:
        raise RuntimeError("the session is not ready yet")
    if link.clock.edited_frame(frame) is None:
        last = link.clock.timeline_frame(link.frames - 1)
        raise ValueError(f"frame {frame} is outside of the motion, which has the frames {link.start} to {last:g}")
    nodes = link.live.nodes[link.live.surface_nodes]
    # The vertex of the shown surface nearest to the place, then the node nearest to where that vertex is drawn.
    shape = picture.shape(link.clock.motion_frame(frame))
    vertex = int(np.linalg.norm(shape - np.array(place), axis=1).argmin())
    node = int(link.live.surface_nodes[np.linalg.norm(nodes - link.body.vertices[vertex], axis=1).argmin()])
    empty = bpy.data.objects.new(f"{link.name} handle", None)
    empty.empty_display_type, empty.empty_display_size = "SPHERE", 0.02 * float(np.ptp(link.body.vertices, axis=0).max())
    empty.location = Vector(shape[vertex].tolist())
    empty[HANDLE], empty["limber_node"], empty["limber_frame"] = link.name, node, frame
    empty["limber_exact"] = 0
    empty["limber_hold"] = 0  # frames
    # The node is not quite where the vertex is: it keeps its distance. Far from the origin Blender rounds the empty's place.
    rounded = shape[vertex] - np.array(empty.location, dtype=float)
    empty["limber_offset"] = (link.live.nodes[node] - link.body.vertices[vertex] + rounded).tolist()
    link.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    return empty

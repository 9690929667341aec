"""The motion as Blender keeps it without a server: shape keys, or a mesh cache."""

from __future__ import annotations

import pathlib
import struct

import bpy
import numpy as np
from limber import morphs

from .scene_link import KEY, Link

PREFIX = "limber "  # of baked shape keys
MODIFIER = "limber"
TOLERANCE = 1e-4    # of shape keys, as a share of the object's size


def as_shape_keys(link: Link, tolerance: float = TOLERANCE) -> "tuple[int, float]":
    """The fewest shape keys that are nowhere off by more than the tolerance, with a key of the value in each frame. Returns their
    number and the largest remaining distance [units of the object]."""
    shapes = link.shapes()
    size = float(np.linalg.norm(np.ptp(shapes.reshape(-1, 3), axis=0)))
    _, targets, weights, error = morphs.targets_of(shapes, tolerance * size, 256, base=link.drawn.astype(np.float32))
    link.remove_preview()
    object, clock = link.object, link.clock
    remove_baked(object)
    for number, target in enumerate(targets):
        key = object.shape_key_add(name=f"{PREFIX}{number + 1}", from_mix=False)
        key.slider_min, key.slider_max = -1.0, 1.0
        key.data.foreach_set("co", (link.drawn + target).astype(np.float32).ravel())
        _animate(object.data.shape_keys, f'key_blocks["{key.name}"].value', clock, weights[:, number])
    return len(targets), error


def _animate(keys, path: str, clock, values: np.ndarray) -> None:
    """A linear curve through a value in each frame of the motion."""
    if keys.animation_data is None:
        keys.animation_data_create()
    if keys.animation_data.action is None:
        keys.animation_data.action = bpy.data.actions.new("limber")
    curve = keys.animation_data.action.fcurves.new(path)
    curve.keyframe_points.add(len(values))
    points = np.array([(clock.timeline_frame(frame), value) for frame, value in enumerate(values.tolist())])
    curve.keyframe_points.foreach_set("co", points.ravel())
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"
    curve.update()


def as_cache(link: Link, path: pathlib.Path) -> None:
    """A .pc2 or .mdd of the object's own vertices, and the modifier that plays it in step with the timeline."""
    shapes = link.shapes()
    frames, vertices = shapes.shape[:2]
    if path.suffix.lower() == ".mdd":
        header = struct.pack(">ii", frames, vertices) + (np.arange(frames) / link.rate).astype(">f4").tobytes()
        path.write_bytes(header + shapes.astype(">f4").tobytes())
    else:
        path.write_bytes(struct.pack("<12siiffi", b"POINTCACHE2\0", 1, vertices, 0.0, 1.0, frames) + shapes.astype("<f4").tobytes())
    link.remove_preview()
    object, clock = link.object, link.clock
    remove_baked(object)
    cache = object.modifiers.get(MODIFIER) or object.modifiers.new(MODIFIER, "MESH_CACHE")
    cache.cache_format = "MDD" if path.suffix.lower() == ".mdd" else "PC2"
    cache.filepath = str(path)
    cache.forward_axis, cache.up_axis = "POS_Y", "POS_Z"  # as Blender has them: nothing is turned
    cache.interpolation = "LINEAR"
    cache.play_mode = "SCENE"
    cache.frame_scale = clock.rate / clock.scene_rate
    cache.frame_start = clock.start * cache.frame_scale  # Blender takes it off behind the scale


def remove_baked(object) -> None:
    """Results of an earlier bake."""
    keys = object.data.shape_keys
    for key in [key for key in keys.key_blocks if key.name.startswith(PREFIX) and key.name != KEY] if keys else []:
        if keys.animation_data and keys.animation_data.action:
            for curve in [curve for curve in keys.animation_data.action.fcurves if f'"{key.name}"' in curve.data_path]:
                keys.animation_data.action.fcurves.remove(curve)
        object.shape_key_remove(key)
    if object.modifiers.get(MODIFIER):
        object.modifiers.remove(object.modifiers[MODIFIER])

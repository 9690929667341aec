"""Actions of the panel's buttons, and the timer that synchronises objects and sessions."""

from __future__ import annotations

import pathlib

import bpy

from .scene_link import LINKS, Link, add_handle

INTERVAL = 1 / 60  # seconds between looks at empties and sessions


def link_of(context) -> "Link | None":
    """Link of the active object, or of the object that the active empty is a handle of."""
    object = context.object
    return LINKS.get(object.get("limber_object", object.name)) if object else None


def tick() -> "float | None":
    """Blender calls it again after INTERVAL; it never waits for the server."""
    for link in list(LINKS.values()):
        if link.object is None:
            link.close()
            continue
        link.push()
        link.pull()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
    return INTERVAL if LINKS else None


@bpy.app.handlers.persistent
def on_frame(scene, *_):
    for link in LINKS.values():
        link.pull()


class Start(bpy.types.Operator):
    """Makes an elastic body of the active mesh and opens a session of it"""

    bl_idname = "limber.start"
    bl_label = "Start"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH" and context.object.name not in LINKS

    def execute(self, context):
        settings = context.scene.limber
        LINKS[context.object.name] = Link(context.object, settings, settings.endpoint, settings.binary)
        if not bpy.app.timers.is_registered(tick):
            bpy.app.timers.register(tick, first_interval=INTERVAL)
        return {"FINISHED"}


class _OfLink(bpy.types.Operator):
    @classmethod
    def poll(cls, context):
        link = link_of(context)
        return link is not None and link.live.picture is not None


class AddHandle(_OfLink):
    """Adds an empty that holds the body's surface, nearest to the 3D cursor, in the current frame"""

    bl_idname = "limber.add_handle"
    bl_label = "Add handle"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        link = link_of(context)
        try:
            empty = add_handle(link, context.scene.cursor.location, context.scene.frame_current)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for other in context.selected_objects:
            other.select_set(False)
        empty.select_set(True)
        context.view_layer.objects.active = empty
        return {"FINISHED"}


class BakeShapeKeys(_OfLink):
    """Keeps the motion as shape keys with animated values"""

    bl_idname = "limber.bake_shape_keys"
    bl_label = "Bake to shape keys"

    def execute(self, context):
        from . import baking
        link = link_of(context)
        count, error = baking.as_shape_keys(link)
        self.report({"INFO"}, f"{count} shape keys, off by at most {error:.3g}")
        link.close()
        return {"FINISHED"}


class BakeCache(_OfLink):
    """Keeps the motion as a .pc2 or .mdd that a modifier plays"""

    bl_idname = "limber.bake_cache"
    bl_label = "Bake to mesh cache"

    def execute(self, context):
        from . import baking
        link = link_of(context)
        path = pathlib.Path(bpy.path.abspath(context.scene.limber.cache_path))
        if path.suffix.lower() not in (".pc2", ".mdd") or not path.is_absolute():
            self.report({"ERROR"}, "the cache is a .pc2 or .mdd file; save the .blend first or give a whole path")
            return {"CANCELLED"}
        try:
            baking.as_cache(link, path)
        except OSError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        link.close()
        return {"FINISHED"}


class Stop(bpy.types.Operator):
    """Closes the session; the mesh is as it was drawn"""

    bl_idname = "limber.stop"
    bl_label = "Stop"

    @classmethod
    def poll(cls, context):
        return link_of(context) is not None

    def execute(self, context):
        link_of(context).close()
        return {"FINISHED"}


CLASSES = (Start, AddHandle, BakeShapeKeys, BakeCache, Stop)


def register():
    for made in CLASSES:
        bpy.utils.register_class(made)
    bpy.app.handlers.frame_change_post.append(on_frame)


def unregister():
    for link in list(LINKS.values()):
        link.close(wait=True)
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    bpy.app.handlers.frame_change_post.remove(on_frame)
    for made in reversed(CLASSES):
        bpy.utils.unregister_class(made)

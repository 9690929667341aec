"""The panel in the sidebar, and its settings."""

from __future__ import annotations

import bpy

from .scene_link import FIXED, LINKS


class Settings(bpy.types.PropertyGroup):
    tets: bpy.props.IntProperty(name="Tets", default=3000, min=50, description="How many fill the surface")
    youngs_modulus: bpy.props.FloatProperty(name="Stiffness [Pa]", default=1e5, min=1, description="Young's modulus")
    stiff_group: bpy.props.StringProperty(name="Stiffer in", description="A vertex group, painted: weights from 0 (as above) to 1")
    stiffest: bpy.props.FloatProperty(name="Times", default=10, min=1e-6, max=1e6,
                                      description="What the stiffness is multiplied by where the weight is 1; less in equal ratios")
    density: bpy.props.FloatProperty(name="Density [kg/m3]", default=1000, min=1e-3)
    period: bpy.props.FloatProperty(name="Swing [s]", default=1.0, min=0,
                                    description="Seconds of the slowest swing; 0: as the stiffness has it")
    calm: bpy.props.FloatProperty(name="Lively to calm", default=0.8, min=0, max=1, subtype="FACTOR",
                                  description="0: swings on after a key; 1: comes to rest without a swing")
    loop: bpy.props.BoolProperty(name="Loop", default=False, description="The last frame leads into the first")
    modes: bpy.props.IntProperty(name="Modes", default=20, min=1, max=200)
    tolerance: bpy.props.FloatProperty(name="Tolerance", default=0.05, min=1e-4, max=1)
    endpoint: bpy.props.StringProperty(name="Server", description="Of a limberd that runs; empty: one is found or started")
    binary: bpy.props.StringProperty(name="limberd", subtype="FILE_PATH",
                                     description="The program to start; empty: $LIMBER_BIN, or on the PATH")
    cache_path: bpy.props.StringProperty(name="Cache", subtype="FILE_PATH", default="//motion.pc2")


class Panel(bpy.types.Panel):
    bl_idname = "VIEW3D_PT_limber"
    bl_label = "limber"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "limber"

    def draw(self, context):
        layout, settings, object = self.layout, context.scene.limber, context.object
        link = LINKS.get(object.get("limber_object", object.name)) if object else None
        if link is None:
            layout.prop(settings, "tets")
            layout.prop(settings, "youngs_modulus")
            if object:
                layout.prop_search(settings, "stiff_group", object, "vertex_groups")
                layout.prop(settings, "stiffest")
            for name in ("density", "period", "calm", "loop", "modes", "tolerance", "endpoint", "binary"):
                layout.prop(settings, name)
            layout.label(text=f'The vertex group "{FIXED}" is held')
            layout.operator("limber.start")
            return
        layout.label(text=f"{link.name}: {link.live.state}")
        if link.live.error:
            layout.label(text=link.live.error, icon="ERROR")
        layout.prop(settings, "calm")
        layout.prop(settings, "loop")
        layout.operator("limber.add_handle")
        if object.get("limber_object"):
            layout.prop(object, '["limber_exact"]', text="Exact")
            layout.prop(object, '["limber_hold"]', text="Held for frames")
            layout.label(text="Location keys: more frames")
        layout.prop(settings, "cache_path")
        layout.operator("limber.bake_shape_keys")
        layout.operator("limber.bake_cache")
        layout.operator("limber.stop")


CLASSES = (Settings, Panel)


def register():
    for made in CLASSES:
        bpy.utils.register_class(made)
    bpy.types.Scene.limber = bpy.props.PointerProperty(type=Settings)


def unregister():
    del bpy.types.Scene.limber
    for made in reversed(CLASSES):
        bpy.utils.unregister_class(made)

"""Blender add-on: a mesh object becomes an elastic body, empties hold it, and its motion follows while they are dragged.

Modules that know bpy: this one, panel, operators, scene_link. The others run anywhere.
"""

bl_info = {
    "name": "limber",
    "author": "the limber project",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "View3D > Sidebar > limber",
    "description": "Elastic motions, edited live",
    "category": "Animation",
}

import pathlib
import sys

# The Python client comes in the zip, in the same folder as this package's modules.
_LIBRARY = pathlib.Path(__file__).parent / "lib"
if _LIBRARY.is_dir() and str(_LIBRARY) not in sys.path:
    sys.path.append(str(_LIBRARY))


def register():
    from . import operators, panel
    panel.register()
    operators.register()


def unregister():
    from . import operators, panel
    operators.unregister()
    panel.unregister()

"""limber: elastic motion, edited live.

A thin client of `limberd`: it uploads scenes, sends edits of space-time constraints, waits for results and turns
streamed coordinates into numpy arrays. Lengths are in the scene's length unit, frames and nodes count from 0.

    import limber
    with limber.launch() as server:                # or limber.connect() to a running limberd
        session = server.open(sample="beam")
        tip = session.add(node=1336, frame=75, displacement=(0, 0.1, 0))
        print(session.wait().energy)
        positions = session.frames()               # (frames, nodes, 3)
"""

from . import beam_edits
from .beam_sessions import BeamGeometry, BeamResult, BeamSession, beam_scene
from .beams import BeamSnap, BeamSolution
from .designs import Design, DesignInfo, DesignTerms, Erection, OtherOptimum, Placement, StartingGrid
from .edits import Axes, add, dynamics, ends, move, optimise, redo, remove, replace, reset_material, undo
from .errors import LimberError, ServerRestarted, ServerStopped, ServerUnreachable
from .exports import Export
from .keyframes import Keyframe, add_keyframe, keyframe, move_keyframe, remove_keyframe
from .linkage_shapes import LinkageGeometry, Shape
from .linkages import LinkageResult, LinkageSession, LinkageStep, Target, linkage_scene
from .launching import LaunchedServer, launch
from .motions import base_motion
from .pictures import picture
from .recoveries import Recovery
from .results import Geometry, Material, Mode, MotionError, Result
from .mesh_files import mesh_file
from .scenes import load_scene, scene_from_arrays, scene_from_mesh
from .server import DEFAULT_ENDPOINT, Server, connect
from .kinds import register_kind
from .open_session import AccuracyWarning, MaterialWarning, OpenSession, Receipt
from .session import Constraint, Session
from .simulations import Simulation, force, simulation
from .stream import FrameStream, StreamedFrames

__version__ = "0.1.0"

__all__ = [
    "AccuracyWarning", "Axes", "BeamGeometry", "BeamResult", "BeamSession", "BeamSnap", "BeamSolution", "Constraint", "DEFAULT_ENDPOINT", "Design", "DesignInfo", "DesignTerms", "Erection", "Export", "FrameStream", "Geometry", "Keyframe", "LaunchedServer",
    "LimberError", "LinkageGeometry", "LinkageResult", "LinkageSession", "LinkageStep", "Material", "MaterialWarning", "Mode", "MotionError", "OpenSession", "OtherOptimum", "Placement", "Receipt", "Recovery", "Result", "Server", "ServerRestarted", "ServerStopped", "ServerUnreachable", "Session", "Shape",
    "Simulation", "StartingGrid", "StreamedFrames", "Target", "add", "add_keyframe", "base_motion", "beam_edits", "beam_scene", "connect", "dynamics", "ends", "force",
    "keyframe", "launch", "linkage_scene", "load_scene", "mesh_file", "move", "move_keyframe", "optimise", "picture", "redo", "register_kind", "remove",
    "remove_keyframe", "replace", "reset_material", "scene_from_arrays", "scene_from_mesh", "simulation", "undo",
]

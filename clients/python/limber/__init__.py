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

from . import version
from .access import AllowedKey
from .beams import edits as beam_edits
from .beams.geometry import BeamGeometry
from .beams.results import BeamResult
from .beams.scenes import beam_scene
from .beams.session import BeamSession
from .beams.solutions import BeamNeutralDirection, BeamSnap, BeamSolution, StrengthWarning
from .bodies.edits import Axes, add, dynamics, ends, liveliness, move, move_pins, optimise, remove, replace, reset_material
from .bodies.embedding import Embedding
from .bodies.geometry import Geometry
from .bodies.keyframes import Keyframe, add_keyframe, keyframe, move_keyframe, remove_keyframe
from .bodies.material import Material, Mode
from .bodies.modal import Modal, ModalMotion
from .bodies.motions import animated_pins, base_motion
from .bodies.picking import SurfacePoint
from .bodies.recoveries import Recovery
from .bodies.scenes import scene_from_arrays, scene_from_mesh
from .bodies.stiffness import painted_stiffness
from .bodies.session import Constraint, Session
from .bodies.simulations import Simulation, force, simulation
from .browsing import SessionPage
from .edits import redo, undo
from .errors import LimberError, ServerRestarted, ServerStopped, ServerUnreachable
from .exports import Export
from .files import mesh_file
from .kind import register_kind
from .laths import Hole, Lath, Laths
from .launching import LaunchedServer, launch
from .linkages.designs import Design, DesignInfo, DesignTerms, Erection, OtherOptimum
from .linkages.goals import Placement
from .linkages.grids import StartingGrid
from .linkages.pictures import picture
from .linkages.results import LinkageResult, LinkageStep
from .linkages.scenes import linkage_scene
from .linkages.session import LinkageSession, Target
from .linkages.shapes import LinkageGeometry, Shape
from .linkages.solutions import LinkageSolution
from .motion import MotionStream, MotionUpdate
from .open_session import AccuracyWarning, MaterialWarning, OpenSession, Receipt, SnapWarning
from .presence import RevisionMade, SessionClient
from .results import DiscretisationError, MotionError, OutOfReach, Result, StartComparison
from .saving import Saved
from .scenes import load_scene
from .server import DEFAULT_ENDPOINT, Server, connect
from .stream import FrameStream, StreamedFrames

__version__ = version.PACKAGE

__all__ = [
    "AccuracyWarning", "AllowedKey", "Axes", "BeamGeometry", "BeamNeutralDirection", "BeamResult", "BeamSession", "BeamSnap", "BeamSolution", "Constraint",
    "DEFAULT_ENDPOINT", "Design", "DesignInfo", "DesignTerms", "DiscretisationError", "Embedding", "Erection", "Export",
    "FrameStream", "Geometry", "Hole", "Keyframe", "Lath", "Laths", "LaunchedServer", "LimberError", "LinkageGeometry", "LinkageResult",
    "LinkageSession", "LinkageSolution", "LinkageStep", "Material", "MaterialWarning", "Modal", "ModalMotion", "Mode", "MotionError", "MotionStream",
    "MotionUpdate", "OpenSession", "OtherOptimum", "OutOfReach", "Placement", "Receipt", "Recovery", "Result", "RevisionMade", "Saved", "Server",
    "ServerRestarted", "ServerStopped", "ServerUnreachable", "Session", "SessionClient", "SessionPage", "Shape", "Simulation", "SnapWarning",
    "StartComparison", "StartingGrid", "StreamedFrames", "StrengthWarning", "SurfacePoint", "Target", "add",
    "add_keyframe", "animated_pins", "base_motion", "beam_edits", "beam_scene", "connect", "dynamics", "ends", "force", "keyframe",
    "launch", "linkage_scene", "liveliness", "load_scene", "mesh_file", "move", "move_keyframe", "move_pins", "optimise", "painted_stiffness", "picture", "redo",
    "register_kind", "remove", "remove_keyframe", "replace", "reset_material", "scene_from_arrays", "scene_from_mesh",
    "simulation", "undo",
]

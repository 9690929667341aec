"""The generated messages, or a sentence that says how to generate them."""

try:
    from .v1 import access_pb2 as access
    from .v1 import beam_structure_pb2 as beam_structure
    from .v1 import beams_pb2 as beams
    from .v1 import common_pb2 as common
    from .v1 import design_pb2 as design
    from .v1 import follow_pb2 as follow
    from .v1 import parts_pb2 as parts
    from .v1 import presence_pb2 as presence
    from .v1 import scene_pb2 as scene
    from .v1 import service_pb2 as service
    from .v1 import stream_pb2 as stream
except ImportError as error:
    raise ImportError(
        "the messages of limber.v1 are not usable here: build limber once (scripts/build), which writes "
        f"limber/v1/*_pb2.py, and use a Python with protobuf >= 3.20 ({error})") from error

__all__ = ["access", "beam_structure", "beams", "common", "design", "follow", "parts", "presence", "scene", "service", "stream"]

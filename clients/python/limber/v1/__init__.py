"""The messages of limber.v1; the build generates the *_pb2 modules in this folder."""

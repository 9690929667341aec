"""The registry: a row for each kind, and the requests that single kinds have. The only module, besides the package itself, that
knows the kinds' folders."""

from . import kind
from .beams.kind import Beams
from .beams.requests import BeamRequests
from .bodies.kind import Bodies
from .bodies.requests import BodyRequests
from .linkages.kind import Linkages
from .linkages.requests import LinkageRequests

kind.add("bodies", Bodies())
kind.add("beams", Beams())
kind.add("linkages", Linkages())


class KindRequests(BodyRequests, LinkageRequests, BeamRequests):
    """Requests to a server, besides sessions, that are of one kind each."""

"""Requests about elastic bodies besides sessions: filled surfaces, simulations, recoveries."""

from __future__ import annotations

import os

import numpy as np

from .. import arrays, checks, scenes
from ..files import mesh_file
from ..messages import scene as scene_messages
from ..messages import service
from ..open_session import warn_of_material
from ..progress import ProgressOption
from ..results import issue_text
from ..server_core import ServerCore
from . import recoveries, simulations


class FilledSurface(tuple):
    """`nodes, tets = filled`; `filled.report` has the tets, distances [length unit], their share of the body's length,
    and the volumes."""

    report: "service.TetrahedralizationReport"

    def __new__(cls, nodes: np.ndarray, tets: np.ndarray, report: "service.TetrahedralizationReport"):
        filled = super().__new__(cls, (nodes, tets))
        filled.report = report
        return filled

    @property
    def nodes(self) -> np.ndarray:
        return self[0]

    @property
    def tets(self) -> np.ndarray:
        return self[1]


class BodyRequests(ServerCore):
    """Requests to a server that concern elastic bodies alone."""

    def tetrahedralize(self, surface: "str | os.PathLike[str]", tets: int = 5000, progress: ProgressOption = None,
                       timeout: float = 600.0, within: float = 0.02) -> "FilledSurface":
        """Nodes (n x 3) and tets (m x 4) that fill a closed triangle surface (.obj, .ply, .stl, .off, .glb), and as `.report` how
        near they are to it.

        within: largest distance between the surface and that of the tets, in either direction, as a share of the body's length
        (diagonal of its bounding box), in (0, 1]. If `tets` do not keep it, a LimberError states a sufficient number; 1 allows
        any distance.
        """
        checks.seconds(timeout, "timeout")
        request = service.TetrahedralizeRequest(surface=mesh_file(checks.path(surface, "surface")),
                                                target_tets=checks.whole(tets, "tets"),
                                                within=checks.real(within, "within"))
        job = self.connection.call("tetrahedralize", request, timeout=60.0).job
        try:
            done = self.wait_job(job, progress, timeout)
        except KeyboardInterrupt:
            self.cancel_job(job)
            raise
        return FilledSurface(arrays.to_numpy(done.mesh.nodes, "nodes"), arrays.to_numpy(done.mesh.tets, "tets"),
                             done.tetrahedralization)

    def simulate(self, scene: scenes.SceneLike, simulation: "scene_messages.Simulation | None" = None,
                 progress: ProgressOption = None, timeout: float = 3600.0) -> simulations.Simulation:
        """The motion of the body without reduction (St. Venant-Kirchhoff material) under loads: positions (frames x
        nodes x 3) and a report.

        simulation: made by limber.simulation(); default that of the scene. The motion has the scene's frames; its base motion is
        not looked at. Ctrl-C while waiting, and the end of `timeout` [s], cancel the job.
        """
        checks.seconds(timeout, "timeout")
        request = simulations.request(scene, simulation)
        response = self.connection.call("simulate", request, timeout=max(60.0, self.connection.timeout))
        warn_of_material(response.issues)
        done = self._wait_or_cancel(response.job, progress, timeout)
        part_bytes = min(simulations.PART_BYTES, self.info().limits.message_bytes)
        return simulations.fetch(done, tuple(issue_text(issue) for issue in response.issues), part_bytes,
                                 lambda wanted: self.connection.call("get_frames", wanted, timeout=120.0))

    def recover(self, scene: scenes.SceneLike, *, variables: str = "all", modes: int | None = None,
                candidate_modes: int | None = None, recovered_frames: int = 0, driven_frames: int = 0,
                total_frames: int = 0, weight: float = 1.0, column_weight: float = 1e-8, start: str = "principal",
                progress: ProgressOption = None, timeout: float = 3600.0) -> recoveries.Recovery:
        """The material of the scene's base motion (frequencies, damping, mixed modes) from its first recovered_frames (default:
        the first half). Also how the motion continues with it without forces, up to total_frames (default: those of the base
        motion).

        variables: "motion" (forces alone), "dynamics" (and frequencies and damping) or "all" (and the modes, as mixtures of
        candidate_modes); modes, candidate_modes: in place of the scene's; driven_frames: number of first frames in which forces
        are known to act; weight: gamma, how closely poses are followed; column_weight: mu; start: "principal" (principal
        components of the motion) or "spectrum". Constraints are ignored. Ctrl-C while waiting, and the end of `timeout` [s],
        cancel the job.
        """
        checks.seconds(timeout, "timeout")
        request = recoveries.request(scene, variables=variables, modes=modes, candidate_modes=candidate_modes,
                                     recovered_frames=recovered_frames, driven_frames=driven_frames,
                                     total_frames=total_frames, weight=weight, column_weight=column_weight, start=start)
        response = self.connection.call("recover", request, timeout=max(60.0, self.connection.timeout))
        warn_of_material(response.issues)
        done = self._wait_or_cancel(response.job, progress, timeout)
        part_bytes = min(simulations.PART_BYTES, self.info().limits.message_bytes)
        positions = simulations.fetch_positions(response.job, done.recovery.frames, part_bytes,
                                                lambda wanted: self.connection.call("get_frames", wanted, timeout=120.0))
        return recoveries.made_of(done, positions, tuple(issue_text(issue) for issue in response.issues))

"""Requests about rod linkages besides sessions: starting grids, and designs from a surface alone."""

from __future__ import annotations

import warnings
from contextlib import contextmanager
from typing import Any, Iterator, Sequence

import numpy as np

from .. import checks
from ..errors import LimberError, invalid
from ..messages import scene as scene_messages
from ..progress import ProgressOption
from ..server_core import ServerCore
from .designs import Design
from .goals import sorted_options
from .grids import StartingGrid, grid_request
from .scenes import linkage_scene, put_section
from .session import LinkageSession


class LinkageRequests(ServerCore):
    """Requests to a server that concern rod linkages alone."""

    def starting_grid(self, surface: Any, *, columns: int | None = None, rows: int | None = None,
                      flat_angle: float | None = None, margin: float | None = None,
                      translation: Sequence[float] | None = None, rotation: Sequence[float] | None = None,
                      scale: float | None = None, section: Any = None,
                      drive: float | None = None) -> StartingGrid:
        """Two families of straight rods for a patch of surface without holes. They lie flat without stress. Their directions
        change from rod to rod, so that the grid leaves its plane when it opens, to about the surface. For a design of which only
        the surface is known: limber.linkage_scene(grid.vertices, grid.edges, section=..), then session.deploy(grid.mean_angle).

        surface, translation, rotation, scale: as LinkageSession.design(). `columns`, `rows`: joints of rods along the patch's
        longer sides and of those across (8). `flat_angle`: angle at which rods cross when it lies flat [degree] (25). `margin`:
        share of the patch that is left free at its rim (0.02). `section`: of the rods, as linkage_scene() takes it; grids whose
        rods would overlap are refused, and rods that are too stiff to leave the plane, or not stiff enough sideways. `drive`:
        factor of the surface's curvature for which the rods are drawn, since they resist; None: as the section needs it, else 3.
        """
        request = grid_request(surface, columns, rows, flat_angle, margin, translation, rotation, scale, drive)
        if section is not None:
            put_section(section, request.section)
        return StartingGrid.from_message(self.connection.call("make_starting_grid", request, timeout=120.0))

    def open_grid(self, grid: "StartingGrid", *, section: Any, session: str = "", edges_per_segment: int = 6,
                  progress: ProgressOption = None, timeout: float = 600.0, **options: Any) -> LinkageSession:
        """Opens a starting grid as a session: flat, deployed to its angle on the surface, and pushed to the surface's side until
        it is there (RodLinkage.erection). It is held in its middle. `section`: that the grid was made with; edges_per_segment,
        options: of limber.linkage_scene().
        """
        if grid.push.size == 0:
            raise invalid("grid", "make the grid with section=, so that it is known what pushes it to its side")
        if options.get("stiff_axis", "as_given") == "d2":
            raise invalid("stiff_axis", "grids leave their plane with rods that are stiffer sideways, which d2 is not")
        scene = linkage_scene(grid.vertices, grid.edges, section=section, edges_per_segment=edges_per_segment, **options)
        linkage = scene.linkage
        linkage.conditions.mean_angle_degrees = linkage.erection.mean_angle_degrees = grid.mean_angle
        middle = len(grid.vertices) // grid.columns // 2 * grid.columns + grid.columns // 2
        linkage.conditions.pins.add(joint=middle, held=scene_messages.HELD_MOTION)
        modulus = linkage.material.youngs_modulus if linkage.material.HasField("youngs_modulus") else 10e9
        unit = scene.length_unit_in_metres if scene.HasField("length_unit_in_metres") else 1.0
        for joint in np.flatnonzero(grid.push):
            linkage.erection.push.add(joint=int(joint)).force.z = modulus * unit ** 2 * grid.push[joint]
        opened = self.open(scene, session=session, progress=progress, timeout=timeout)
        with self._closing(opened):
            if opened.wait(timeout=timeout).solve_failed:
                raise LimberError("FAILED_PRECONDITION", "the grid does not open to the angle that it has on the "
                                  "surface: try fewer rods, another flat_angle or another section", "surface")
        return opened

    @staticmethod
    @contextmanager
    def _closing(opened: LinkageSession) -> "Iterator[None]":
        """Closes the session if a later request is refused."""
        try:
            yield
        except BaseException:
            opened.close()
            raise

    def design_surface(self, surface: Any, *, columns: int | None = None, rows: int | None = None, section: Any,
                       flat_angle: float | None = None, margin: float | None = None, scale: float | None = None,
                       session: str = "", edges_per_segment: int = 6, progress: ProgressOption = None,
                       timeout: float = 600.0, design: Any = None, **options: Any) -> "Design":
        """A linkage for a patch of surface, from the surface alone: starting_grid(), open_grid(), and a design that begins
        with the surface put where the grid fits. Its `session` is the linkage. Warns where something will obstruct
        the design (StartingGrid.remark), and where the linkage is unlikely large (its issues).

        surface, columns, rows, flat_angle, margin: as starting_grid(). section, edges_per_segment and options of
        limber.linkage_scene(): as there. Options of LinkageSession.design(), as max_iterations, go to the design; so do
        those of the dict `design`. The flat shape is held at flat_angle, and smallest_angle is half of that where it
        is not given.
        """
        linkage, wanted = sorted_options(options, design, linkage_scene, LinkageSession.design)
        flat_angle = 25.0 if flat_angle is None else checks.real(flat_angle, "flat_angle")
        grid = self.starting_grid(surface, columns=columns, rows=rows, flat_angle=flat_angle, margin=margin,
                                  scale=scale, section=section)
        if grid.remark:
            warnings.warn(grid.remark, stacklevel=2)
        opened = self.open_grid(grid, section=section, session=session, edges_per_segment=edges_per_segment,
                                progress=progress, timeout=timeout, **linkage)
        for issue in opened.issues:
            warnings.warn(issue, stacklevel=2)
        with self._closing(opened):
            return opened.design(surface, scale=scale, fitted_points=grid.deployed, flat_angle=flat_angle,
                                 **{"smallest_angle": 0.5 * flat_angle, **wanted})

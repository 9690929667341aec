"""What acts on a structure from outside is in balance: a check of every solution that a test fetches.

Reactions, loads, springs and weights of a converged result sum to zero, to a share of 1e-6 of the sum of their sizes. It is not
checked where it need not hold:
- the result has not converged, or is not that of the newest revision;
- of beams: loads that turn with cables, or with elements whose ends are hinged, since no answer says how those have turned;
- of beams: an answer to a coarser tolerance than 1e-6.

Both solvers balance to a share of 1e-8 of the forces that are present at nodes and joints, those within rods and beams among them,
and these are rounded as stretches are. Where that is far more than what acts from outside, as in structures that are
stressed by themselves or moved without resistance, the sum has it for a bound. The relaxation leaves a share of 1e-6 at every
node."""

import contextlib

import limber
import numpy as np
import pytest
from limber.beams.structures import structure_of
from limber.messages import beam_structure

SHARE = 1e-6
SOLVER = 1e-8  # of the forces within
ROUNDING = 4 * np.finfo(float).eps  # of a stretch


def sizes(forces):
    return float(np.linalg.norm(np.reshape(forces, (-1, 3)), axis=1).sum())


def demand_balance(where, forces, within, share=SHARE, rounding=0.0):
    """forces: arrays of rows x 3 [N]; within: sum of the sizes of the forces in the structure [N]; rounding: of these [N]."""
    left = float(np.linalg.norm(sum(np.reshape(some, (-1, 3)).sum(axis=0) for some in forces)))
    allowed = share * sum(map(sizes, forces)) + SOLVER * within + rounding
    assert left <= allowed, f"{where}: what acts from outside sums to {left:.3g} N, allowed are {allowed:.3g} N"


def check_linkage(solution):
    is_stretched = np.abs(solution.axial_strains) > 0
    stiffness = np.abs(solution.axial_forces[is_stretched] / solution.axial_strains[is_stretched]).sum()
    demand_balance(f"a linkage at revision {solution.revision}",
                   (solution.reaction_forces, solution.loads, solution.spring_forces, solution.weights),
                   sizes(solution.end_forces), rounding=ROUNDING * stiffness)


def vector(message):
    return np.array([message.x, message.y, message.z])


def turned(quaternion, force):
    w, axis = quaternion[0], quaternion[1:]
    return force + 2 * np.cross(axis, np.cross(axis, force) + w * force)


def area(section):
    if section.HasField("tube"):
        return np.pi * (section.tube.outer_radius ** 2 - section.tube.inner_radius ** 2)
    return section.rectangle.width * section.rectangle.height


def rest_length(structure, element):
    drawn = np.linalg.norm(vector(structure.nodes[element.finish].position) - vector(structure.nodes[element.start].position))
    return element.rest_length or drawn


def loads_of_beams(structure, solution):
    """Rows of three [N]; None: not known from the answer."""
    rows = [turned(solution.rotations[load.node], vector(load.force)) if load.follows else vector(load.force)
            for load in structure.loads]
    gravity = vector(structure.gravity)
    for element in structure.elements:
        section = structure.sections[element.section]
        rows.append(gravity * section.density * area(section) * rest_length(structure, element))
    for load in structure.distributed_loads:
        element = structure.elements[load.element]
        force = vector(load.force) * rest_length(structure, element)
        if load.follows:
            hinged = element.start_release.rotations or element.finish_release.rotations
            if element.kind == beam_structure.BEAM_KIND_CABLE or hinged:
                return None
            force = sum(turned(solution.rotations[node], force) for node in (element.start, element.finish)) / 2
        rows.append(force)
    return np.reshape(rows, (-1, 3))


def check_beams(structure, solution, tolerance=None):
    loads = loads_of_beams(structure, solution)
    if not solution.converged or loads is None or (tolerance or 0) > SHARE:
        return
    within = float(np.abs(solution.axial_forces).sum() + np.abs(solution.shear_forces).sum())
    stiffness = sum(structure.sections[element.section].young * area(structure.sections[element.section])
                    for element in structure.elements)
    share = SHARE * (len(structure.nodes) if solution.method == "relaxation" else 1)
    demand_balance("beams", (solution.reaction_forces, loads), within, share, ROUNDING * stiffness)


def newest_result(session):
    """The newest revision, and whether its result is there and has converged."""
    status = session.status()
    result = session.result_of(status.result)
    is_converged = result.converged and not result.solve_failed and result.revision == status.revision
    return status.revision, is_converged


@contextlib.contextmanager
def checked_balances():
    """Meanwhile every solution that is fetched is checked."""
    of_linkage, of_beams, solve = limber.LinkageSession.solution, limber.BeamSession.solution, limber.Server.solve_beams

    def linkage_solution(self, *args, **options):
        solution = of_linkage(self, *args, **options)
        revision, is_converged = newest_result(self)
        if is_converged and solution.converged and solution.revision == revision:
            check_linkage(solution)
        return solution

    def beam_solution(self, *args, **options):
        before = newest_result(self)
        solution = of_beams(self, *args, **options)
        structure = self.structure()
        if before[1] and newest_result(self) == before:
            check_beams(structure, solution)
        return solution

    def solve_beams(self, structure, **options):
        solution = solve(self, structure, **options)
        read = structure_of(structure)
        if isinstance(read, beam_structure.BeamStructure):  # the files of a job are read by the server alone
            check_beams(read, solution, options.get("tolerance"))
        return solution

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(limber.LinkageSession, "solution", linkage_solution)
        patch.setattr(limber.BeamSession, "solution", beam_solution)
        patch.setattr(limber.Server, "solve_beams", solve_beams)
        yield

"""Edits of elastic bodies as values, for Session.edit([...])."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterable, Mapping, Sequence, Union

from .. import checks
from ..edits import PartialEdit, Vector, vector
from ..errors import invalid
from ..messages import scene, service
from .motions import animated_pins
from .picking import SurfacePointLike, to_message

Axes = Union[str, None]  # "x", "yz", ...; None: all three

_AXES = {"x": scene.AXIS_X, "y": scene.AXIS_Y, "z": scene.AXIS_Z}
ENDS = {
    "free": scene.END_CONDITION_FREE,
    "position": scene.END_CONDITION_PINNED_POSITION,
    "position_velocity": scene.END_CONDITION_PINNED_POSITION_VELOCITY,
    "cyclic": scene.END_CONDITION_CYCLIC,
}
PathLike = Iterable["tuple[int, Vector | None]"]  # (frame, target), target None: where the key before is


def constraint(*, frame: int, node: int | None = None, nodes: Iterable[int] | None = None,
               surface_point: SurfacePointLike | None = None, surface_vertex: int | None = None,
               position: Vector | None = None, displacement: Vector | None = None, velocity: Vector | None = None,
               axes: Axes = None, weight: float | None = None, exact: bool = False, until: int | None = None,
               path: PathLike | None = None, ease_in: float | None = None, ease_out: float | None = None,
               reach: float | None = None, id: int = 0) -> "scene.Constraint":
    """"In this frame, the mean position of these nodes is there", or their mean velocity is that.

    until: a hold, the target counts in every frame from `frame` to this one; path: further keys (frame, target) in place of it,
    targets of the same kind. The constraint acts in every frame of the path, moves between keys without overshoot and rests
    between two equal keys. `ease_in`, `ease_out` in [0, 1] (default 1) are the extent to which it begins and ends at rest.

    reach [s]: how far in time it acts; frames farther from its own keep the motion that is there without it.

    node, nodes, surface_point: a SurfacePoint, or (triangle, (w0, w1, w2)) of the surface that is shown (with a third
    member "mesh" or "carried": of that one), or surface_vertex: of the surface that the scene names (exactly one of the four);
    position: a point of the mesh's space; displacement: from the rest position [length unit]; velocity: of the shown
    frames, (x[frame + 1] - x[frame - 1]) / 2 * frames per second [length unit / s] (exactly one of the three); weight: gamma > 0 of a soft constraint (default 100); exact: hold exactly instead.
    """
    if sum(what is not None for what in (node, nodes, surface_point, surface_vertex)) != 1:
        raise invalid("nodes", "give one of node, nodes, surface_point and surface_vertex")
    targets = {"position": position, "displacement": displacement, "velocity": velocity}
    given = [(name, target) for name, target in targets.items() if target is not None]
    if len(given) != 1:
        raise invalid("target", "give one of position, displacement and velocity")
    if checks.flag(exact, "exact") and weight is not None:
        raise invalid("weight", "an exact constraint has no weight")
    message = scene.Constraint(id=_id(id), frame=checks.whole(frame, "frame"))
    if surface_point is not None:
        message.point.CopyFrom(to_message(surface_point))
    elif surface_vertex is not None:
        message.surface_vertex = checks.whole(surface_vertex, "surface_vertex")
    else:
        message.nodes.extend([checks.whole(node, "node")] if nodes is None else checks.wholes(nodes, "nodes"))
    if axes is not None:
        message.axes.extend(_axes(axes))
    name, target = given[0]
    getattr(message, name).CopyFrom(vector(target, name))
    if exact:
        message.exact = True
    elif weight is not None:
        message.weight = checks.real(weight, "weight")
    _add_path(message, until, path)
    for name, value in (("ease_in", ease_in), ("ease_out", ease_out), ("reach", reach)):
        if value is not None:
            setattr(message, name, checks.real(value, name))
    return message


def _add_path(message: "scene.Constraint", until: int | None, path: PathLike | None) -> None:
    if until is not None and path is not None:
        raise invalid("path", "give one of until and path")
    if until is not None:
        path = [(until, None)]
    for frame, target in path or ():
        key = message.path.add(frame=checks.whole(frame, "path"))
        if target is not None:
            key.target.CopyFrom(vector(target, "path"))


def keys_of(message: "scene.Constraint") -> "list[tuple[int, Any]]":
    """(frame, target) of each key, the first one among them."""
    kind = message.WhichOneof("target") or "displacement"
    keys = [(message.frame, getattr(message, kind))]
    for key in message.path:
        keys.append((key.frame, key.target if key.HasField("target") else keys[-1][1]))
    return keys


def move_path(message: "scene.Constraint", target: Any) -> None:
    """Keys behind the first, as the session moves them when that is moved to `target`."""
    (_, first), *further = keys_of(message)
    places = [[getattr(at, axis) + getattr(target, axis) - getattr(first, axis) for axis in "xyz"] for _, at in further]
    for key, (x, y, z) in zip(message.path, places):
        key.target.x, key.target.y, key.target.z = x, y, z


def retimed(message: "scene.Constraint", shift: int, first: int | None, last: int | None) -> "scene.Constraint":
    begin = message.frame
    end = message.path[-1].frame if message.path else begin
    if shift and (first is not None or last is not None):
        raise invalid("shift", "give shift, or first and last")
    new_begin = checks.whole(begin + shift, "shift") if first is None else checks.whole(first, "first")
    new_end = end + shift if last is None else checks.whole(last, "last")
    if not message.path:
        new_end = new_begin
    stretch = (new_end - new_begin) / (end - begin) if message.path else 0.0
    made = scene.Constraint()
    made.CopyFrom(message)
    made.frame = new_begin
    for key in made.path:
        key.frame = max(0, round(new_begin + stretch * (key.frame - begin)))
    return made


def _axes(axes: str) -> list[int]:
    if not isinstance(axes, str) or not axes or len(set(axes)) != len(axes) or any(axis not in _AXES for axis in axes):
        raise invalid("axes", f'axes are one to three of "xyz", e.g. "xz", not {axes!r}')
    return [_AXES[axis] for axis in axes]


def add(**what: Any) -> "service.Edit":
    """Adds a constraint; see limber.bodies.edits.constraint for the arguments."""
    return service.Edit(add=service.AddConstraint(constraint=constraint(**what)))


def move(constraint: Any, target: Vector) -> "service.Edit":
    """Gives a constraint (a Constraint or its id) another target, of the kind it has."""
    return service.Edit(move=service.MoveConstraint(id=_id(constraint), target=vector(target, "target")))


def replace(constraint_id: Any, **what: Any) -> "service.Edit":
    """Puts another constraint in the place of one, under the same id."""
    return service.Edit(replace=service.ReplaceConstraint(constraint=constraint(id=_id(constraint_id), **what)))


def remove(constraint: Any) -> "service.Edit":
    """Removes a constraint (a Constraint or its id)."""
    return service.Edit(remove=service.RemoveConstraint(id=_id(constraint)))


def ends(first: str, last: str | None = None) -> "service.Edit":
    """End conditions of the motion: "free", "position" or "position_velocity"; or ends("cyclic"), a loop, in which the first
    frame follows the last one."""
    last = "cyclic" if last is None and first == "cyclic" else last
    for name, value in (("first", first), ("last", last)):
        checks.one_of(value, ENDS, name)
    return service.Edit(set_ends=service.SetEnds(first_end=ENDS[first], last_end=ENDS[last]))


def move_pins(positions: Any) -> "service.Edit":
    """Animated pins in place of the scene's base motion: paths of its fixed nodes, frames x fixed nodes x 3 in their order
    [length unit], as limber.animated_pins(). None: the scene's base motion again."""
    edit = service.Edit(set_pins=service.SetPins())
    if positions is not None:
        edit.set_pins.pins.CopyFrom(animated_pins(positions).pins)
    return edit


@dataclass(frozen=True)
class DynamicsChange(PartialEdit):
    """Some of the dynamics; the session that takes it keeps the others."""

    values: Mapping[str, float]

    def complete(self, earlier: "Sequence[service.Edit]", known: "scene.Scene", field: str) -> "service.Edit":
        if any(edit.WhichOneof("edit") in ("undo", "redo") for edit in earlier):
            raise invalid(field, "dynamics() behind undo() or redo() keeps values that are not known yet: send it in an "
                                 "edit of its own")
        set_before = [edit.set_dynamics for edit in earlier if edit.HasField("set_dynamics")]
        made = service.Edit()
        made.set_dynamics.CopyFrom(set_before[-1] if set_before else known.dynamics)
        for name, value in self.values.items():
            setattr(made.set_dynamics, name, value)
        return made


def liveliness(calm: float) -> "dict[str, float]":
    """damping_ratio and force_smoothing [s] of one number, from 0 (lively) to 1 (calm); 0.8 has the defaults.

    For dynamics(**liveliness(0.5)) and scene_from_mesh(path, **liveliness(0.5)). The page's control has the same numbers.
    """
    share = checks.real(calm, "calm") / 0.8
    if not 0 <= calm <= 1:
        raise invalid("calm", f"calm must be in [0, 1], is {calm}")
    return {"damping_ratio": min(0.95, 0.05 * (0.7 / 0.05) ** share), "force_smoothing": 0.1 * (0.5 / 0.1) ** share}


DISCRETISATIONS = {
    "sampled": scene.TIME_DISCRETISATION_SAMPLED,
    "differences": scene.TIME_DISCRETISATION_DIFFERENCES,
}


def dynamics(*, frames_per_second: float | None = None, period_frames: float | None = None,
             damping_ratio: float | None = None, discretisation: str | None = None,
             force_smoothing: float | None = None, inertia: float | None = None) -> DynamicsChange:
    """Frequency and damping of the body's motion; options that are not given stay unchanged.

    discretisation: "sampled" (free motion is exact at the frames) or "differences" (the published form). `force_smoothing` [s]:
    about the time in which control forces change; inertia in [0, 10]: under a base motion, 1 lags behind as a body would, 0
    follows.
    """
    values = {"frames_per_second": frames_per_second, "period_frames": period_frames, "damping_ratio": damping_ratio,
              "force_smoothing": force_smoothing, "inertia": inertia}
    given = {name: checks.real(value, name) for name, value in values.items() if value is not None}
    if discretisation is not None:
        given["discretisation"] = DISCRETISATIONS[checks.one_of(discretisation, DISCRETISATIONS, "discretisation")]
    if not given:
        raise invalid("dynamics", f"give at least one of {', '.join(values)}, discretisation")
    return DynamicsChange(given)


VARIABLES = {
    "motion": scene.MATERIAL_VARIABLES_MOTION,
    "dynamics": scene.MATERIAL_VARIABLES_DYNAMICS,
    "all": scene.MATERIAL_VARIABLES_ALL,
}


def optimise(variables: str) -> "service.Edit":
    """Variables that are optimised from now on: "motion" (control forces, the fitted material frozen), "dynamics" (and
    frequencies and damping) or "all" (and the modes)."""
    return service.Edit(set_material=service.SetMaterial(
        variables=VARIABLES[checks.one_of(variables, VARIABLES, "variables")]))


def reset_material() -> "service.Edit":
    """Discards fitted values: the scene's own material."""
    return service.Edit(reset_material=service.ResetMaterial())


def _id(constraint: Any) -> int:
    return checks.whole(getattr(constraint, "id", constraint), "id", most=2 ** 64 - 1)

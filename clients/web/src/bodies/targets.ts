import type { MessageInitShape } from "@bufbuild/protobuf";
import { Vector3 } from "three";
import { Axis, type Constraint, type ConstraintSchema } from "../../gen/limber/v1/scene_pb";
import type { Basis } from "./basis";
import { targetIn } from "./paths";
import { placeOf, type WeightedNodes } from "./places";

export type ConstraintInit = Exclude<MessageInitShape<typeof ConstraintSchema>, Constraint>;

export const AXES = [
  ["x", Axis.X],
  ["y", Axis.Y],
  ["z", Axis.Z],
] as const;

/** Target position of a constraint in one of its frames; null: its target is a velocity. */
export function targetPosition(
  constraint: Constraint,
  held: WeightedNodes,
  basis: Basis,
  frame = constraint.frame,
): Vector3 | null {
  const { target } = constraint;
  if (target.case === "velocity" || target.case === undefined) return null;
  const position = new Vector3(...targetIn(constraint, frame));
  return target.case === "position" ? position : position.add(new Vector3(...basis.restMean(held.nodes, held.weights)));
}

/** A position in one of a constraint's frames in its own kind of target: that of its first frame, by which it is moved. */
export function asTarget(
  constraint: Constraint,
  held: WeightedNodes,
  point: Vector3,
  basis: Basis,
  frame = constraint.frame,
): { x: number; y: number; z: number } {
  const there = targetIn(constraint, frame);
  const first = targetIn(constraint, constraint.frame);
  const rest = constraint.target.case === "displacement" ? basis.restMean(held.nodes, held.weights) : [0, 0, 0];
  const along = (axis: 0 | 1 | 2): number => point.getComponent(axis) - (rest[axis] ?? 0) + first[axis] - there[axis];
  return { x: along(0), y: along(1), z: along(2) };
}

/** As it is, to be changed and sent back whole. */
export function copy(constraint: Constraint): ConstraintInit {
  return {
    id: constraint.id,
    frame: constraint.frame,
    ...placeOf(constraint),
    axes: [...constraint.axes],
    target: constraint.target,
    enforcement: constraint.enforcement,
    path: [...constraint.path],
    easeIn: constraint.easeIn,
    easeOut: constraint.easeOut,
    reach: constraint.reach,
  };
}

import type { MessageInitShape } from "@bufbuild/protobuf";
import { Vector3 } from "three";
import { Axis, type Constraint, type ConstraintSchema } from "../../gen/limber/v1/scene_pb";
import type { Basis } from "./basis";
import { placeOf, type WeightedNodes } from "./places";

export type ConstraintInit = Exclude<MessageInitShape<typeof ConstraintSchema>, Constraint>;

export const AXES = [
  ["x", Axis.X],
  ["y", Axis.Y],
  ["z", Axis.Z],
] as const;

/** Where a constraint wants what it holds to be; null: it is of a velocity. */
export function targetPosition(constraint: Constraint, held: WeightedNodes, basis: Basis): Vector3 | null {
  const { target } = constraint;
  if (target.case === "position") return new Vector3(target.value.x, target.value.y, target.value.z);
  if (target.case !== "displacement") return null;
  const rest = basis.restMean(held.nodes, held.weights);
  return new Vector3(rest[0] + target.value.x, rest[1] + target.value.y, rest[2] + target.value.z);
}

/** A position in the constraint's own kind of target. */
export function asTarget(
  constraint: Constraint,
  held: WeightedNodes,
  point: Vector3,
  basis: Basis,
): { x: number; y: number; z: number } {
  if (constraint.target.case !== "displacement") return { x: point.x, y: point.y, z: point.z };
  const rest = basis.restMean(held.nodes, held.weights);
  return { x: point.x - rest[0], y: point.y - rest[1], z: point.z - rest[2] };
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
  };
}

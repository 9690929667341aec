import type { MessageInitShape } from "@bufbuild/protobuf";
import { type Constraint, PointSurface, type SurfacePointSchema } from "../../gen/limber/v1/scene_pb";
import type { Reals } from "../wire/arrays";
import type { Basis } from "./basis";
import type { Carried } from "./carried";

/** Held place of a constraint: a group of nodes, or in their place a point or a vertex of a surface. */
export interface Place {
  nodes: number[];
  point?: MessageInitShape<typeof SurfacePointSchema>;
  surfaceVertex?: number;
}

/** A mean of nodes with weights; null: equal ones. */
export interface WeightedNodes {
  nodes: readonly number[];
  weights: readonly number[] | null;
}

/** The surfaces that points are of. */
export interface Surfaces {
  /** Triangles of the mesh: three nodes a triangle. */
  readonly triangles: ArrayLike<number>;
  readonly carried: Carried | null;
}

export function placeOf(constraint: Constraint): Place {
  const { nodes, point, surfaceVertex } = constraint;
  return { nodes, ...(point && { point }), ...(surfaceVertex !== undefined && { surfaceVertex }) };
}

/** The nodes that a place moves with. */
export function weightedNodes(place: Place, { triangles, carried }: Surfaces): WeightedNodes {
  if (place.surfaceVertex !== undefined) return carried ? carried.weightedNodes(place.surfaceVertex) : NONE;
  const { point } = place;
  if (!point) return { nodes: place.nodes, weights: null };
  const weights = point.weights ?? [];
  const first = 3 * (point.triangle ?? 0);
  const isOfMesh = point.surface === PointSurface.MESH || (point.surface !== PointSurface.CARRIED && !carried);
  if (isOfMesh) return { nodes: [0, 1, 2].map((corner) => triangles[first + corner] ?? 0), weights };
  if (!carried) return NONE;
  const corners = weights.map((weight, corner) => {
    const held = carried.weightedNodes(carried.triangles[first + corner] ?? 0);
    return { nodes: held.nodes, weights: held.weights.map((share) => weight * share) };
  });
  return { nodes: corners.flatMap(({ nodes }) => nodes), weights: corners.flatMap((corner) => corner.weights) };
}

const NONE: WeightedNodes = { nodes: [], weights: null };

/** Position of a place. */
export function positionOf(held: WeightedNodes, basis: Basis, coordinates: Reals): [number, number, number] {
  return basis.mean(held.nodes, coordinates, held.weights);
}

export function describePlace({ nodes, point, surfaceVertex }: Place): string {
  if (point) return `point of triangle ${point.triangle ?? 0}`;
  if (surfaceVertex !== undefined) return `surface vertex ${surfaceVertex}`;
  return nodes.length === 1 ? `node ${nodes[0]}` : `${nodes.length} nodes`;
}

/** The same place: dragging it again moves the constraint. */
export function isSamePlace(a: Place, b: Place): boolean {
  return (
    a.nodes.length === b.nodes.length &&
    a.nodes.every((node, i) => node === b.nodes[i]) &&
    a.surfaceVertex === b.surfaceVertex &&
    a.point?.triangle === b.point?.triangle &&
    a.point?.surface === b.point?.surface &&
    (a.point?.weights ?? []).join() === (b.point?.weights ?? []).join()
  );
}

import { DataUtils } from "three";

/** Largest relative error of a half float here (DataUtils cuts off), and the absolute one of values near 0. */
const ROUNDING = 2 ** -10;
const LEAST = 2 ** -24;

/** Rows of a basis, three a node: values[(3 node + axis) * columns + column]. */
export interface Columns {
  readonly values: Float32Array;
  readonly columns: number;
}

/** The largest absolute value of each column in the rows of some nodes; 1 if all are 0. Dividing by it avoids overflow. */
export function columnSizes({ values, columns }: Columns, nodes: Uint32Array): Float32Array {
  const sizes = new Float32Array(columns);
  for (const node of nodes)
    for (let at = 3 * node * columns, row = 0; row < 3; row++)
      for (let k = 0; k < columns; k++, at++) sizes[k] = Math.max(sizes[k] ?? 0, Math.abs(values[at] ?? 0));
  return sizes.map((size) => size || 1);
}

/**
 * Bound of position errors of nodes along an axis if a basis, its columns divided by their sizes, is rounded to half
 * floats. It holds for coordinates up to these in absolute value.
 */
export function halfError(
  { values, columns }: Columns,
  nodes: Uint32Array,
  sizes: Float32Array,
  coordinates: Float32Array,
): number {
  let nearZero = 0;
  for (let k = 0; k < columns; k++) nearZero += LEAST * (sizes[k] ?? 1) * (coordinates[k] ?? 0);
  let most = 0;
  for (const node of nodes) {
    for (let at = 3 * node * columns, row = 0; row < 3; row++) {
      let sum = 0;
      for (let k = 0; k < columns; k++, at++) sum += Math.abs(values[at] ?? 0) * (coordinates[k] ?? 0);
      most = Math.max(most, sum);
    }
  }
  return most * ROUNDING + nearZero;
}

/** A value that its column's size was divided out of, |share| <= 1. */
export function toHalf(share: number): number {
  return DataUtils.toHalfFloat(share);
}

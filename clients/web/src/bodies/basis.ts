import type { Array as ArrayMessage } from "../../gen/limber/v1/common_pb";
import { floats } from "../wire/arrays";

/** positions = rest + basis . coordinates, on the CPU: for points that are picked, constrained or traced. */
export class Basis {
  readonly rest: Float32Array;
  /** (3 node + axis) * columns + column */
  readonly values: Float32Array;
  readonly columns: number;

  constructor(rest: ArrayMessage | undefined, basis: ArrayMessage | undefined) {
    this.rest = floats(rest);
    this.values = floats(basis);
    this.columns = Number(basis?.shape.at(-1) ?? 0);
  }

  get nodes(): number {
    return this.rest.length / 3;
  }

  /** Writes the position of a node into `out` at `at`. */
  position(node: number, coordinates: Float32Array, out: Float32Array | number[], at = 0): void {
    for (let axis = 0; axis < 3; axis++) {
      let sum = this.rest[3 * node + axis] ?? 0;
      const row = (3 * node + axis) * this.columns;
      for (let k = 0; k < this.columns; k++) sum += (this.values[row + k] ?? 0) * (coordinates[k] ?? 0);
      out[at + axis] = sum;
    }
  }

  /** Of some nodes, x y z each. */
  positions(nodes: Uint32Array, coordinates: Float32Array): Float32Array {
    const made = new Float32Array(3 * nodes.length);
    nodes.forEach((node, i) => {
      this.position(node, coordinates, made, 3 * i);
    });
    return made;
  }

  /** Mean position of some nodes; with weights, whose sum is 1, their weighted mean. */
  mean(
    nodes: readonly number[],
    coordinates: Float32Array,
    weights: readonly number[] | null = null,
  ): [number, number, number] {
    const sum: [number, number, number] = [0, 0, 0];
    const one = [0, 0, 0];
    nodes.forEach((node, i) => {
      const weight = weights ? (weights[i] ?? 0) : 1 / nodes.length;
      if (weight === 0) return;
      this.position(node, coordinates, one);
      for (let axis = 0; axis < 3; axis++) sum[axis as 0] += weight * (one[axis] ?? 0);
    });
    return sum;
  }

  restMean(nodes: readonly number[], weights: readonly number[] | null = null): [number, number, number] {
    return this.mean(nodes, new Float32Array(this.columns), weights);
  }
}

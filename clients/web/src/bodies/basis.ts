import type { Array as ArrayMessage } from "../../gen/limber/v1/common_pb";
import { doubles, floats, type Reals, reals } from "../wire/arrays";

/** positions = rest + basis . coordinates, on the CPU: for points that are picked, constrained or traced. */
export class Basis {
  /** Relative to `origin`: single precision, as the GPU has it, is enough there. */
  readonly rest: Float32Array;
  /** Zero but of bodies far from the scene's origin. */
  readonly origin: readonly [number, number, number];
  /** (3 node + axis) * columns + column */
  readonly values: Float32Array;
  readonly columns: number;

  constructor(rest: ArrayMessage | undefined, basis: ArrayMessage | undefined) {
    const given = reals(rest);
    this.origin = given instanceof Float64Array ? [given[0] ?? 0, given[1] ?? 0, given[2] ?? 0] : [0, 0, 0];
    this.rest = Float32Array.from(doubles(rest), (value, i) => value - (this.origin[(i % 3) as 0] ?? 0));
    this.values = floats(basis);
    this.columns = Number(basis?.shape.at(-1) ?? 0);
  }

  get nodes(): number {
    return this.rest.length / 3;
  }

  /** Writes the position of a node into `out` at `at`. */
  position(node: number, coordinates: Reals, out: Float64Array | number[], at = 0): void {
    this.relative(node, coordinates, out, at);
    for (let axis = 0; axis < 3; axis++) out[at + axis] = (out[at + axis] ?? 0) + (this.origin[axis as 0] ?? 0);
  }

  /** The same, relative to `origin`. */
  relative(node: number, coordinates: Reals, out: Float32Array | Float64Array | number[], at = 0): void {
    for (let axis = 0; axis < 3; axis++) {
      let sum = this.rest[3 * node + axis] ?? 0;
      const row = (3 * node + axis) * this.columns;
      for (let k = 0; k < this.columns; k++) sum += (this.values[row + k] ?? 0) * (coordinates[k] ?? 0);
      out[at + axis] = sum;
    }
  }

  /** Positions of some nodes, x y z each. */
  positions(nodes: Uint32Array, coordinates: Reals): Float64Array {
    const made = new Float64Array(3 * nodes.length);
    nodes.forEach((node, i) => {
      this.position(node, coordinates, made, 3 * i);
    });
    return made;
  }

  /** Mean position of some nodes; with weights, whose sum is 1, their weighted mean. */
  mean(
    nodes: readonly number[],
    coordinates: Reals,
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

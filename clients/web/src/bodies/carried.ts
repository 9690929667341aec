import type { CarriedSurface } from "../../gen/limber/v1/service_pb";
import { floats, integers } from "../wire/arrays";

/** A surface that a body carries: each vertex is a weighted sum of the positions of four nodes. */
export class Carried {
  readonly name: string;
  /** Nodes that vertices hang on, ascending. */
  readonly nodes: Uint32Array;
  /** vertices x 4, indices into `nodes`. */
  readonly corners: Uint32Array;
  /** vertices x 4 */
  readonly weights: Float32Array;
  readonly triangles: Uint32Array;
  /** The largest sum of absolute weights of a vertex: errors of nodes are at most so much larger in vertices. */
  readonly amplification: number;

  constructor(message: CarriedSurface) {
    this.name = message.name;
    const corners = integers(message.nodes);
    this.weights = floats(message.weights);
    this.triangles = Uint32Array.from(integers(message.triangles));
    this.nodes = Uint32Array.from([...new Set(corners)].sort((a, b) => a - b));
    const compact = new Map([...this.nodes].map((node, i) => [node, i]));
    this.corners = Uint32Array.from(corners, (node) => compact.get(node) ?? 0);
    let most = 1;
    for (let at = 0; at < this.weights.length; at += 4) {
      let sum = 0;
      for (let c = 0; c < 4; c++) sum += Math.abs(this.weights[at + c] ?? 0);
      most = Math.max(most, sum);
    }
    this.amplification = most;
  }

  get vertices(): number {
    return this.weights.length / 4;
  }

  /** Positions of vertices, x y z each, of those of `nodes`; `stride` numbers a vertex in `out`. */
  positions<Out extends Float32Array | Float64Array>(nodes: ArrayLike<number>, out: Out, stride = 3): Out {
    for (let vertex = 0; vertex < this.vertices; vertex++) {
      for (let axis = 0; axis < 3; axis++) {
        let sum = 0;
        for (let c = 4 * vertex; c < 4 * vertex + 4; c++)
          sum += (this.weights[c] ?? 0) * (nodes[3 * (this.corners[c] ?? 0) + axis] ?? 0);
        out[stride * vertex + axis] = sum;
      }
    }
    return out;
  }

  /** The four nodes of a vertex and their weights. */
  weightedNodes(vertex: number): { nodes: number[]; weights: number[] } {
    const corners = [0, 1, 2, 3].map((c) => 4 * vertex + c);
    return {
      nodes: corners.map((c) => this.nodes[this.corners[c] ?? 0] ?? 0),
      weights: corners.map((c) => this.weights[c] ?? 0),
    };
  }

  /** The node that a vertex follows most. */
  nodeOf(vertex: number): number {
    let best = 4 * vertex;
    for (let c = best + 1; c < 4 * vertex + 4; c++) if ((this.weights[c] ?? 0) > (this.weights[best] ?? 0)) best = c;
    return this.nodes[this.corners[best] ?? 0] ?? 0;
  }
}

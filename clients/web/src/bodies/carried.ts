import type { CarriedSurface } from "../../gen/limber/v1/service_pb";
import { floats, fromFloats, integers } from "../wire/arrays";
import { Basis } from "./basis";

/** What is drawn of a body: vertices with a basis of their own. */
export interface Drawn {
  basis: Basis;
  triangles: Uint32Array;
}

/** A surface that the body carries: each vertex moves as the weighted mean of four nodes, and so do its rows of the basis. */
export function carriedSurface(carried: CarriedSurface, body: Basis): Drawn {
  const rest = floats(carried.vertices);
  const nodes = integers(carried.nodes);
  const weights = floats(carried.weights);
  const { columns } = body;
  const count = rest.length / 3;
  const values = new Float32Array(3 * count * columns);
  for (let vertex = 0; vertex < count; vertex++) {
    for (let corner = 4 * vertex; corner < 4 * vertex + 4; corner++) {
      const weight = weights[corner] ?? 0;
      const from = 3 * (nodes[corner] ?? 0) * columns;
      const to = 3 * vertex * columns;
      // Rows of x, y and z follow each other.
      for (let i = 0; i < 3 * columns; i++)
        values[to + i] = (values[to + i] ?? 0) + weight * (body.values[from + i] ?? 0);
    }
  }
  const basis = new Basis(fromFloats(rest, [count, 3]), fromFloats(values, [count, 3, columns]));
  return { basis, triangles: Uint32Array.from(integers(carried.triangles)) };
}

import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { CarriedSurfaceSchema } from "../gen/limber/v1/service_pb";
import { Basis } from "../src/bodies/basis";
import { carriedSurface } from "../src/bodies/carried";
import { fromFloats, fromIntegers } from "../src/wire/arrays";

test("a carried vertex moves as the weighted mean of its nodes, in every column", () => {
  const rest = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1);
  const values = Float32Array.from({ length: 24 }, (_, i) => Math.sin(i)); // 4 nodes, 2 columns
  const body = new Basis(fromFloats(rest, [4, 3]), fromFloats(values, [4, 3, 2]));
  const weights = [0.5, 0.25, 0.5, -0.25, 0, 0, 1, 0];
  const vertices = [0, 1].flatMap((vertex) =>
    [0, 1, 2].map((axis) =>
      [0, 1, 2, 3].reduce((sum, k) => sum + (weights[4 * vertex + k] ?? 0) * (rest[3 * k + axis] ?? 0), 0),
    ),
  );
  const { basis, triangles } = carriedSurface(
    create(CarriedSurfaceSchema, {
      vertices: fromFloats(Float32Array.from(vertices), [2, 3]),
      triangles: fromIntegers(Int32Array.of(0, 1, 0), [1, 3]),
      nodes: fromIntegers(Int32Array.of(0, 1, 2, 3, 0, 1, 2, 3), [2, 4]),
      weights: fromFloats(Float32Array.from(weights), [2, 4]),
    }),
    body,
  );
  assert.deepEqual([...triangles], [0, 1, 0]);
  const coordinates = Float32Array.of(0.7, -1.3);
  const position = (of: Basis, node: number): number[] => {
    const out = [0, 0, 0];
    of.position(node, coordinates, out);
    return out;
  };
  for (const vertex of [0, 1]) {
    const expected = [0, 1, 2].map((axis) =>
      [0, 1, 2, 3].reduce((sum, k) => sum + (weights[4 * vertex + k] ?? 0) * (position(body, k)[axis] ?? 0), 0),
    );
    position(basis, vertex).forEach((value, axis) => {
      assert.ok(Math.abs(value - (expected[axis] ?? 0)) < 1e-6);
    });
  }
});

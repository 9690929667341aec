import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { CarriedSurfaceSchema } from "../gen/limber/v1/service_pb";
import { Carried } from "../src/bodies/carried";
import { fromFloats, fromIntegers } from "../src/wire/arrays";

test("vertices of a carried surface are weighted sums of four nodes, and stand for the one they follow most", () => {
  const carried = new Carried(
    create(CarriedSurfaceSchema, {
      name: "skin.obj",
      nodes: fromIntegers(Int32Array.from([9, 2, 5, 7, 5, 7, 9, 11]), [2, 4]),
      weights: fromFloats(Float32Array.from([0.25, 0.75, 0, 0, 1.5, -0.5, 0, 0]), [2, 4]),
      triangles: fromIntegers(Int32Array.from([0, 1, 0]), [1, 3]),
    }),
  );
  assert.deepEqual([...carried.nodes], [2, 5, 7, 9, 11]);
  assert.deepEqual([carried.vertices, carried.amplification], [2, 2]);
  assert.deepEqual([carried.nodeOf(0), carried.nodeOf(1)], [2, 5]);
  const nodes = Float32Array.from([4, 0, 0, 0, 2, 0, 0, 4, 0, 8, 0, 1, 99, 99, 99]);
  assert.deepEqual([...carried.positions(nodes, new Float32Array(6))], [5, 0, 0.25, 0, 1, 0]);
  assert.deepEqual([...carried.positions(nodes, new Float32Array(8), 4)], [5, 0, 0.25, 0, 0, 1, 0, 0]);
});

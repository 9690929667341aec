import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { ConstraintSchema, PointSurface } from "../gen/limber/v1/scene_pb";
import { CarriedSurfaceSchema } from "../gen/limber/v1/service_pb";
import { Basis } from "../src/bodies/basis";
import { Carried } from "../src/bodies/carried";
import { describePlace, isSamePlace, placeOf, positionOf, weightedNodes } from "../src/bodies/places";
import { copy, targetPosition } from "../src/bodies/targets";
import { fromFloats, fromIntegers } from "../src/wire/arrays";

const triangles = [0, 1, 2, 2, 1, 3];
const carried = new Carried(
  create(CarriedSurfaceSchema, {
    name: "skin.obj",
    nodes: fromIntegers(Int32Array.from([0, 1, 2, 3, 3, 2, 1, 0, 0, 1, 2, 3]), [3, 4]),
    weights: fromFloats(Float32Array.from([0.5, 0.5, 0, 0, 1.5, -0.5, 0, 0, 0, 0, 0, 1]), [3, 4]),
    triangles: fromIntegers(Int32Array.from([2, 1, 0]), [1, 3]),
  }),
);
/** Node 0 at the origin, 1, 2, 3 on the axes; the only column lifts node 3. */
const basis = new Basis(
  fromFloats(Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]), [4, 3]),
  fromFloats(Float32Array.from([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2]), [4, 3, 1]),
);
const at = (place: Parameters<typeof weightedNodes>[0], withCarried = true): number[] =>
  positionOf(weightedNodes(place, { triangles, carried: withCarried ? carried : null }), basis, Float32Array.from([1]));

test("places are where their nodes and weights put them", () => {
  const point = { triangle: 1, weights: [0.25, 0.25, 0.5] };
  assert.deepEqual(at({ nodes: [1, 3] }), [0.5, 0, 1.5]);
  assert.deepEqual(at({ nodes: [], point: { ...point, surface: PointSurface.MESH } }), [0.25, 0.25, 1.5]);
  assert.deepEqual(at({ nodes: [], point }, false), [0.25, 0.25, 1.5]);
  assert.deepEqual(at({ nodes: [], surfaceVertex: 1 }), [0, -0.5, 4.5]);
  const ofSkin = { triangle: 0, weights: [0.5, 0.5, 0], surface: PointSurface.CARRIED };
  assert.deepEqual(at({ nodes: [], point: ofSkin }), [0, -0.25, 3.75]);
  assert.deepEqual(at({ nodes: [], point: { triangle: 0, weights: [0.5, 0.5, 0] } }), [0, -0.25, 3.75]);
});

test("constraints keep what they name when they are changed, and their targets are measured from there", () => {
  const constraint = create(ConstraintSchema, {
    id: 3n,
    point: { triangle: 1, weights: [0.5, 0.5, 0], surface: PointSurface.MESH },
    target: { case: "displacement", value: { x: 0, y: 0, z: 2 } },
  });
  const place = placeOf(constraint);
  const held = weightedNodes(place, { triangles, carried });
  assert.deepEqual(targetPosition(constraint, held, basis)?.toArray(), [0.5, 0.5, 2]);
  assert.deepEqual(copy(constraint).point?.weights, [0.5, 0.5, 0]);
  assert.equal("surfaceVertex" in copy(constraint), false);
  const vertex = create(ConstraintSchema, { surfaceVertex: 0 });
  assert.equal(copy(vertex).surfaceVertex, 0);
  assert.ok(isSamePlace(place, placeOf(constraint)) && !isSamePlace(place, placeOf(vertex)));
  assert.deepEqual([place, placeOf(vertex), { nodes: [7] }, { nodes: [7, 8] }].map(describePlace), [
    "point of triangle 1",
    "surface vertex 0",
    "node 7",
    "2 nodes",
  ]);
});

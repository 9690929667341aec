import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { Vector3 } from "three";
import { BeamSolutionSchema } from "../gen/limber/v1/beams_pb";
import { ArraySchema, DataType } from "../gen/limber/v1/common_pb";
import { DIAGRAM_CHOICES, type DiagramOf, diagramOf, forcesOf, patchesOf } from "../src/beams/diagram";

/** Rows of element_forces: N, T, V2, V3, M2 and M3 at the start, M2 and M3 at the finish. */
function solution(...rows: number[][]) {
  const data = new Uint8Array(Float64Array.from(rows.flat()).buffer);
  const elementForces = create(ArraySchema, { type: DataType.FLOAT64, shape: [BigInt(rows.length), 8n], data });
  return create(BeamSolutionSchema, { elementForces });
}

const ROWS = [
  [10, 1, -4, 6, 2, 3, -2, 5],
  [-20, 0.5, 4, 0, -2, 5, 0, -8],
];

test("diagrams have the numbers of the solution", () => {
  const of = (kind: DiagramOf) => [...(diagramOf(solution(...ROWS), kind, 2)?.values ?? [])];
  assert.deepEqual(of("axial"), [10, 10, -20, -20]);
  assert.deepEqual(of("torque"), [1, 1, 0.5, 0.5]);
  assert.deepEqual(of("shear2"), [-4, -4, 4, 4]);
  assert.deepEqual(of("shear3"), [6, 6, 0, 0]);
  assert.deepEqual(of("moment2"), [2, -2, -2, 0]);
  assert.deepEqual(of("moment3"), [3, 5, 5, -8]);
  const moment = diagramOf(solution(...ROWS), "moment3", 2);
  assert.deepEqual([moment?.low, moment?.high, moment?.largest, moment?.unit], [-8, 5, 8, "N m"]);
  assert.equal(diagramOf(solution(...ROWS), "none", 2), null);
  assert.deepEqual(
    forcesOf(solution(...ROWS), 1).map(([, start, finish]) => [start, finish]),
    [
      [-20, -20],
      [0.5, 0.5],
      [4, 4],
      [0, 0],
      [-2, 0],
      [5, -8],
    ],
  );
  assert.equal(DIAGRAM_CHOICES.length, 7);
});

test("rounding beside large forces is no diagram", () => {
  const pulled = solution([1e4, 0, 1e-6, 0, 2e-9, 0, -3e-9, 0]);
  assert.equal(diagramOf(pulled, "axial", 1)?.largest, 1e4);
  for (const kind of ["shear2", "moment2", "torque"] as const) assert.equal(diagramOf(pulled, kind, 1)?.largest, 0);
});

test("a diagram is drawn beside its beam, its parts of one sign", () => {
  const stations = [0, 1, 2].map((x) => ({ point: new Vector3(x, 0, 0), axis: new Vector3(0, 0, 1) }));
  const patches = patchesOf(stations, 3, -1, 0.1);
  assert.deepEqual(
    patches.map(({ base, tip, isPositive }) => [base[0].x, base[1].x, tip[0].z, tip[1].z, isPositive]).map(rounded),
    [
      [0, 1, 0.3, 0.1, true],
      [1, 1.5, 0.1, 0, true],
      [1.5, 2, 0, -0.1, false],
    ],
  );
  assert.deepEqual(rounded(patchesOf(stations, 2, 2, 0.5).map(({ tip }) => tip[1].z)), [1, 1]);
});

function rounded(values: (number | boolean)[]): (number | boolean)[] {
  return values.map((value) => (typeof value === "number" ? Math.round(value * 1e9) / 1e9 + 0 : value));
}

import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { Vector3 } from "three";
import { BeamSolutionSchema } from "../gen/limber/v1/beams_pb";
import { ArraySchema, DataType } from "../gen/limber/v1/common_pb";
import { DIAGRAM_CHOICES, type DiagramOf, diagramOf, forcesOf, patchesOf } from "../src/beams/diagram";
import { type ColorBy, valuesOf } from "../src/beams/solution";

const array = (shape: number[], values: number[]) =>
  create(ArraySchema, {
    type: DataType.FLOAT64,
    shape: shape.map(BigInt),
    data: new Uint8Array(Float64Array.from(values).buffer),
  });

/** Three stations of N, T, V2, V3, M2, M3, stress, utilisation; extremes: of the six, the smallest and the largest value. */
function solution(stations: number[][][], extremes: [number, number][][]) {
  return create(BeamSolutionSchema, {
    stations: array([stations.length, 3, 8], stations.flat(2)),
    elementExtremes: array(
      [extremes.length, 6, 4],
      extremes.flat().flatMap(([least, largest]) => [least, 0.25, largest, 0.75]),
    ),
  });
}

const STATIONS = [
  [
    [10, 1, -4, 6, 2, 3, 100, 0.1],
    [10, 1, 0, 6, 5, 4, 300, 0.3],
    [10, 1, 4, 6, -2, 5, 200, 0.2],
  ],
  [
    [-20, 0.5, 4, 0, -2, 5, 0, 0],
    [-10, 0.5, 4, 0, -1, -3, 0, 0],
    [0, 0.5, 4, 0, 0, -8, 0, 0],
  ],
];
const EXTREMES: [number, number][][] = [
  [
    [10, 10],
    [1, 1],
    [-4, 4],
    [6, 6],
    [-2, 5.5],
    [3, 5],
  ],
  [
    [-20, 0],
    [0.5, 0.5],
    [4, 4],
    [0, 0],
    [-2, 0],
    [-8, 5],
  ],
];

test("diagrams have the stations of the solution, and its extremes within elements", () => {
  const made = solution(STATIONS, EXTREMES);
  const of = (kind: DiagramOf) => (diagramOf(made, kind, 2)?.values ?? []).map((values) => [...values]);
  assert.deepEqual(of("axial"), [
    [10, 10, 10],
    [-20, -10, 0],
  ]);
  assert.deepEqual(of("shear2"), [
    [-4, 0, 4],
    [4, 4, 4],
  ]);
  assert.deepEqual(of("moment2"), [
    [2, 5, -2],
    [-2, -1, 0],
  ]);
  const moment = diagramOf(made, "moment2", 2);
  assert.deepEqual([moment?.low, moment?.high, moment?.largest, moment?.unit], [-2, 5.5, 5.5, "N m"]);
  assert.equal(diagramOf(made, "none", 2), null);
  assert.deepEqual(
    forcesOf(made, 1).map(([, least, largest]) => [least, largest]),
    EXTREMES[1],
  );
  assert.equal(DIAGRAM_CHOICES.length, 7);
});

test("colours show quantities along elements", () => {
  const values = (by: ColorBy) => [...(valuesOf(solution(STATIONS, EXTREMES), by, 2)?.of ?? [])];
  assert.deepEqual(values("stress"), [100, 300, 200, 0, 0, 0]);
  assert.deepEqual(rounded(values("utilisation").slice(0, 3)), [10, 30, 20]);
  assert.deepEqual(values("axial"), [10, 10, 10, -20, -10, 0]);
  assert.equal(Math.round(1e3 * (values("bending")[1] ?? 0)), 6403);
  assert.equal(valuesOf(solution(STATIONS, EXTREMES), "none", 2), null);
});

test("rounding beside large forces is no diagram", () => {
  const row = [1e4, 0, 1e-6, 0, 2e-9, 0, 0, 0];
  const pulled = solution(
    [[row, row, row]],
    [
      [
        [1e4, 1e4],
        [0, 0],
        [1e-6, 1e-6],
        [0, 0],
        [-3e-9, 2e-9],
        [0, 0],
      ],
    ],
  );
  assert.equal(diagramOf(pulled, "axial", 1)?.largest, 1e4);
  for (const kind of ["shear2", "moment2", "torque"] as const) assert.equal(diagramOf(pulled, kind, 1)?.largest, 0);
});

test("a diagram is drawn beside its beam, its parts of one sign", () => {
  const stations = [0, 1, 2].map((x) => ({ point: new Vector3(x, 0, 0), axis: new Vector3(0, 0, 1) }));
  const patches = patchesOf(stations, [3, -1], 0.1);
  assert.deepEqual(
    patches.map(({ base, tip, isPositive }) => [base[0].x, base[1].x, tip[0].z, tip[1].z, isPositive]).map(rounded),
    [
      [0, 1, 0.3, 0.1, true],
      [1, 1.5, 0.1, 0, true],
      [1.5, 2, 0, -0.1, false],
    ],
  );
  assert.deepEqual(rounded(patchesOf(stations, [2, 2], 0.5).map(({ tip }) => tip[1].z)), [1, 1]);
  const parabola = patchesOf(stations, [0, 3, 4, 3, 0], 0.5);
  assert.deepEqual(rounded(parabola.map(({ tip }) => tip[1].z)), [1.5, 2, 1.5, 0]);
});

function rounded(values: (number | boolean)[]): (number | boolean)[] {
  return values.map((value) => (typeof value === "number" ? Math.round(value * 1e9) / 1e9 + 0 : value));
}

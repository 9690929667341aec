import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { BeamStructureSchema } from "../gen/limber/v1/beam_structure_pb";
import { DataType } from "../gen/limber/v1/common_pb";
import { GetGeometryResponseSchema } from "../gen/limber/v1/service_pb";
import { BeamShapes } from "../src/beams/shape";
import { Basis } from "../src/bodies/basis";
import { LinkageShapes } from "../src/linkages/shape";
import { normalize } from "../src/rods/colors";
import { counterclockwise } from "../src/rods/sweep";
import { fromDoubles, fromFloats, fromIntegers } from "../src/wire/arrays";

const near = (value: number | undefined, wanted: number, allowed = 1e-5): void =>
  assert.ok(Math.abs((value ?? Number.NaN) - wanted) <= allowed, `${value} is not ${wanted}`);

test("positions are rest and basis times coordinates", () => {
  const basis = new Basis(
    fromFloats(Float32Array.from([1, 2, 3, 0, 0, 0]), [2, 3]),
    fromFloats(Float32Array.from([1, 0, 0, 1, 0, 0, 2, 2, 0, 0, 0, 0]), [2, 3, 2]),
  );
  const out = [0, 0, 0];
  basis.position(0, Float32Array.from([10, 20]), out);
  assert.deepEqual(out, [11, 22, 3]);
  assert.deepEqual(basis.mean([0, 1], Float32Array.from([10, 20])), [35.5, 11, 1.5]);
});

/** One rod of four edges along a circle of radius 2, its director turning by 0.1 an edge. */
test("far from the origin a basis keeps the digits of positions, and what goes to the GPU is small", () => {
  const far = [5e5, 4.6e6, 100];
  const basis = new Basis(
    fromDoubles(Float64Array.from([...far, 5e5 + 0.1, 4.6e6 + 0.2, 100.3]), [2, 3]),
    fromFloats(new Float32Array(0), [2, 3, 0]),
  );
  const out = [0, 0, 0];
  basis.position(1, new Float32Array(0), out);
  assert.deepEqual(
    out.map((value, axis) => Number((value - (far[axis] ?? 0)).toFixed(6))),
    [0.1, 0.2, 0.3],
  );
  assert.deepEqual(
    [...basis.rest].map((value) => Number(value.toFixed(6))),
    [0, 0, 0, 0.1, 0.2, 0.3],
  );
  assert.deepEqual(basis.origin, far);
});

function arc(lengthUnit?: number): { shapes: LinkageShapes; frame: Float32Array } {
  const edges = 4;
  const step = 0.05;
  const points = Array.from({ length: edges + 1 }, (_, i) => [2 * Math.sin(step * i), 2 * Math.cos(step * i), 0]);
  const directors = Array.from({ length: edges }, (_, i) => {
    const along = step * (i + 0.5);
    const radial = [Math.sin(along), Math.cos(along), 0];
    const turn = 0.1 * i;
    return radial.map((part, axis) => Math.cos(turn) * part + (axis === 2 ? Math.sin(turn) : 0));
  });
  const geometry = create(GetGeometryResponseSchema, {
    linkage: {
      coordinates: 6 * edges + 3 + 2,
      edges: [edges],
      jointsOfSegment: fromIntegers(Int32Array.from([0, 1]), [1, 2]),
      vertexOfJoint: [0, 1],
      outline: {
        type: DataType.FLOAT64,
        shape: [3n, 2n],
        data: new Uint8Array(Float64Array.from([0, 0, 0, 1, 1, 0]).buffer),
      },
    },
  });
  return {
    shapes: new LinkageShapes(geometry, lengthUnit),
    frame: Float32Array.from([...points.flat(), ...directors.flat(), Math.PI / 2, Math.PI]),
  };
}

test("a linkage's frame has joints, angles, curvature and twist", () => {
  const { shapes, frame } = arc();
  assert.ok(shapes.fits(frame));
  const [first] = shapes.jointPositions(frame);
  near(first?.x, Math.sin(0.05));
  assert.deepEqual([...shapes.angles(frame)].map(Math.round), [90, 180]);
  const shape = shapes.shape(frame, null);
  for (const curvature of shapes.curvatures(shape)) near(curvature, 0.5, 1e-3);
  for (const twist of shapes.twists(shape)) near(twist, 0.1 / (2 * 2 * Math.sin(0.025)), 2e-3);
  near(shapes.anglesAlong(frame)[2], 135, 1e-3);
});

test("curvature and twist are per metre, whatever the length unit is", () => {
  const [metres, millimetres] = [arc(), arc(1e-3)];
  const values = ({ shapes, frame }: ReturnType<typeof arc>): number[] => {
    const shape = shapes.shape(frame, null);
    return [shapes.curvatures(shape)[1] ?? 0, shapes.twists(shape)[1] ?? 0];
  };
  values(metres).forEach((value, i) => {
    near(values(millimetres)[i], 1000 * value, 1e-2);
  });
});

test("outlines are drawn counterclockwise", () => {
  const { shapes } = arc();
  assert.deepEqual(
    shapes.outline,
    counterclockwise([
      [1, 0],
      [0, 1],
      [0, 0],
    ]),
  );
});

test("an element between nodes that turn bends as a cubic", () => {
  const geometry = create(GetGeometryResponseSchema, {
    rest: fromFloats(Float32Array.from([0, 0, 0, 1, 0, 0]), [2, 3]),
    beams: { nodes: 2, elements: fromIntegers(Int32Array.from([0, 1]), [1, 2]) },
  });
  const structure = create(BeamStructureSchema, { elements: [{ start: 0, finish: 1 }], nodes: [{}, {}] });
  const shapes = new BeamShapes(geometry, structure);
  const turn = 0.2; // about y, both ways: the middle rises or falls
  const [c, s] = [Math.cos(turn / 2), Math.sin(turn / 2)];
  const frame = Float32Array.from([0, 0, 0, c, 0, -s, 0, 1, 0, 0, c, 0, s, 0]);
  const { line, directors } = shapes.shape(frame, null);
  const middle = shapes.drawnEdges / 2;
  near(line[4 * middle], 0.5);
  near(line[4 * middle + 2], Math.sin(turn) / 4);
  near(Math.abs(directors[4 * middle + 1] ?? 0), 1);
});

test("values are shares of their range, unknown ones apart", () => {
  const { shares, low, high } = normalize(Float32Array.from([2, Number.NaN, 4]), 0.1);
  assert.deepEqual([...shares], [0, -1, 1]);
  assert.deepEqual([low, high], [2, 4]);
});

test("nothing is coloured by rounding", () => {
  const straight = normalize(Float32Array.from([1e-9, -3e-9, 2e-9]), 1e-3);
  assert.deepEqual([[...straight.shares], straight.low, straight.high], [[0, 0, 0], 0, 0]);
  const equal = normalize(Float32Array.from([55, 55.00001]), 0.01);
  assert.ok(Math.max(...equal.shares) < 1e-2);
});

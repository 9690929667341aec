import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { BranchEvent, ResultInfoSchema } from "../gen/limber/v1/service_pb";
import { describeAccuracy, describeReach, describeSnaps, describeStarts, lengthUnit } from "../src/session/words";

test("snaps of beams and linkages are told with their places, buckling beside is none", () => {
  const beams = create(ResultInfoSchema, { beams: { snaps: [{ progress: 0.389, node: 7 }] } });
  assert.equal(describeSnaps(beams)?.text, "The structure snapped at 39 % of the path, near node 7.");
  const path = [BranchEvent.UNSPECIFIED, BranchEvent.BRANCHING, BranchEvent.LIMIT_POINT, BranchEvent.JUMP].map(
    (event, i) => ({ event, progress: i / 4, meanAngleDegrees: 10 * i }),
  );
  const linkage = create(ResultInfoSchema, { linkage: { path } });
  assert.equal(
    describeSnaps(linkage)?.text,
    "The structure snapped at 50 % of the path, at 20°; 75 % of the path, at 30°.",
  );
  assert.equal(describeSnaps(create(ResultInfoSchema, { linkage: { path: path.slice(0, 2) } })), null);
  const many = Array.from({ length: 5 }, (_, node) => ({ progress: 0.5, node }));
  assert.match(
    describeSnaps(create(ResultInfoSchema, { beams: { snaps: many } }))?.text ?? "",
    /node 2, and 2 more times\.$/,
  );
});

test("errors of stresses stand beside those of positions", () => {
  const discretisationError = {
    comparedElements: 40,
    positionError: 0.002,
    maxDistance: 0.004,
    withinTolerance: true,
    stressError: 0.0123,
    maxStressError: 250000,
    worstStressSegment: 7,
  };
  assert.equal(
    describeAccuracy(create(ResultInfoSchema, { converged: true, discretisationError }))?.text,
    "checked: positions are off by 0.2 % of the size (0.004 m), stresses by 1.2 % (250000 Pa in segment 7) by the discretisation",
  );
  const { stressError: _, ...without } = discretisationError;
  const info = create(ResultInfoSchema, { converged: true, discretisationError: without });
  assert.doesNotMatch(describeAccuracy(info)?.text ?? "", /stress/);
});

test("targets out of reach are told with what is left, the worst first", () => {
  const missed = (count: number) =>
    create(ResultInfoSchema, {
      converged: true,
      outOfReach: Array.from({ length: count }, (_, i) => ({ constraint: BigInt(i + 4), distance: 18.76543 - i })),
    });
  assert.equal(describeReach(missed(0), "m"), null);
  assert.deepEqual(describeReach(missed(1), "m"), {
    tone: "warning",
    text: "out of reach: constraint 4 (18.8 m left)",
  });
  assert.equal(
    describeReach(missed(5), "units")?.text,
    "out of reach: constraint 4 (18.8 units left); constraint 5 (17.8 units left); constraint 6 (16.8 units left); and 2 more",
  );
  assert.equal(describeReach({ ...missed(1), solveFailed: true }, "m"), null);
});

test("starts are told with their number, their optima and how far apart they are", () => {
  const of = (optima: number, unconverged = 0) =>
    create(ResultInfoSchema, {
      converged: true,
      starts: { compared: 5, optima, unconverged, largestDistance: 0.3141, budget: 7 },
    });
  assert.equal(describeStarts(create(ResultInfoSchema, {}), "m"), null);
  assert.deepEqual(describeStarts(of(1), "m"), {
    tone: "good",
    text: "5 starts compared: one optimum, up to 0.314 m apart",
  });
  assert.deepEqual(describeStarts(of(2), "units"), {
    tone: "warning",
    text: "5 starts compared: 2 optima, up to 0.314 units apart",
  });
  assert.deepEqual(describeStarts(of(0), "m"), {
    tone: "warning",
    text: "5 starts compared: none converged, up to 0.314 m apart",
  });
  assert.deepEqual(describeStarts(of(1, 4), "m"), {
    tone: "warning",
    text: "5 starts compared: one optimum, 4 not converged, up to 0.314 m apart",
  });
});

test("lengths have the unit of the scene", () => {
  assert.deepEqual([null, { lengthUnitInMetres: 0 }, { lengthUnitInMetres: 1 }].map(lengthUnit), ["m", "m", "m"]);
  assert.equal(lengthUnit({ lengthUnitInMetres: 0.001 }), "units");
});

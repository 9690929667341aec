import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { BranchEvent, ResultInfoSchema } from "../gen/limber/v1/service_pb";
import { describeSnaps } from "../src/session/words";

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

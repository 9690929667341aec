import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { SceneSchema } from "../gen/limber/v1/scene_pb";
import { describeChanges } from "../src/session/changes";

test("what others did is told thing by thing", () => {
  const before = create(SceneSchema, {
    constraints: [
      { id: 1n, frame: 3 },
      { id: 2n, frame: 4 },
    ],
  });
  const after = create(SceneSchema, { constraints: [{ id: 1n, frame: 5 }, { id: 3n }] });
  assert.deepEqual(describeChanges(before, after), [
    "constraint 3 added",
    "constraint 2 removed",
    "constraint 1 changed",
  ]);
  assert.deepEqual(describeChanges(after, after), []);
});

test("linkages and beams are told by joint and node", () => {
  const before = create(SceneSchema, { linkage: { conditions: { pins: [{ joint: 4 }] } }, beams: { structure: {} } });
  const after = create(SceneSchema, {
    linkage: { conditions: { meanAngleDegrees: 30 } },
    beams: { structure: { motions: [{ node: 7, x: 1 }] } },
  });
  assert.deepEqual(describeChanges(before, after), [
    "pin of joint 4 removed",
    "motion of node 7 added",
    "mean opening angle changed",
  ]);
});

test("long lists are cut", () => {
  const after = create(SceneSchema, { constraints: Array.from({ length: 20 }, (_, i) => ({ id: BigInt(i) })) });
  assert.equal(describeChanges(create(SceneSchema, {}), after).at(-1), "and 14 more");
});

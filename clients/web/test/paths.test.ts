import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { type Constraint, ConstraintSchema } from "../gen/limber/v1/scene_pb";
import { covers, keysOf, lastFrame, pathOf, targetIn } from "../src/bodies/paths";

const at = (x: number): { x: number; y: number; z: number } => ({ x, y: 2 * x, z: 1 });

function constraint(path: { frame: number; target?: ReturnType<typeof at> }[], ease = {}): Constraint {
  return create(ConstraintSchema, { frame: 10, target: { case: "position", value: at(0) }, path, ...ease });
}

test("a hold stays where it is until its last frame", () => {
  const hold = constraint([{ frame: 30 }]);
  assert.equal(lastFrame(hold), 30);
  assert.ok(covers(hold, 10) && covers(hold, 30) && !covers(hold, 9) && !covers(hold, 31));
  for (const frame of [10, 17, 30]) assert.deepEqual(targetIn(hold, frame), [0, 0, 1]);
});

test("a path between two keys begins and ends at rest, or at its speed", () => {
  const eased = constraint([{ frame: 20, target: at(1) }]);
  assert.deepEqual(targetIn(eased, 15), [0.5, 1, 1]);
  // 3 s^2 - 2 s^3
  assert.ok(Math.abs(targetIn(eased, 12)[0] - 0.104) < 1e-12);
  const steady = constraint([{ frame: 20, target: at(1) }], { easeIn: 0, easeOut: 0 });
  for (let frame = 10; frame <= 20; frame++)
    assert.ok(Math.abs(targetIn(steady, frame)[0] - (frame - 10) / 10) < 1e-12);
});

test("a path goes through its keys without overshoot", () => {
  const path = constraint([{ frame: 14, target: at(1) }, { frame: 40 }, { frame: 50, target: at(3) }]);
  assert.deepEqual(
    keysOf(path).map(({ frame, target }) => [frame, target[0]]),
    [
      [10, 0],
      [14, 1],
      [40, 1],
      [50, 3],
    ],
  );
  let before = -1e-12;
  for (let frame = 10; frame <= 50; frame++) {
    const [x] = targetIn(path, frame);
    assert.ok(x >= before - 1e-12, `frame ${frame}`);
    if (frame >= 14 && frame <= 40) assert.equal(x, 1);
    before = x;
  }
  assert.deepEqual(pathOf(keysOf(path))[1], { frame: 40, target: { x: 1, y: 2, z: 1 } });
});

import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { type Frames, FramesSchema } from "../gen/limber/v1/service_pb";
import { MotionBuffer } from "../src/session/motion";
import { fromFloats } from "../src/wire/arrays";

interface Wanted {
  sequence: number;
  base: number;
  first?: number;
  values: number[][];
  part?: number;
  more?: boolean;
  early?: boolean;
  motion?: number;
}

function changes({
  sequence,
  base,
  first = 0,
  values,
  part = 0,
  more = false,
  early = false,
  motion = 4,
}: Wanted): Frames {
  return create(FramesSchema, {
    result: { sequence: BigInt(sequence) },
    firstFrame: first,
    frameCount: values.length,
    basisHash: "b",
    data: fromFloats(Float32Array.from(values.flat()), [values.length, values[0]?.length ?? 0]),
    changes: { motionFrames: motion, baseSequence: BigInt(base), part, more, early },
  });
}

const whole = { sequence: 1, base: 0, values: [[0], [1], [2], [3]] };

test("a motion begins with base 0 and is changed by ranges", () => {
  const motion = new MotionBuffer();
  assert.equal(motion.take(changes(whole)), "whole");
  assert.deepEqual([...motion.data], [0, 1, 2, 3]);
  assert.equal(motion.take(changes({ sequence: 2, base: 1, first: 1, values: [[7], [8]] })), "whole");
  assert.deepEqual([...motion.data], [0, 7, 8, 3]);
  assert.equal(motion.sequence, 2n);
});

test("a result in two parts is whole with the last", () => {
  const motion = new MotionBuffer();
  motion.take(changes(whole));
  assert.equal(motion.take(changes({ sequence: 2, base: 1, values: [[5]], more: true })), "written");
  assert.equal(motion.sequence, 1n);
  assert.equal(motion.take(changes({ sequence: 2, base: 1, first: 3, values: [[6]], part: 1 })), "whole");
  assert.deepEqual([...motion.data], [5, 1, 2, 6]);
});

test("a motion that is begun again before it was whole is taken from its first part", () => {
  const motion = new MotionBuffer();
  assert.equal(motion.take(changes({ sequence: 3, base: 0, values: [[9], [9]], more: true })), "written");
  assert.equal(motion.take(changes({ sequence: 3, base: 0, values: [[0], [1]], more: true })), "written");
  assert.equal(motion.take(changes({ sequence: 3, base: 0, first: 2, values: [[2], [3]], part: 1 })), "whole");
  assert.deepEqual([...motion.data], [0, 1, 2, 3]);
});

test("a missed part or another base asks for the whole motion", () => {
  const motion = new MotionBuffer();
  motion.take(changes(whole));
  assert.equal(motion.take(changes({ sequence: 2, base: 1, values: [[5]], part: 1 })), "fetch");
  assert.equal(motion.take(changes({ sequence: 3, base: 2, values: [[5]] })), "fetch");
  assert.equal(new MotionBuffer().take(changes({ sequence: 3, base: 2, values: [[5]] })), "fetch");
  assert.deepEqual([...motion.data], [0, 1, 2, 3]);
});

test("what is older is left out, what is early is shown at once", () => {
  const motion = new MotionBuffer();
  motion.take(changes({ ...whole, sequence: 4 }));
  assert.equal(motion.take(changes({ sequence: 3, base: 2, values: [[9]] })), "nothing");
  assert.equal(motion.take(changes({ sequence: 0, base: 4, first: 2, values: [[9]], early: true })), "written");
  assert.equal(motion.sequence, 4n);
  assert.equal(motion.frame(2)[0], 9);
  assert.equal(motion.take(changes({ sequence: 0, base: 3, first: 2, values: [[1]], early: true })), "nothing");
});

test("frames beyond the motion are refused", () => {
  const motion = new MotionBuffer();
  motion.take(changes(whole));
  assert.throws(() => motion.take(changes({ sequence: 2, base: 1, first: 3, values: [[1], [2]] })), /do not fit/);
});

test("parts of a fetched motion are put together", () => {
  const motion = new MotionBuffer();
  motion.replace([
    changes({ ...whole, sequence: 7, values: [[1, 2]] }),
    changes({
      ...whole,
      sequence: 7,
      values: [
        [3, 4],
        [5, 6],
      ],
    }),
  ]);
  assert.equal(motion.frames, 3);
  assert.equal(motion.size, 2);
  assert.deepEqual([...motion.frame(2)], [5, 6]);
  assert.deepEqual([...motion.frame(99)], [5, 6]);
});

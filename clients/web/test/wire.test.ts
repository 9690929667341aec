import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { ArraySchema, DataType } from "../gen/limber/v1/common_pb";
import { doubles, floats, fromIntegers, integers } from "../src/wire/arrays";
import { subscription, unpack } from "../src/wire/streams";

test("arrays are read wherever their bytes begin", () => {
  const bytes = new Uint8Array(9);
  bytes.set(new Uint8Array(Float32Array.from([1.5, -2]).buffer), 1);
  const made = create(ArraySchema, { type: DataType.FLOAT32, shape: [2n], data: bytes.subarray(1) });
  assert.deepEqual([...floats(made)], [1.5, -2]);
  assert.deepEqual([...doubles(made)], [1.5, -2]);
});

test("an array that does not fit its shape is refused", () => {
  const made = create(ArraySchema, { type: DataType.FLOAT32, shape: [3n], data: new Uint8Array(8) });
  assert.throws(() => floats(made), /does not fit/);
});

test("integers go and come back", () => {
  assert.deepEqual([...integers(fromIntegers(Int32Array.from([3, -1]), [2]))], [3, -1]);
});

test("streams are framed as the gateway does", () => {
  assert.deepEqual([...subscription("jobs", true)], [1, 106, 111, 98, 115]);
  assert.equal(subscription("jobs", false)[0], 0);
  const { topic, message } = unpack(Uint8Array.from([4, 106, 111, 98, 115, 7, 8]));
  assert.equal(topic, "jobs");
  assert.deepEqual([...message], [7, 8]);
});

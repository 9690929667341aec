import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { ExportResponseSchema } from "../gen/limber/v1/service_pb";
import { stresses } from "../src/linkages/stress";
import type { LiveSession } from "../src/session/live";

test("stresses are read of all parts of an export, and are of its result", async () => {
  const stations = [1, 2, 3].map((value) => ({ von_mises_stress: value }));
  const text = new TextEncoder().encode(JSON.stringify({ segments: [{ stations }, { stations }] }));
  const cuts = [text.subarray(0, 40), text.subarray(40, 41), text.subarray(41)];
  const asked: [number, bigint][] = [];
  const call = async (_: string, { part, resultSequence }: { part: number; resultSequence: bigint }) => {
    asked.push([part, resultSequence]);
    const files = [{ name: "motion.json", content: cuts[part] ?? text, append: part > 0 }];
    return create(ExportResponseSchema, { files, part, partCount: cuts.length, result: { sequence: 7n } });
  };
  const session = { connection: { call }, reference: "s@1" } as unknown as LiveSession;
  const { values, sequence } = await stresses(session, [2, 2]);
  assert.deepEqual([...values], [1, 2, 3, 1, 2, 3]);
  assert.equal(sequence, 7n);
  assert.deepEqual(asked, [
    [0, 0n],
    [1, 7n],
    [2, 7n],
  ]);
});

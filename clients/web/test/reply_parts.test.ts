// Long answers that come in parts.
import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { type GetReplyPartResponse, GetReplyPartResponseSchema } from "../gen/limber/v1/parts_pb";
import { LimberError } from "../src/wire/errors";
import { isGone, isOfOlderServer, type NextPart, PART_BYTES, wholeReply } from "../src/wire/reply_parts";

const WHOLE = Uint8Array.from({ length: 1 << 20 }, (_, i) => i % 251);

function cut(offset: number, mostBytes: number): GetReplyPartResponse {
  const data = WHOLE.slice(offset, offset + mostBytes);
  return create(GetReplyPartResponseSchema, {
    reply: 7n,
    totalBytes: BigInt(WHOLE.length),
    offset: BigInt(offset),
    data,
  });
}

test("parts are put together in their order, larger ones as long as they are quick", async () => {
  const asked: NextPart[] = [];
  const bytes = await wholeReply(
    cut(0, PART_BYTES.least),
    async (part) => {
      asked.push(part);
      return cut(Number(part.offset), Number(part.mostBytes));
    },
    () => 0,
  );
  assert.deepEqual(bytes, WHOLE);
  assert.deepEqual(
    asked.map(({ reply, mostBytes }) => [reply, Number(mostBytes) / PART_BYTES.least]),
    [1, 2, 4, 8, 16].slice(0, asked.length).map((size) => [7n, size]),
  );
  assert.ok(asked.length > 2);
});

test("a part that is not the next one is refused", async () => {
  for (const shift of [1, -1, WHOLE.length])
    await assert.rejects(
      wholeReply(cut(0, 1000), async ({ offset }) => cut(Number(offset) + shift, 1000)),
      { code: "MALFORMED" },
    );
});

test("what the server keeps no more is told apart", async () => {
  const gone = new LimberError("FAILED_PRECONDITION", "no such reply any more", "reply");
  const refused = wholeReply(cut(0, 1000), async () => {
    throw gone;
  });
  await assert.rejects(refused, isGone);
  assert.equal(isGone(new LimberError("FAILED_PRECONDITION", "not yet", "session")), false);
  assert.ok(isOfOlderServer(new LimberError("INVALID_ARGUMENT", "unknown field number 6 in Request; it is of ...")));
  assert.equal(isOfOlderServer(new LimberError("INVALID_ARGUMENT", "unknown field number 60 in Request")), false);
});

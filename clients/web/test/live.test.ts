import assert from "node:assert/strict";
import { test } from "node:test";
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import {
  EditResponseSchema,
  FramesSchema,
  GetFramesResponseSchema,
  GetGeometryResponseSchema,
  ResultInfoSchema,
  SessionStatusSchema,
} from "../gen/limber/v1/service_pb";
import { completed } from "../src/session/geometry";
import { LiveSession } from "../src/session/live";
import { type MotionPart, wholeMotion } from "../src/session/whole_motion";
import { floats, fromFloats, fromIntegers } from "../src/wire/arrays";
import type { Connection } from "../src/wire/connection";
import { LimberError } from "../src/wire/errors";
import { PART_BYTES } from "../src/wire/reply_parts";
import type { Streams } from "../src/wire/streams";

Object.assign(globalThis, { window: globalThis });

interface EditRequest {
  edits: { edit: { case: string } }[];
  expectedRevision?: bigint;
}

/** A session whose edits are answered by `edit`. */
function session(edit: (request: EditRequest) => Promise<{ revision: bigint }>): LiveSession {
  const call = async (kind: string, value: unknown): Promise<unknown> =>
    kind === "edit" ? create(EditResponseSchema, await edit(value as EditRequest)) : {};
  const connection = { call } as unknown as Connection;
  const streams = { subscribe: () => undefined, unsubscribe: () => undefined } as unknown as Streams;
  return new LiveSession(connection, streams, { session: "s", uid: 1n });
}

test("an undo is of the revision that this page knows, after its own edits", async () => {
  let revision = 0n;
  const asked: EditRequest[] = [];
  const live = session(async (request) => {
    asked.push(request);
    await new Promise((resolve) => setTimeout(resolve, 5));
    revision += 1n;
    return { revision };
  });
  const add = live.edit([{ edit: { case: "undo", value: {} } }]);
  await Promise.all([add, live.undo(), live.undo(), live.redo()]);
  live.close();
  assert.deepEqual(
    asked.map(({ expectedRevision }) => expectedRevision),
    [undefined, 1n, 2n, 3n],
  );
  assert.deepEqual(
    asked.slice(1).map(({ edits }) => edits[0]?.edit.case),
    ["undo", "undo", "redo"],
  );
});

test("an undo that another page's edit has overtaken says so, and the next one is sent", async () => {
  let isRefused = true;
  const live = session(async () => {
    if (isRefused) throw new LimberError("FAILED_PRECONDITION", "the newest revision is 7", "expected_revision");
    return { revision: 8n };
  });
  await assert.rejects(live.undo(), /nothing was undone: somebody else edited/);
  isRefused = false;
  await live.undo();
  live.close();
  assert.equal(live.revision, 8n);
});

/** An answer of a server whose parts have two frames; it keeps results from `oldest` on. */
function part(asked: MotionPart, total: number, newest: bigint, oldest = 1n) {
  const sequence = asked.resultSequence || newest;
  if (sequence < oldest) throw new LimberError("FAILED_PRECONDITION", "no such result any more", "result_sequence");
  const wanted = asked.frameCount || total - asked.firstFrame;
  const frameCount = Math.min(2, wanted);
  const frames = create(FramesSchema, {
    result: create(ResultInfoSchema, { sequence }),
    firstFrame: asked.firstFrame,
    frameCount,
    basisHash: "b",
    data: fromFloats(new Float32Array(frameCount), [frameCount, 1]),
  });
  return create(GetFramesResponseSchema, { frames, framesLeft: wanted - frameCount });
}

test("all parts of a long motion are of one result, though newer ones come", async () => {
  const asked: MotionPart[] = [];
  const parts = await wholeMotion(async (wanted) => {
    asked.push(wanted);
    return part(wanted, 5, BigInt(asked.length));
  });
  assert.deepEqual(
    asked.map(({ firstFrame, frameCount, resultSequence }) => [firstFrame, frameCount, resultSequence]),
    [
      [0, 0, 0n],
      [2, 3, 1n],
      [4, 1, 1n],
    ],
  );
  assert.deepEqual(
    parts?.map(({ frameCount, result }) => [frameCount, result?.sequence]),
    [
      [2, 1n],
      [2, 1n],
      [1, 1n],
    ],
  );
});

test("an older server that does not know parts sends a motion whole", async () => {
  const parts = await wholeMotion(async (wanted) => {
    if (wanted.mostBytes > 0n) throw new LimberError("INVALID_ARGUMENT", "unknown field number 7", "get_frames");
    return part({ ...wanted, frameCount: 2 }, 2, 1n);
  });
  assert.equal(parts?.length, 1);
});

test("parts of a motion are as large as the link is quick", async () => {
  for (const [bytesOfMillisecond, sizes] of [
    [1e6, [1, 2, 4, 8]],
    [12.5e3, [1, 2, 4, 4]],
    [1e3, [1, 2, 1, 2]],
  ] as const) {
    const asked: number[] = [];
    let time = 0;
    await wholeMotion(
      async (wanted) => {
        time += 100 + Number(wanted.mostBytes) / bytesOfMillisecond;
        asked.push(Number(wanted.mostBytes) / PART_BYTES.least);
        return part(wanted, 7, 1n);
      },
      () => time,
    );
    assert.deepEqual(asked, sizes);
  }
});

test("a motion that was displaced is asked for again, until asking ends", async () => {
  let asked = 0;
  const parts = await wholeMotion(async (wanted) => part(wanted, 4, BigInt(++asked), asked === 2 ? 2n : 1n));
  assert.ok(parts?.every(({ result }) => result?.sequence === 3n));
  asked = 0;
  const none = await wholeMotion(async (wanted) => part(wanted, 4, BigInt(++asked), BigInt(asked)));
  assert.equal(none, null);
  assert.ok(asked < 20);
  await assert.rejects(
    wholeMotion(async () => {
      throw new LimberError("NOT_FOUND", "closed", "session");
    }),
    /closed/,
  );
});

test("without the parts of one result, what is here stays", async () => {
  let sequence = 1n;
  let isStable = true;
  const call = async (kind: string, value: unknown): Promise<unknown> => {
    if (kind === "getGeometry") return create(GetGeometryResponseSchema, { basisHash: "b", beams: {} });
    return part(value as MotionPart, 7, isStable ? 1n : ++sequence, isStable ? 1n : sequence);
  };
  const streams = { subscribe: () => undefined, unsubscribe: () => undefined } as unknown as Streams;
  const live = new LiveSession({ call } as unknown as Connection, streams, { session: "s", uid: 1n });
  live.status = create(SessionStatusSchema, { kind: "bodies", frames: 7 });
  const fetch = live as unknown as { fetchMotion(): Promise<void> };
  await fetch.fetchMotion();
  assert.equal(live.motion.sequence, 1n);
  assert.equal(live.motion.frames, 7);
  isStable = false;
  await fetch.fetchMotion();
  live.close();
  assert.equal(live.motion.sequence, 1n);
});

/** A session on a stream: `send` is what the server publishes of its body. */
function followed(call: (kind: string, value: unknown) => Promise<unknown>) {
  let take: ((message: unknown) => void) | undefined;
  const streams = {
    subscribe: (topic: string, handler: (message: unknown) => void) => {
      if (topic.endsWith("/changes")) take = handler;
    },
    unsubscribe: () => undefined,
  } as unknown as Streams;
  const live = new LiveSession({ call } as unknown as Connection, streams, { session: "s", uid: 1n });
  const send = (frames: unknown): void => take?.({ sessionUid: 1n, payload: { case: "frames", value: frames } });
  return { live, send };
}

test("frames that come too late leave the basis of the motion that is here", async (context) => {
  const asked: string[] = [];
  const { live, send } = followed(async (kind, value) => {
    if (kind === "getFrames") return part(value as MotionPart, 2, 7n);
    if (kind !== "getGeometry") return { status: create(SessionStatusSchema, { result: { sequence: 7n } }) };
    const { basisHash } = value as { basisHash: string };
    asked.push(basisHash);
    return create(GetGeometryResponseSchema, { basisHash, beams: {} });
  });
  context.after(() => live.close());
  await live.start();
  const late = (sequence: bigint, changes: object) =>
    create(FramesSchema, {
      result: { sequence },
      frameCount: 1,
      basisHash: "of the first picture",
      data: fromFloats(new Float32Array(3), [1, 3]),
      changes,
    });
  send(late(6n, { motionFrames: 1 }));
  send(late(6n, { motionFrames: 1, baseSequence: 5n }));
  send(late(8n, { motionFrames: 1, baseSequence: 6n, early: true }));
  await new Promise((resolve) => setTimeout(resolve, 20));
  assert.deepEqual([live.geometry?.basisHash, live.motion.basisHash, live.motion.sequence], ["b", "b", 7n]);
  assert.deepEqual(asked, ["b"]);
  send(late(8n, { motionFrames: 1 }));
  await new Promise((resolve) => setTimeout(resolve, 20));
  assert.equal(live.motion.sequence, 8n);
  assert.equal(live.geometry?.basisHash, live.motion.basisHash);
});

test("where the basis of frames is gone the newest motion is asked for", async (context) => {
  let newest = 7n;
  const { live } = followed(async (kind, value) => {
    if (kind === "getFrames") return part(value as MotionPart, 2, newest);
    if (kind !== "getGeometry") return { status: create(SessionStatusSchema, { result: { sequence: newest } }) };
    if (newest++ === 7n) throw new LimberError("NOT_FOUND", "the session has no such basis any more", "basis_hash");
    return create(GetGeometryResponseSchema, { basisHash: (value as { basisHash: string }).basisHash, beams: {} });
  });
  context.after(() => live.close());
  await live.start();
  for (let i = 0; live.motion.sequence === 0n && i < 100; i++) await new Promise((resolve) => setTimeout(resolve, 20));
  assert.equal(live.motion.sequence, 8n);
});

const geometry = (init: MessageInitShape<typeof GetGeometryResponseSchema>) => create(GetGeometryResponseSchema, init);
const rest = fromFloats(new Float32Array(3), [1, 3]);
const tets = fromIntegers(new Int32Array(0), [0, 4]);
const known = geometry({
  rest,
  tets,
  basis: fromFloats(Float32Array.from([1, 2, 3, 4, 5, 6]), [1, 3, 2]),
  basisHash: "two",
  carriedSurface: { name: "skin.obj" },
});

test("a basis that has grown is put together of what is here and its new columns", () => {
  const answer = geometry({
    rest,
    tets,
    basis: fromFloats(Float32Array.from([7, 8, 9]), [1, 3, 1]),
    basisHash: "three",
    knownColumns: 2,
  });
  const whole = completed(answer, known);
  assert.deepEqual([...floats(whole.basis)], [1, 2, 7, 3, 4, 8, 5, 6, 9]);
  assert.deepEqual(whole.basis?.shape, [1n, 3n, 3n]);
  assert.equal(whole.carriedSurface?.name, "skin.obj");
  assert.throws(() => completed(geometry({ rest, tets, basisHash: "x", knownColumns: 5 }), known), /does not hold/);
});

test("what stayed as it was is not sent, and kept", () => {
  assert.deepEqual([...floats(completed(geometry({ rest, tets, basisHash: "two" }), known).basis)], [1, 2, 3, 4, 5, 6]);
  const linkage = geometry({ linkage: { edges: [4] }, basisHash: "l" });
  assert.equal(completed(geometry({ basisHash: "l" }), linkage), linkage);
  assert.deepEqual(completed(geometry({ linkage: { edges: [8] }, basisHash: "m" }), linkage).linkage?.edges, [8]);
});

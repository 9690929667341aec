// Long answers in parts (parts.proto): answers to edits pass between two.
import type { GetReplyPartResponse } from "../../gen/limber/v1/parts_pb";
import { RequestSchema } from "../../gen/limber/v1/service_pb";
import { LimberError } from "./errors";

/** Bytes to ask for at once. */
export const PART_BYTES = { least: 64 << 10, most: 4 << 20 };
const QUICK_MS = 10;
const SLOW_MS = 30;

/** A part should take some hundredths of a second more than the shortest did: the rest of its time is the round trip. */
export class PartSize {
  bytes = PART_BYTES.least;
  private shortest = Number.POSITIVE_INFINITY;

  /** How long a part of this size took from its request to its end. */
  note(milliseconds: number): void {
    this.shortest = Math.min(this.shortest, milliseconds);
    const more = milliseconds - this.shortest;
    if (more < QUICK_MS) this.bytes = Math.min(2 * this.bytes, PART_BYTES.most);
    else if (more > SLOW_MS) this.bytes = Math.max(this.bytes / 2, PART_BYTES.least);
  }
}

/** Whose answers are as large as a session's scene, basis or structure; frames come in parts of their own. */
const LONG: ReadonlySet<string> = new Set([
  "getGeometry",
  "getMaterial",
  "getSession",
  "saveSession",
  "getDesign",
  "getBeamSolution",
  "explain",
  "getSample",
]);

export function mayBeLong(kind: string): boolean {
  return LONG.has(kind);
}

/** The server no longer keeps the answer whose parts were fetched: request it anew. */
export function isGone(error: unknown): boolean {
  return error instanceof LimberError && error.code === "FAILED_PRECONDITION" && error.field === "reply";
}

/** It refuses a field of a request that it does not know: that its answer can come in parts. */
export function isOfOlderServer(error: unknown): boolean {
  const words = `unknown field number ${RequestSchema.field.mostReplyBytes.number} `;
  return error instanceof LimberError && error.code === "INVALID_ARGUMENT" && error.message.includes(words);
}

/** The next requested part of a long answer. */
export interface NextPart {
  reply: bigint;
  offset: bigint;
  mostBytes: bigint;
}

/** The bytes of a reply whose first part came in its place. Rejects with the error of isGone() if its connection ended. */
export async function wholeReply(
  first: GetReplyPartResponse,
  ask: (part: NextPart) => Promise<GetReplyPartResponse>,
  now: () => number = () => performance.now(),
): Promise<Uint8Array> {
  const size = new PartSize();
  const bytes = new Uint8Array(Number(first.totalBytes));
  bytes.set(first.data);
  let at = first.data.length;
  while (at < bytes.length) {
    const begin = now();
    const { offset, data } = await ask({ reply: first.reply, offset: BigInt(at), mostBytes: BigInt(size.bytes) });
    size.note(now() - begin);
    if (Number(offset) !== at || data.length === 0 || at + data.length > bytes.length)
      throw new LimberError("MALFORMED", "a part of a long answer is not the next one");
    bytes.set(data, at);
    at += data.length;
  }
  return bytes;
}

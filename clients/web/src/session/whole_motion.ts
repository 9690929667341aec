// Motions too long for one message.
import type { Frames, GetFramesResponse } from "../../gen/limber/v1/service_pb";
import { LimberError } from "../wire/errors";
import { PartSize } from "../wire/reply_parts";

/** How often newer results may displace the one whose parts are fetched. */
const TRIES = 3;

/** Requested part of a motion. frameCount 0: to the last; resultSequence 0: of the newest result. */
export interface MotionPart {
  firstFrame: number;
  frameCount: number;
  resultSequence: bigint;
  mostBytes: bigint;
}
export type AskFrames = (part: MotionPart) => Promise<GetFramesResponse>;

/**
 * All frames of one result, in parts. null: each time the server no longer had that result before its last part, or there
 * is none.
 */
export async function wholeMotion(
  ask: AskFrames,
  now: () => number = () => performance.now(),
): Promise<Frames[] | null> {
  const size = new PartSize();
  for (let attempt = 0; attempt < TRIES; attempt++) {
    try {
      return await partsOfOneResult(ask, size, now);
    } catch (error) {
      if (error instanceof LimberError && error.code === "INVALID_ARGUMENT" && error.field === "get_frames")
        return inOne(ask);
      if (!(error instanceof LimberError && error.field === "result_sequence")) throw error;
    }
  }
  return null;
}

/** From an older server, which refuses the unknown field for answers in parts. */
async function inOne(ask: AskFrames): Promise<Frames[] | null> {
  const { frames } = await ask({ firstFrame: 0, frameCount: 0, resultSequence: 0n, mostBytes: 0n });
  return frames ? [frames] : null;
}

async function partsOfOneResult(ask: AskFrames, size: PartSize, now: () => number): Promise<Frames[] | null> {
  const parts: Frames[] = [];
  const next = { firstFrame: 0, frameCount: 0, resultSequence: 0n };
  do {
    const begin = now();
    const { frames, framesLeft } = await ask({ ...next, mostBytes: BigInt(size.bytes) });
    size.note(now() - begin);
    if (!frames) return null;
    parts.push(frames);
    next.firstFrame += frames.frameCount;
    next.frameCount = framesLeft;
    next.resultSequence = frames.result?.sequence ?? 0n;
  } while (next.frameCount > 0);
  return parts;
}

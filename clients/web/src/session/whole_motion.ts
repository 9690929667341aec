// Motions too long for one message.
import type { Frames, GetFramesResponse } from "../../gen/limber/v1/service_pb";
import { LimberError } from "../wire/errors";

/** About so many bytes of frames come in one answer: those to edits pass between two. */
export const PART_BYTES = 2n << 20n;
/** How often newer results may displace the one whose parts are fetched. */
const TRIES = 3;

/** What of a motion is asked for. frameCount 0: to the last; resultSequence 0: of the newest result. */
export interface MotionPart {
  firstFrame: number;
  frameCount: number;
  resultSequence: bigint;
}
export type AskFrames = (part: MotionPart) => Promise<GetFramesResponse>;

/**
 * All frames of one result, in parts. null: each time the server no longer had that result before its last part, or there
 * is none.
 */
export async function wholeMotion(ask: AskFrames): Promise<Frames[] | null> {
  for (let attempt = 0; attempt < TRIES; attempt++) {
    try {
      return await partsOfOneResult(ask);
    } catch (error) {
      if (!(error instanceof LimberError && error.field === "result_sequence")) throw error;
    }
  }
  return null;
}

async function partsOfOneResult(ask: AskFrames): Promise<Frames[] | null> {
  const parts: Frames[] = [];
  const next: MotionPart = { firstFrame: 0, frameCount: 0, resultSequence: 0n };
  do {
    const { frames, framesLeft } = await ask({ ...next });
    if (!frames) return null;
    parts.push(frames);
    next.firstFrame += frames.frameCount;
    next.frameCount = framesLeft;
    next.resultSequence = frames.result?.sequence ?? 0n;
  } while (next.frameCount > 0);
  return parts;
}

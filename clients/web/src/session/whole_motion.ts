import type { Frames } from "../../gen/limber/v1/service_pb";

/** Motions are fetched in parts of this many numbers. */
const FETCHED_NUMBERS = 8_000_000;
/** Motions up to this many frames come in one message, whatever their size. */
const UNPROBED_FRAMES = 8192;
/** How often newer results may come between two parts. */
const TRIES = 3;

/** Asks for some frames of the newest result; count 0: to the last. */
export type AskFrames = (firstFrame: number, frameCount: number) => Promise<Frames | undefined>;

/**
 * All frames of one result, in parts that are of the same one. total: frames of the motion; 0: not known, then it comes
 * in one message. null: each time a newer result came between two parts, or there is none.
 */
export async function wholeMotion(ask: AskFrames, total: number): Promise<Frames[] | null> {
  for (let attempt = 0; attempt < TRIES; attempt++) {
    let step = total;
    if (total > UNPROBED_FRAMES) {
      const numbers = ((await ask(0, 1))?.data?.data.byteLength ?? 4) / 4;
      step = Math.max(1, Math.floor(FETCHED_NUMBERS / Math.max(1, numbers)));
    }
    const parts: Frames[] = [];
    let at = 0;
    let isOfOne = true;
    do {
      const frames = await ask(at, total > step ? Math.min(step, total - at) : 0);
      if (!frames) return null;
      parts.push(frames);
      at += frames.frameCount;
      isOfOne = frames.result?.sequence === parts[0]?.result?.sequence && frames.frameCount > 0;
    } while (isOfOne && total > step && at < total);
    if (isOfOne) return parts;
  }
  return null;
}

import type { Frames } from "../../gen/limber/v1/service_pb";
import { type Reals, reals } from "../wire/arrays";
import { LimberError } from "../wire/errors";

function emptyLike(numbers: Reals | undefined, count: number): Reals {
  return numbers instanceof Float64Array ? new Float64Array(count) : new Float32Array(count);
}

/** Action that a message of the topic `changes` requests in addition to being written. */
export type Taken = "nothing" | "written" | "whole" | "fetch";

/**
 * The motion of a session, kept up to date by the topic `changes` (docs/protocol.md, Changes of long motions). It is
 * frames x size, float32 except for rods and beams far from the origin. Only for coordinates.
 */
export class MotionBuffer {
  data: Reals = new Float32Array(0);
  frames = 0;
  /** Numbers of a frame. */
  size = 0;
  /** Hash of the basis that frames are of. */
  basisHash = "";
  /** ResultInfo.sequence of the result whose motion this is; 0: none yet. */
  sequence = 0n;
  private begun = 0n;
  private parts = 0;

  frame(index: number): Reals {
    const at = Math.min(Math.max(index, 0), this.frames - 1) * this.size;
    return this.data.subarray(at, at + this.size);
  }

  /** The action of take() for a message: only a written one needs the basis. */
  judge({ changes, result }: Frames): "nothing" | "fetch" | "write" | "begin" {
    const sequence = result?.sequence ?? 0n;
    if (!changes) return "nothing";
    if (changes.early) {
      const fits = this.frames > 0 && changes.baseSequence === this.sequence && this.begun === 0n;
      return fits ? "write" : "nothing";
    }
    if (sequence <= this.sequence) return "nothing";
    // A motion that waits for this page is begun once more when another page joins.
    const isBegun = changes.part === 0 && changes.baseSequence === 0n;
    if (!isBegun && changes.part !== (sequence === this.begun ? this.parts : 0)) return "fetch";
    if (changes.part > 0 || (changes.baseSequence === this.sequence && this.sequence !== 0n)) return "write";
    return changes.baseSequence === 0n ? "begin" : "fetch";
  }

  /** A message of the topic. "fetch": ask for the whole motion and give it to replace(). */
  take(message: Frames): Taken {
    const { changes, result } = message;
    const judged = this.judge(message);
    if (!changes || judged === "nothing" || judged === "fetch") return judged === "fetch" ? "fetch" : "nothing";
    if (judged === "begin") this.begin(message, changes.motionFrames);
    this.write(message);
    if (changes.early) return "written";
    const sequence = result?.sequence ?? 0n;
    this.begun = changes.more ? sequence : 0n;
    this.parts = changes.more ? changes.part + 1 : 0;
    if (changes.more) return "written";
    this.sequence = sequence;
    return "whole";
  }

  /** The whole motion of one result, in parts. */
  replace(parts: Frames[]): void {
    const all = parts.map((part) => reals(part.data));
    this.frames = parts.reduce((sum, part) => sum + part.frameCount, 0);
    this.size = this.frames ? all.reduce((sum, part) => sum + part.length, 0) / this.frames : 0;
    this.data = emptyLike(all[0], this.frames * this.size);
    let at = 0;
    for (const part of all) {
      this.data.set(part, at);
      at += part.length;
    }
    this.basisHash = parts[0]?.basisHash ?? "";
    this.sequence = parts[0]?.result?.sequence ?? 0n;
    this.begun = 0n;
    this.parts = 0;
  }

  private begin(message: Frames, frames: number): void {
    const numbers = reals(message.data);
    this.size = message.frameCount ? numbers.length / message.frameCount : 0;
    this.frames = frames;
    this.data = emptyLike(numbers, frames * this.size);
    this.basisHash = message.basisHash;
    this.sequence = 0n;
  }

  private write(message: Frames): void {
    if (message.frameCount === 0) return;
    const numbers = reals(message.data);
    const end = message.firstFrame + message.frameCount;
    if (numbers.length !== message.frameCount * this.size || end > this.frames) {
      throw new LimberError("MALFORMED", "frames that do not fit the motion", "frames");
    }
    this.data.set(numbers, message.firstFrame * this.size);
  }
}

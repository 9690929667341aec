/**
 * How many edits one undo takes back. A drag is many revisions and one step for its user; edits from before this page
 * came are undone one revision at a time. The server undoes a named client's own edits (isOwn), independent of the
 * edits of others. Without a name it undoes the newest edit, and then edits of others are also undone one revision at a
 * time.
 */
interface Gesture {
  revisions: number;
  /** The session's revision when it ended. */
  last: bigint;
}

/** Undos of one request: the server keeps a thousand. */
const MOST = 1000;

export class History {
  private done: Gesture[] = [];
  private undone: Gesture[] = [];

  /** An edit of this page was accepted. isContinued: it belongs to the gesture before. */
  edited(revision: bigint, isContinued = false, isOwn = false): void {
    const newest = this.done.at(-1);
    if (isContinued && newest && (isOwn || newest.last === revision - 1n)) {
      newest.revisions = Math.min(MOST, newest.revisions + 1);
      newest.last = revision;
    } else {
      this.done.push({ revisions: 1, last: revision });
    }
    this.undone = [];
  }

  /** Revisions to undo, where `newest` is the session's. */
  undo(newest: bigint, isOwn = false): number {
    const gesture = this.done.at(-1);
    return gesture && (isOwn || gesture.last === newest) ? gesture.revisions : 1;
  }

  undid(count: number, revision: bigint): void {
    const gesture = this.done.pop();
    this.undone.push({ revisions: count, last: revision });
    if (gesture && gesture.revisions !== count) this.done = [];
    const before = this.done.at(-1);
    if (before) before.last = revision;
  }

  redo(newest: bigint, isOwn = false): number {
    const gesture = this.undone.at(-1);
    return gesture && (isOwn || gesture.last === newest) ? gesture.revisions : 1;
  }

  redid(count: number, revision: bigint): void {
    this.undone.pop();
    this.done.push({ revisions: count, last: revision });
    const before = this.undone.at(-1);
    if (before) before.last = revision;
  }
}

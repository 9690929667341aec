/** Times from a sent edit to the first motion in this page that contains it. */
const KEPT = 200;

export class Latency {
  private readonly sent = new Map<bigint, number>();
  private readonly times: number[] = [];
  newest = Number.NaN;

  /** at: performance.now() when the edit was sent. */
  edited(revision: bigint, at: number): void {
    this.sent.set(revision, at);
  }

  /** A motion that contains `revision` is in memory. */
  arrived(revision: bigint, now: number): void {
    for (const [edit, at] of this.sent) {
      if (edit > revision) continue;
      this.sent.delete(edit);
      this.newest = now - at;
      this.times.push(this.newest);
    }
    if (this.times.length > KEPT) this.times.splice(0, this.times.length - KEPT);
  }

  /** share 0.5: half of the times are below. NaN before the first. */
  quantile(share: number): number {
    const sorted = [...this.times].sort((a, b) => a - b);
    return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? Number.NaN;
  }
}

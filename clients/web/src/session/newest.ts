/**
 * Sends values one at a time: while one is on its way, newer ones replace what waits, and the newest goes next. A drag
 * therefore has one edit in flight, however fast the pointer moves.
 */
export class NewestWins<T> {
  private waiting: { value: T } | null = null;
  private running: Promise<void> | null = null;

  constructor(
    private readonly send: (value: T) => Promise<void>,
    private readonly failed: (error: unknown) => void,
  ) {}

  put(value: T): void {
    this.waiting = { value };
    this.running ??= this.run();
  }

  /** Resolves when nothing waits and nothing is on its way. */
  async idle(): Promise<void> {
    await this.running;
  }

  private async run(): Promise<void> {
    while (this.waiting) {
      const { value } = this.waiting;
      this.waiting = null;
      try {
        await this.send(value);
      } catch (error) {
        this.failed(error);
      }
    }
    this.running = null;
  }
}

/** A WebSocket that opens itself again: after 0.2 s, then twice as long each time, at most 5 s; 0.2 s again after a connection of 5 s. */
export type SocketState = "connecting" | "open" | "lost" | "closed";

export interface SocketHandlers {
  /** After every opening, the first one too. */
  opened(): void;
  received(data: Uint8Array): void;
  changed(state: SocketState): void;
}

const FIRST_WAIT_MS = 200;
const LONGEST_WAIT_MS = 5000;
/** A shorter connection does not count: a server that closes each one is not asked again and again at once. */
const LASTING_MS = 5000;

export class Socket {
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT_MS;
  private timer = 0;
  private openedAt = Number.POSITIVE_INFINITY;
  private isClosed = false;

  constructor(
    private readonly url: string,
    private readonly handlers: SocketHandlers,
  ) {
    this.open();
  }

  get isOpen(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** False where nothing was sent: the connection is not there. */
  send(data: Uint8Array): boolean {
    if (!this.isOpen) return false;
    this.socket?.send(data as Uint8Array<ArrayBuffer>);
    return true;
  }

  /** Tries at once, where it waits for its next try. */
  retry(): void {
    if (!this.timer) return;
    window.clearTimeout(this.timer);
    this.open();
  }

  close(): void {
    this.isClosed = true;
    window.clearTimeout(this.timer);
    this.socket?.close();
    this.handlers.changed("closed");
  }

  private open(): void {
    this.timer = 0;
    this.openedAt = Number.POSITIVE_INFINITY;
    this.handlers.changed("connecting");
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.openedAt = performance.now();
      this.handlers.changed("open");
      this.handlers.opened();
    };
    socket.onmessage = (event) => this.handlers.received(new Uint8Array(event.data as ArrayBuffer));
    socket.onclose = () => {
      if (this.isClosed || this.socket !== socket) return;
      this.handlers.changed("lost");
      if (performance.now() - this.openedAt >= LASTING_MS) this.wait = FIRST_WAIT_MS;
      this.timer = window.setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(LONGEST_WAIT_MS, this.wait * 2);
    };
    this.socket = socket;
  }
}

import assert from "node:assert/strict";
import { type TestContext, test } from "node:test";
import { Socket } from "../src/wire/socket";

class FakeSocket {
  static readonly OPEN = 1;
  static all: FakeSocket[] = [];
  readyState = 1;
  onopen = (): void => undefined;
  onclose = (): void => undefined;
  constructor() {
    FakeSocket.all.push(this);
  }
}

/** What passes between the end of a connection and the next try. */
function waits(context: TestContext, lives: number[]): number[] {
  FakeSocket.all = [];
  let now = 0;
  const asked: number[] = [];
  const due: (() => void)[] = [];
  const globals = globalThis as unknown as Record<string, unknown>;
  const before = { WebSocket: globals.WebSocket, window: globals.window };
  globals.WebSocket = FakeSocket;
  globals.window = {
    setTimeout: (then: () => void, wait: number) => {
      asked.push(wait);
      return due.push(then);
    },
    clearTimeout: () => undefined,
  };
  context.mock.method(performance, "now", () => now);
  try {
    new Socket("ws://x", { opened: () => undefined, received: () => undefined, changed: () => undefined });
    for (const life of lives) {
      const socket = FakeSocket.all.at(-1);
      if (life > 0) socket?.onopen(); // 0: it never opens
      now += life;
      socket?.onclose();
      due.at(-1)?.();
    }
  } finally {
    Object.assign(globals, before);
  }
  return asked;
}

test("a server that closes each connection at once is asked ever more rarely", (context) => {
  assert.deepEqual(waits(context, [10, 10, 0, 4000, 10, 10, 10]), [200, 400, 800, 1600, 3200, 5000, 5000]);
});

test("after a connection that lasted the next try comes soon", (context) => {
  assert.deepEqual(waits(context, [10, 10, 6000, 10, 60000, 0]), [200, 400, 200, 400, 200, 400]);
});

import assert from "node:assert/strict";
import { test } from "node:test";
import { History } from "../src/session/history";
import { Latency } from "../src/session/latency";
import { NewestWins } from "../src/session/newest";

test("one value is on its way at a time, and the newest goes next", async () => {
  const sent: number[] = [];
  let release = (): void => undefined;
  const pump = new NewestWins<number>(
    (value) => {
      sent.push(value);
      return new Promise((resolve) => {
        release = resolve;
      });
    },
    () => assert.fail(),
  );
  pump.put(1);
  pump.put(2);
  pump.put(3);
  assert.deepEqual(sent, [1]);
  release();
  await new Promise((resolve) => setTimeout(resolve, 0));
  assert.deepEqual(sent, [1, 3]);
  release();
  await pump.idle();
  pump.put(4);
  assert.deepEqual(sent, [1, 3, 4]);
});

test("a refused edit is told, and the next one is sent all the same", async () => {
  const sent: number[] = [];
  const failed: unknown[] = [];
  const pump = new NewestWins<number>(
    async (value) => {
      sent.push(value);
      if (value === 1) throw new Error("refused");
    },
    (error) => failed.push(error),
  );
  pump.put(1);
  pump.put(2);
  await pump.idle();
  assert.deepEqual(sent, [1, 2]);
  assert.equal(failed.length, 1);
});

test("a drag is one step of undo, and of redo", () => {
  const history = new History();
  history.edited(1n);
  history.edited(2n);
  history.edited(3n, true);
  history.edited(4n, true);
  assert.equal(history.undo(4n), 3);
  history.undid(3, 5n);
  assert.equal(history.undo(5n), 1);
  assert.equal(history.redo(5n), 3);
  history.redid(3, 6n);
  assert.equal(history.undo(6n), 3);
});

test("who has a name takes back a whole drag whatever others did meanwhile", () => {
  const history = new History();
  history.edited(1n, false, true);
  history.edited(3n, true, true);
  assert.equal(history.undo(4n, true), 2);
  history.undid(2, 5n);
  assert.equal(history.redo(6n, true), 2);
});

test("what others did since is taken back one by one", () => {
  const history = new History();
  history.edited(1n);
  history.edited(2n, true);
  assert.equal(history.undo(3n), 1);
  history.edited(5n, true);
  assert.equal(history.undo(5n), 1);
});

test("an edit ends with the first motion that contains it", () => {
  const latency = new Latency();
  latency.edited(1n, 100);
  latency.edited(2n, 110);
  latency.arrived(1n, 120);
  assert.equal(latency.newest, 20);
  latency.arrived(5n, 140);
  assert.equal(latency.newest, 30);
  latency.arrived(6n, 999);
  assert.equal(latency.newest, 30);
  assert.equal(latency.quantile(0), 20);
});

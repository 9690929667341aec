import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { type Packed, unpack, unpackMessage } from "../src/player/data";

const base64 = (values: { buffer: ArrayBufferLike }): string => Buffer.from(values.buffer).toString("base64");
const packed: Packed = {
  rows: 2,
  columns: 3,
  low: base64(Float32Array.of(-1, 0, 5)),
  step: base64(Float32Array.of(0.5, 0, 1 / 65535)),
  numbers: base64(Uint16Array.of(0, 0, 65535, 4, 0, 0)),
};

test("numbers of 16 bits lie between the ends of their columns", () => {
  assert.deepEqual([...unpack(packed)], [-1, 0, 6, 1, 0, 5]);
  assert.deepEqual(unpackMessage(packed).shape, [2n, 3n]);
  assert.throws(() => unpack({ ...packed, rows: 3 }), /damaged/);
});

test("the player is one file that asks for nothing", () => {
  const html = readFileSync("../python/limber/data/player.html", "utf8");
  assert.ok(html.includes("default-src 'none'") && html.includes('"/*motion*/"'));
  assert.ok(!/<(script|link|img)[^>]*\b(src|href)=/.test(html), "it refers to another file");
  assert.match(html, /three 0\.[0-9.]+: MIT/);
  assert.equal(html.match(/<script/g)?.length, html.match(/<\/script/g)?.length);
});

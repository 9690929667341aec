import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { crc32, zip } from "../src/page/zip";

test("checksums are those of the standard", () => {
  assert.equal(crc32(new TextEncoder().encode("123456789")), 0xcbf43926);
});

test("another program reads the archive", () => {
  const folder = mkdtempSync(join(tmpdir(), "limber-zip-"));
  const file = join(folder, "a.zip");
  const text = new TextEncoder().encode("hello");
  writeFileSync(
    file,
    Buffer.concat(
      zip([
        { name: "one.txt", content: text },
        { name: "ä.txt", content: new Uint8Array(0) },
      ]),
    ),
  );
  const read =
    "import sys, zipfile; z = zipfile.ZipFile(sys.argv[1]); assert z.testzip() is None; print(z.namelist(), z.read('one.txt'))";
  const done = spawnSync("python3", ["-c", read, file], { encoding: "utf8" });
  assert.equal(done.stdout.trim(), "['one.txt', 'ä.txt'] b'hello'");
  assert.ok(readFileSync(file).length > 100);
  rmSync(folder, { recursive: true });
});

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";
import { gzipSync } from "node:zlib";

const MOST_BYTES = 350_000;

test("the page is small", () => {
  const parts = readdirSync("dist").filter((name) => /\.(js|css|html)$/.test(name));
  assert.ok(parts.includes("main.js") && parts.includes("main.css"), "build the page first: npm run build");
  const bytes = parts.reduce((sum, name) => sum + gzipSync(readFileSync(`dist/${name}`)).length, 0);
  assert.ok(bytes < MOST_BYTES, `${bytes} bytes gzipped`);
});

test("licences of what is bundled go with it, and NOTICE.md names it", () => {
  const { dependencies } = JSON.parse(readFileSync("package.json", "utf8")) as { dependencies: Record<string, string> };
  const notices = readFileSync("dist/third-party-notices.txt", "utf8");
  const ours = readFileSync("../../NOTICE.md", "utf8");
  for (const name of Object.keys(dependencies)) {
    assert.ok(notices.includes(`${name} ${dependencies[name]}`), `${name} is not in the notices`);
    assert.ok(ours.includes(name), `${name} is not in NOTICE.md`);
  }
  assert.match(notices, /MIT License/);
});

test("the page has no inline scripts or styles, which its policy refuses", () => {
  const html = readFileSync("dist/index.html", "utf8");
  assert.ok(!/<script(?![^>]*\bsrc=)/.test(html) && !/<style|\sstyle=|\son[a-z]+=/.test(html));
});

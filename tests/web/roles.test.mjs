import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { test } from "node:test";
import { BIN, openSample, serve, settle, until, visit } from "./support.mjs";

let browser;
const server = serve((launched) => {
  browser = launched;
});

/** The address of a page that may do this. */
const addressOf = (role) => {
  const command = ["--endpoint", server.requests, "web", "--no-open", "--role", role];
  return execFileSync(join(BIN, "limber"), command, { encoding: "utf8" }).trim();
};

test("a page that may only look shows the motion, and changes nothing", async () => {
  const editing = await visit(browser, server.url);
  await openSample(editing, "beam");
  const looking = await visit(browser, addressOf("view"));
  await looking.click("[data-session]");
  await settle(looking);
  await until(looking, () => document.querySelector(".state").textContent === "connected, to look only");
  const said = await editing.locator(".state").textContent();
  assert.equal(said, "connected");
  const revision = await editing.evaluate(() => String(window.limber.opened.session.revision));
  await looking.evaluate(() => window.limber.opened.undo());
  await until(looking, () => /needs the role edit/.test(document.querySelector(".notices").textContent));
  assert.equal(await editing.evaluate(() => String(window.limber.opened.session.revision)), revision);
});

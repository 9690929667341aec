import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { drag, drop, openPanels, openSample, ROOT, Server, seen, serve, settle, until, visit } from "./support.mjs";

let browser;
const server = serve((launched) => {
  browser = launched;
});

const FRAME = 40;
const TIP = 1336;
const tip = async (page) => {
  await page.evaluate((frame) => window.limber.opened.goTo(frame), FRAME);
  const at = await page.evaluate(
    ([node, frame]) => {
      const { workspace, session } = window.limber.opened;
      return workspace.surface.basis.mean([node], session.motion.frame(frame));
    },
    [TIP, FRAME],
  );
  return seen(page, at);
};
const constraints = (page, count) =>
  until(page, (count) => window.limber.opened?.session.scene?.constraints.length === count, count);

test("two pages see each other's edits", async () => {
  const first = await visit(browser, server.url);
  await openSample(first, "beam");
  const count = await first.evaluate(() => window.limber.opened.session.scene.constraints.length);
  const second = await visit(browser, server.url);
  await second.click("[data-session]");
  await settle(second);
  await drag(first, await tip(first), [0, -30]);
  await settle(first, 1);
  await constraints(second, count + 1);
  const revision = await first.evaluate(() => Number(window.limber.opened.session.revision));
  await settle(second, revision);
  await until(second, () =>
    /page-[0-9a-f]{8} edited.*constraint \d+ (added|changed)/.test(document.querySelector(".notices").textContent),
  );
  const motions = await Promise.all(
    [first, second].map((page) => page.evaluate(() => [...window.limber.opened.session.motion.data.slice(0, 5000)])),
  );
  assert.deepEqual(motions[0], motions[1]);
  // Who has edited nothing has nothing to take back.
  const target = (page) => page.evaluate(() => window.limber.opened.session.scene.constraints.at(-1).target.value);
  const dragged = await target(first);
  await second.locator("canvas.view").focus();
  await second.keyboard.press("Control+z");
  await second.waitForSelector(".notice.bad");
  assert.equal(await first.evaluate(() => Number(window.limber.opened.session.revision)), revision);
  assert.deepEqual(await target(first), dragged);
  await first.locator("canvas.view").focus();
  await first.keyboard.press("Control+z");
  await until(second, (revision) => window.limber.opened.session.revision > BigInt(revision), revision);
  await constraints(second, count);
  const people = (page) => page.locator('[data-test="people"] li').allTextContents();
  const made = (page) => page.locator('[data-test="revisions"]').textContent();
  await until(first, () => /this page undid/.test(document.querySelector('[data-test="revisions"]').textContent));
  assert.match(await made(second), /page-[0-9a-f]{8} (added|moved) a constraint/);
  assert.match(await made(first), /this page (added|moved) a constraint.*this page opened the session/);
  // What was said can be read again once it has gone.
  await second.locator("[data-test=messages] summary").click();
  await second.locator(".notice button").first().click();
  assert.match(
    await second.locator("[data-test=messages]").textContent(),
    /problem: .*page-[0-9a-f]{8} edited, revision/,
  );
  await second.locator("[data-test=messages] summary").click();
  await openPanels(second, "People");
  await second.getByLabel("Your name here").fill("Ben");
  await second.getByRole("button", { name: "Use this name" }).click();
  await until(first, () => /Ben, here for/.test(document.querySelector('[data-test="people"]').textContent));
  assert.equal((await people(first)).length, 2);
  await second.click(".brand");
  await until(first, () => document.querySelectorAll('[data-test="people"] li').length === 1);
  assert.match((await people(first))[0], /page-[0-9a-f]{8} \(this page\)/);
  assert.deepEqual(first.faults.concat(second.faults), []);
});

/** The names by which the server knows who is in the session of this page. */
const names = (page) => page.evaluate(() => window.limber.opened.session.status.clients.map(({ name }) => name));

test("a duplicated tab takes back nothing of the first one's", async () => {
  const first = await visit(browser, server.url);
  await openSample(first, "beam");
  await drag(first, await tip(first), [0, -30]);
  await settle(first, 1);
  const revision = await first.evaluate(() => Number(window.limber.opened.session.revision));
  const stored = () => sessionStorage.getItem("limber-tab");
  const name = await first.evaluate(stored);
  // As a duplicated tab has it, window.open() gives a tab a copy of what this one has stored.
  const [second] = await Promise.all([
    first.context().waitForEvent("page"),
    first.evaluate(() => void window.open(location.href)),
  ]);
  await second.waitForSelector('body[data-connection="open"]');
  await settle(second);
  await until(first, () => window.limber.opened.session.status.clients.length === 2);
  assert.equal(new Set(await names(first)).size, 2);
  assert.notEqual(await second.evaluate(stored), name);
  await second.locator("canvas.view").focus();
  await second.keyboard.press("Control+z");
  await second.waitForSelector(".notice.bad");
  assert.equal(await first.evaluate(() => Number(window.limber.opened.session.revision)), revision);
  // A page that is loaded anew keeps its name, and with it what it can take back.
  await first.reload();
  await first.waitForSelector('body[data-connection="open"]');
  await settle(first, revision);
  assert.equal(await first.evaluate(stored), name);
  await first.locator("canvas.view").focus();
  await first.keyboard.press("Control+z");
  await until(second, (revision) => window.limber.opened.session.revision > BigInt(revision), revision);
});

test("a page without locks has a name, as from an address without a certificate", async () => {
  const page = await visit(browser, server.url, {}, () => {
    Object.defineProperty(Navigator.prototype, "locks", { get: () => undefined });
  });
  await openSample(page, "beam");
  await until(page, () => window.limber.opened.session.status?.clients.length === 1);
  assert.match((await names(page))[0], /^page-[0-9a-f]{8}$/);
  assert.deepEqual(page.faults, []);
});

test("a server that is killed and comes back finds the page's session again", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "beam");
  const count = await page.evaluate(() => window.limber.opened.session.scene.constraints.length);
  await drag(page, await tip(page), [0, -30]);
  await settle(page, 1);
  await constraints(page, count + 1);
  // The server's answers leave out poses of keyframes: the page has to remember them.
  await openPanels(page, "Keyframes");
  await page.getByLabel("Frame of the new keyframe").fill("30");
  await page.getByRole("button", { name: "Add", exact: true }).click();
  await until(page, () => window.limber.opened.session.scene.keyframes.length === 1);
  await settle(page, 2);
  const before = await page.evaluate(() => ({
    name: window.limber.opened.session.name.session,
    uid: String(window.limber.opened.session.name.uid),
  }));
  await server.kill();
  await page.waitForSelector('body[data-connection="lost"], body[data-connection="connecting"]');
  await server.start(server.address);
  await until(page, (uid) => String(window.limber.opened?.session.name.uid ?? uid) !== uid, before.uid);
  await settle(page);
  await constraints(page, count + 1);
  assert.equal(await page.evaluate(() => window.limber.opened.session.scene.keyframes[0]?.frame), 30);
  assert.equal(await page.evaluate(() => window.limber.opened.session.name.session), before.name);
  assert.match(await page.locator(".notices").textContent(), /The server was restarted/);
  await drag(page, await tip(page), [0, 20]);
  await settle(page, 1);
  assert.deepEqual(page.faults, []);
});

test("a server that keeps its sessions is killed, and the page's session goes on with its undo", async () => {
  const kept = new Server(["--data", "FOLDER"]);
  try {
    await kept.start();
    const page = await visit(browser, kept.url);
    await openSample(page, "beam");
    const count = await page.evaluate(() => window.limber.opened.session.scene.constraints.length);
    const uid = await page.evaluate(() => String(window.limber.opened.session.name.uid));
    await drag(page, await tip(page), [0, -30]);
    await settle(page, 1);
    const revision = await page.evaluate(() => Number(window.limber.opened.session.revision));
    await kept.kill();
    await page.waitForSelector('body[data-connection="lost"], body[data-connection="connecting"]');
    await kept.start(kept.address);
    // The motion is never beside a basis of other columns, with which nothing would be drawn.
    await page.evaluate(() => {
      window.blank = 0;
      window.setInterval(() => {
        const { workspace, session } = window.limber.opened ?? {};
        const columns = workspace?.surface?.basis?.columns;
        if (columns && session.motion.frames && columns !== session.motion.size) window.blank++;
      }, 20);
    });
    await until(page, () => /it has kept the session/.test(document.querySelector(".notices").textContent));
    await settle(page, revision);
    await constraints(page, count + 1);
    assert.equal(await page.evaluate(() => String(window.limber.opened.session.name.uid)), uid);
    assert.equal(await page.evaluate(() => window.blank), 0, "the picture was empty");
    await page.getByRole("button", { name: "Undo" }).click();
    await until(page, (before) => window.limber.opened.session.revision > BigInt(before), revision);
    assert.deepEqual(page.faults, []);
  } finally {
    await kept.close();
  }
});

test("a page without its token is told so, and gets nothing", async () => {
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.goto(`http://${server.address}/`);
  await until(page, () => /no token, or an old one/.test(document.querySelector(".notices")?.textContent ?? ""));
  assert.equal(await page.locator("[data-sample]").count(), 0);
});

test("a reloaded page is in its session again, and its token is in no address", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "beam");
  const name = await page.evaluate(() => window.limber.opened.session.name.session);
  assert.ok(!page.url().includes("token"));
  await page.reload();
  await settle(page);
  assert.equal(await page.evaluate(() => window.limber.opened.session.name.session), name);
});

test("dropped files are opened, and what is wrong with them is said in words", async () => {
  const page = await visit(browser, server.url);
  const notices = page.locator(".notices");
  await drop(page, [{ name: "bad.json", text: '{"mesh": {"sample": "beam"}, "frames": 2, "fixed_nodes": [999999]}' }]);
  await until(page, () => document.querySelectorAll(".notice.bad").length >= 2);
  assert.match(await notices.textContent(), /frames/);
  assert.match(await notices.textContent(), /fixed nodes/);
  await drop(page, [{ name: "letter.docx", text: "x" }]);
  await until(page, () => /no file that this page knows/.test(document.querySelector(".notices").textContent));
  await drop(page, [{ name: "good.json", text: '{"name": "mine", "mesh": {"sample": "beam"}, "frames": 60}' }]);
  await settle(page);
  assert.equal(await page.evaluate(() => window.limber.opened.session.motion.frames), 60);
  await page.getByLabel("limber: back to the list").click();

  const lines = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 0\nl 1 5\nl 5 3\nl 2 5\nl 5 4\n";
  await drop(page, [{ name: "cross.obj", text: lines }]);
  await page.getByRole("button", { name: "Open", exact: true }).click();
  await settle(page);
  assert.equal(await page.evaluate(() => window.limber.opened.session.kind), "linkages");
  await page.getByLabel("limber: back to the list").click();

  const surface = readFileSync(join(ROOT, "tests/web/tetrahedron.obj"), "utf8");
  await drop(page, [{ name: "tetrahedron.obj", text: surface }]);
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByLabel("At most this far").fill("8");
  await page.getByRole("button", { name: "Fill it" }).click();
  await page.getByLabel("Frames of its motion").fill("30");
  await page.getByRole("button", { name: "Open", exact: true }).click();
  await settle(page);
  assert.equal(await page.evaluate(() => window.limber.opened.session.motion.frames), 30);
  assert.deepEqual(page.faults, []);
});

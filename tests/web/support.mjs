// What the tests of the page share: a limberd with --web, a browser with WebGL, and what a person does with the mouse.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, afterEach, before } from "node:test";
import { fileURLToPath } from "node:url";

export const ROOT = join(dirname(fileURLToPath(import.meta.url)), "../..");
const require = createRequire(join(ROOT, "clients/web/package.json"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core"), "utf8");

export const BIN = process.env.LIMBER_BIN ?? join(ROOT, "build/release/bin");
const PICTURES = process.env.LIMBER_PICTURES ?? "";
const PATIENCE_MS = 120_000;
const CHROMIUM = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find((path) =>
  existsSync(path),
);
const FLAGS = [
  "--no-sandbox",
  "--enable-unsafe-swiftshader",
  "--use-gl=angle",
  "--use-angle=swiftshader",
  "--ignore-gpu-blocklist",
];

/** A limberd that serves the page of clients/web/dist. */
export class Server {
  /** options: of limberd besides; FOLDER in them is one of the server's own. */
  constructor(options = []) {
    this.options = options;
    this.folder = mkdtempSync(join(tmpdir(), "limber-web-"));
    this.token = join(this.folder, "token");
    writeFileSync(this.token, "0123456789abcdef0123456789abcdef", { mode: 0o600 });
  }

  /** address: HOST:PORT of an earlier run, to come back at. */
  async start(address = "127.0.0.1:0") {
    const ready = join(this.folder, "ready.json");
    rmSync(ready, { force: true });
    const options = [
      "--bind",
      "tcp://127.0.0.1:0",
      "--stream",
      "tcp://127.0.0.1:0",
      "--ready-file",
      ready,
      "--web",
      address,
    ];
    options.push(...this.options.map((option) => (option === "FOLDER" ? join(this.folder, "data") : option)));
    const page = ["--web-root", join(ROOT, "clients/web/dist"), "--web-token-file", this.token];
    this.process = spawn(join(BIN, "limberd"), [...options, ...page], { stdio: ["ignore", "ignore", "pipe"] });
    this.ended = new Promise((resolve) => this.process.once("exit", resolve));
    let said = "";
    this.process.stderr.on("data", (data) => (said += data));
    for (let tries = 0; !existsSync(ready); tries++) {
      assert.ok(tries < 200 && this.process.exitCode === null, `limberd did not start: ${said}`);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    const { requests, web, web_token } = JSON.parse(readFileSync(ready, "utf8"));
    this.requests = requests;
    this.address = web.replace("http://", "");
    this.url = `${web}/?token=${web_token}`;
  }

  async kill() {
    this.process.kill("SIGKILL");
    await this.ended;
  }

  async close() {
    if (this.process && this.process.exitCode === null) await this.kill();
    rmSync(this.folder, { recursive: true, force: true });
  }
}

/** The limberd and the browser of one file's tests; `launched` gets the browser before the first. */
export function serve(launched) {
  const server = new Server();
  let browser;
  before(async () => {
    await server.start();
    browser = await launch();
    launched(browser);
  });
  // What a failed test left open would draw on beside the next one.
  afterEach(() => Promise.all(browser.contexts().map((context) => context.close())));
  after(async () => {
    await browser?.close();
    await server.close();
  });
  return server;
}

/** One browser; fails where it has no WebGL 2, since every picture would then be missing. */
export async function launch() {
  assert.ok(CHROMIUM, "no Chromium: install the package chromium");
  const browser = await chromium.launch({ executablePath: CHROMIUM, headless: true, args: FLAGS });
  const page = await browser.newPage();
  const isThere = await page.evaluate(() => document.createElement("canvas").getContext("webgl2") !== null);
  await page.close();
  assert.ok(isThere, "this browser has no WebGL 2");
  return browser;
}

/** A page whose errors fail the test that looks at them: page.faults. before: is run in the page before its own scripts. */
export async function visit(browser, url, options = {}, before = () => undefined) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, ...options });
  const page = await context.newPage();
  await page.addInitScript(before);
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(error.message));
  page.on("console", (message) => {
    if (message.type() === "error" && !/WebSocket|ERR_CONNECTION/.test(message.text()))
      page.faults.push(message.text());
  });
  await page.goto(url);
  await page.waitForSelector('body[data-connection="open"]');
  return page;
}

/** Until a condition of the page's own objects holds. */
export async function until(page, condition, argument) {
  try {
    await page.waitForFunction(condition, argument, { timeout: PATIENCE_MS, polling: 50 });
  } catch (error) {
    const said = await page.evaluate(() => [
      document.querySelector("main")?.dataset,
      document.querySelector(".notices")?.textContent,
    ]);
    throw new Error(`waited in vain for ${condition}; the page says ${JSON.stringify(said)}`, { cause: error });
  }
}

/** The newest revision is final, its scene and frames are in the page, and no edit follows within a quarter of a second. */
export async function settle(page, least = 0) {
  for (let before = -1; ; ) {
    await until(
      page,
      (least) => {
        const session = window.limber.opened?.session;
        const result = session?.result;
        const isFinal = result?.converged && result.revision === session.revision && result.revision >= BigInt(least);
        const isHere =
          isFinal && session.motion.sequence === result.sequence && session.sceneRevision === session.revision;
        const isShown = document.querySelector("main").dataset.shown === String(session?.motion.sequence);
        return Boolean(isHere && isShown && session.motion.frames > 0);
      },
      least,
    );
    const now = await revision(page);
    if (now === before) return;
    before = now;
    await page.waitForTimeout(250);
  }
}

export async function openSample(page, name) {
  await page.click(`[data-sample=${name}]`);
  await settle(page);
}

/** Where a point of the scene is on the page. */
export function seen(page, point) {
  return page.evaluate((point) => {
    const { stage } = window.limber.opened;
    const at = stage.project(stage.controls.target.clone().set(...point));
    const box = stage.canvas.getBoundingClientRect();
    return [at.x + box.left, at.y + box.top];
  }, point);
}

/** Presses the mouse at a point and moves it by so many pixels, as a hand does. */
export async function drag(page, [x, y], [dx, dy], steps = 12) {
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let step = 1; step <= steps; step++) {
    await page.mouse.move(x + (dx * step) / steps, y + (dy * step) / steps);
    await page.waitForTimeout(25);
  }
  await page.mouse.up();
}

export function revision(page) {
  return page.evaluate(() => Number(window.limber.opened.session.revision));
}

/** Positions of one frame as the server holds them: encoded by the server, not by the page's own arithmetic. */
export function serverPositions(page, frame) {
  return page.evaluate(async (frame) => {
    const { session } = window.limber.opened;
    const POSITIONS = 2;
    const wanted = { session: session.reference, firstFrame: frame, frameCount: 1, encoding: POSITIONS };
    const { frames } = await session.connection.call("getFrames", wanted);
    return [...new Float32Array(frames.data.data.slice().buffer)];
  }, frame);
}

/** Files as they are dropped on the page. */
export function drop(page, files) {
  return page.evaluate((files) => {
    const transfer = new DataTransfer();
    for (const { name, text } of files) transfer.items.add(new File([text], name));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
  }, files);
}

/** Opens all panels, or the one whose title begins so alone. */
export function openPanels(page, title = "") {
  return page.evaluate((title) => {
    for (const panel of document.querySelectorAll("details")) {
      panel.open = panel.querySelector("summary").textContent.startsWith(title);
    }
  }, title);
}

/** Boxes of the sidebar, panels open, that are wider than it, in words. */
export function wideBoxes(page) {
  return page.evaluate(() => {
    const sidebar = document.querySelector(".sidebar");
    const right = sidebar.getBoundingClientRect().left + sidebar.clientLeft + sidebar.clientWidth;
    const wide = [...sidebar.querySelectorAll("*")].filter((one) => one.getBoundingClientRect().right > right + 0.5);
    const scrolled = sidebar.scrollWidth > sidebar.clientWidth ? ["the sidebar scrolls sideways"] : [];
    return [...scrolled, ...wide.map((one) => one.outerHTML.slice(0, 120))];
  });
}

export function distance(a, b) {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/** Serious faults that axe finds, in words. */
export async function accessibilityFaults(page) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  const serious = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  return serious.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html.slice(0, 120)).join(" | ")}`);
}

/** Pixels of the picture that are of what it shows, neither ground nor grid. */
export async function drawnPixels(page) {
  const box = await page.locator("canvas.view").boundingBox();
  const picture = (await page.screenshot({ clip: box })).toString("base64");
  const blank = await page.context().browser().newPage();
  const count = await blank.evaluate(async (picture) => {
    const image = new Image();
    image.src = `data:image/png;base64,${picture}`;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let colored = 0;
    for (let i = 0; i < data.length; i += 4) {
      const most = Math.max(data[i], data[i + 1], data[i + 2]);
      if (most - Math.min(data[i], data[i + 1], data[i + 2]) > 40) colored++;
    }
    return colored;
  }, picture);
  await blank.close();
  return count;
}

/** Kept where LIMBER_PICTURES names a folder: the pictures of the README and the guide. */
export async function keepPicture(page, name) {
  if (!PICTURES) return;
  mkdirSync(PICTURES, { recursive: true });
  // Without a GPU edges are not smoothed: drawn at twice the size they are.
  await page.evaluate(async () => {
    document.activeElement?.blur();
    const stage = window.limber.opened?.stage;
    if (!stage) return;
    stage.renderer.setPixelRatio(2);
    stage.resize();
    await new Promise((resolve) => setTimeout(resolve, 1500));
  });
  await page.screenshot({ path: join(PICTURES, `${name}.png`) });
  await page.evaluate(() => {
    window.limber.opened?.stage.renderer.setPixelRatio(1);
    window.limber.opened?.stage.resize();
  });
}

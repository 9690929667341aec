// Motions saved as one .html by the Python client play from a file, without a server and without a network.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { accessibilityFaults, BIN, drawnPixels, launch, ROOT, until } from "./support.mjs";

const SAVE = `
import json, sys, limber
with limber.launch() as server:
    corners = {}
    for name in ("flower", "hyperboloid", "gridshell"):
        session = server.open(sample=name, progress=False)
        session.wait()
        session.save_html(f"{sys.argv[1]}/{name}.html")
        if name == "flower":
            positions, surface = session.frames(), session.geometry().surface
            corners[name] = [[positions[frame, node].tolist() for node in (957, int(surface[0, 0]))] for frame in (0, 150)]
    print(json.dumps(corners))
`;
const MOST_BYTES = 3e6;

let folder;
let browser;
let corners;
before(async () => {
  folder = mkdtempSync(join(tmpdir(), "limber-player-"));
  const env = { ...process.env, PYTHONPATH: join(ROOT, "clients/python"), LIMBER_BIN: BIN };
  const made = spawnSync("/usr/bin/python3", ["-c", SAVE, folder], { env, encoding: "utf8" });
  assert.equal(made.status, 0, made.stderr);
  corners = JSON.parse(made.stdout);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** A saved motion; whatever it asks for besides itself is a fault. */
async function open(name) {
  const context = await browser.newContext({ viewport: { width: 900, height: 600 } });
  const page = await context.newPage();
  const url = pathToFileURL(join(folder, `${name}.html`)).href;
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(error.message));
  page.on("console", (message) => message.type() === "error" && page.faults.push(message.text()));
  page.on("request", (request) => {
    if (request.url() !== url && !/^(data|blob):/.test(request.url())) page.faults.push(request.url());
  });
  await page.goto(url);
  await until(page, () => window.player?.stage.frames > 0);
  return page;
}

const frame = (page) => page.evaluate(() => window.player.timeline.frame);
const picture = async (page) => (await page.locator("canvas.view").screenshot()).toString("base64");
const drawn = (page) =>
  page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))));

for (const name of ["flower", "hyperboloid", "gridshell"]) {
  test(`${name}: one small file draws, plays, scrubs and turns`, async () => {
    assert.ok(statSync(join(folder, `${name}.html`)).size < MOST_BYTES);
    const page = await open(name);
    assert.ok((await drawnPixels(page)) > 1000, `${name} is not drawn`);
    const first = await picture(page);

    // By the slider to the last frame, and on to one where all of these have moved.
    await page.getByRole("slider").focus();
    await page.keyboard.press("End");
    const frames = await page.evaluate(() => window.player.frames);
    assert.equal(await frame(page), frames - 1);
    const middle = Math.floor(0.4 * frames);
    await page.getByRole("slider").fill(String(middle));
    assert.equal(await frame(page), middle);
    await drawn(page);
    const scrubbed = await picture(page);
    assert.ok(scrubbed !== first, "another frame is drawn as the first");

    const box = await page.locator("canvas.view").boundingBox();
    await page.mouse.move(box.x + 300, box.y + 200);
    await page.mouse.down();
    await page.mouse.move(box.x + 420, box.y + 230, { steps: 4 });
    await page.mouse.up();
    await drawn(page);
    assert.ok((await picture(page)) !== scrubbed, "dragging does not turn it");
    assert.ok((await drawnPixels(page)) > 1000);

    await page.getByRole("button", { name: "Play" }).click();
    await until(
      page,
      () => window.player.timeline.frame > 2 && window.player.timeline.frame < window.player.frames - 1,
    );
    await page.getByRole("button", { name: "Pause" }).click();
    assert.deepEqual(await accessibilityFaults(page), []);
    assert.deepEqual(page.faults, []);
    await page.context().close();
  });
}

test("the flower in the file is the server's", async () => {
  const page = await open("flower");
  // Vertices are those of the surface, in the order of their nodes: the nearest of each is asked for.
  const farthest = await page.evaluate((corners) => {
    const { stored } = window.player;
    const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
    const unpack = ({ columns, low, step, numbers }) => {
      const [lows, steps] = [floats(low), floats(step)];
      const packed = new Uint16Array(Uint8Array.from(atob(numbers), (c) => c.charCodeAt(0)).buffer);
      return Float64Array.from(packed, (value, i) => lows[i % columns] + steps[i % columns] * value);
    };
    const basis = unpack(stored.basis);
    const frames = unpack(stored.frames);
    const { columns } = stored.basis;
    const rows = stored.basis.rows;
    const moved = (frame) =>
      Float64Array.from({ length: rows }, (_, row) => {
        let sum = 0;
        for (let k = 0; k < columns; k++) sum += basis[row * columns + k] * frames[frame * columns + k];
        return sum;
      });
    // What the two nodes did between the frames, against the vertex that did the most alike.
    const [from, to] = [moved(0), moved(150)];
    return Math.max(
      ...[0, 1].map((i) => {
        const step = [0, 1, 2].map((axis) => corners[1][i][axis] - corners[0][i][axis]);
        let least = Infinity;
        for (let row = 0; row < rows; row += 3)
          least = Math.min(least, Math.hypot(...step.map((s, axis) => to[row + axis] - from[row + axis] - s)));
        return least;
      }),
    );
  }, corners.flower);
  assert.ok(farthest < 1e-3, `off by ${farthest}`);
  await page.context().close();
});

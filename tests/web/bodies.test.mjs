import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import {
  accessibilityFaults,
  distance,
  drag,
  drawnPixels,
  keepPicture,
  launch,
  openSample,
  revision,
  Server,
  seen,
  serverPositions,
  settle,
  until,
  visit,
} from "./support.mjs";

const server = new Server();
let browser;
before(async () => {
  await server.start();
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server.close();
});

const FRAME = 150;
const NODE = 957;

/** The flower at a frame, its top in the picture. */
async function flower() {
  const page = await visit(browser, server.url);
  await openSample(page, "flower");
  await page.evaluate((frame) => window.limber.opened.goTo(frame), FRAME);
  const top = await page.evaluate(
    ([node, frame]) => {
      const { workspace, session } = window.limber.opened;
      return workspace.surface.basis.mean([node], session.motion.frame(frame));
    },
    [NODE, FRAME],
  );
  return { page, top, at: await seen(page, top) };
}

test("a point of the flower is dragged, and the server's motion goes there", async () => {
  const { page, at } = await flower();
  assert.ok((await drawnPixels(page)) > 5000, "the flower is not drawn");
  await drag(page, at, [-45, -15]);
  const constraints = () => page.evaluate(() => window.limber.opened.session.scene.constraints.length);
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  await settle(page, 1);
  const constraint = await page.evaluate(() => {
    const { nodes, frame, target } = window.limber.opened.session.scene.constraints.at(-1);
    return { nodes, frame, target: [target.value.x, target.value.y, target.value.z] };
  });
  assert.equal(constraint.frame, FRAME);
  const positions = await serverPositions(page, FRAME);
  const [node] = constraint.nodes;
  const held = positions.slice(3 * node, 3 * node + 3);
  assert.ok(distance(held, constraint.target) < 0.02, `${held} is not near ${constraint.target}`);
  await keepPicture(page, "flower");
  assert.match(await page.locator("[data-test=result]").innerText(), /final, converged/);

  // The whole drag is one step of undo, however many revisions it made.
  const before = await revision(page);
  assert.ok(before > 3, "the drag was one edit");
  await page.keyboard.press("Control+z");
  await until(page, () => window.limber.opened.session.scene.constraints.length === 20);
  await page.keyboard.press("Control+y");
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  assert.equal(await constraints(), 21);
  assert.equal(await revision(page), before + 2);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test("a constraint is moved by its handle, changed in the panel and deleted by its key", async () => {
  const { page, at } = await flower();
  await drag(page, at, [-40, 0]);
  await settle(page, 1);
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  await page.waitForTimeout(600);
  const target = () =>
    page.evaluate(() => {
      const { x, y, z } = window.limber.opened.session.scene.constraints.at(-1).target.value;
      return [x, y, z];
    });
  const first = await target();
  await drag(page, await seen(page, first), [0, 30]);
  await until(page, (y) => window.limber.opened.session.scene.constraints.at(-1).target.value.y < y - 0.01, first[1]);
  await page.getByLabel("Hold exactly").check();
  await until(page, () => window.limber.opened.session.scene.constraints.at(-1).enforcement.case === "exact");
  await settle(page);
  const positions = await serverPositions(page, FRAME);
  const node = await page.evaluate(() => window.limber.opened.session.scene.constraints.at(-1).nodes[0]);
  assert.ok(distance(positions.slice(3 * node, 3 * node + 3), await target()) < 1e-3);
  await page.locator("canvas.view").focus();
  await page.keyboard.press("Delete");
  await until(page, () => window.limber.opened.session.scene.constraints.length === 20);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test("keys scrub and play at the scene's rate", async () => {
  const { page } = await flower();
  const frame = () => page.evaluate(() => window.limber.opened.frame);
  await page.locator("canvas.view").focus();
  await page.keyboard.press("ArrowRight");
  assert.equal(await frame(), FRAME + 1);
  await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("Home");
  assert.equal(await frame(), 0);
  await page.keyboard.press("Space");
  await until(page, () => window.limber.opened.frame > 5);
  assert.equal(await page.evaluate(() => window.limber.opened.workspace.rate), 30);
  await page.keyboard.press("Space");
  assert.equal(await page.evaluate(() => window.limber.opened.timeline.isPlaying), false);
  await page.context().close();
});

test("the GPU's surface is the server's", async () => {
  const { page } = await flower();
  const positions = await serverPositions(page, FRAME);
  const worst = await page.evaluate(
    (positions) => {
      const { workspace, stage } = window.limber.opened;
      const { deformer } = workspace.surface;
      if (!deformer.isOnGpu) return Number.POSITIVE_INFINITY;
      const { side } = deformer;
      const [target] = deformer.targets;
      const texels = new Float32Array(4 * side * target.height);
      stage.renderer.readRenderTargetPixels(target, 0, 0, side, target.height, texels);
      let worst = 0;
      workspace.surface.vertices.forEach((node, i) => {
        for (let axis = 0; axis < 3; axis++) worst = Math.max(worst, Math.abs(texels[4 * i + axis] - positions[3 * node + axis]));
      });
      return worst;
    },
    positions,
  );
  assert.ok(worst < 3e-4, `off by ${worst}`);
  await page.context().close();
});

test("nothing serious for who uses no mouse or sees little", async () => {
  const page = await visit(browser, server.url);
  assert.deepEqual(await accessibilityFaults(page), []);
  await keepPicture(page, "home");
  await openSample(page, "beam");
  await page.evaluate(() => {
    for (const panel of document.querySelectorAll("details")) panel.open = true;
  });
  await page.waitForTimeout(500);
  assert.deepEqual(await accessibilityFaults(page), []);
  await page.context().close();
});

test("a finger drags a point on a tablet", async () => {
  const page = await visit(browser, server.url, { viewport: { width: 820, height: 1180 }, hasTouch: true });
  await openSample(page, "flower");
  await page.evaluate((frame) => window.limber.opened.goTo(frame), FRAME);
  const top = await page.evaluate(
    ([node, frame]) => {
      const { workspace, session } = window.limber.opened;
      return workspace.surface.basis.mean([node], session.motion.frame(frame));
    },
    [NODE, FRAME],
  );
  const [x, y] = await seen(page, top);
  const touch = await page.context().newCDPSession(page);
  const send = (type, points) => touch.send("Input.dispatchTouchEvent", { type, touchPoints: points });
  await send("touchStart", [{ x, y }]);
  for (let step = 1; step <= 8; step++) await send("touchMove", [{ x: x - 5 * step, y }]);
  await send("touchEnd", []);
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  await settle(page, 1);
  await page.waitForTimeout(500);
  await keepPicture(page, "tablet");
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { test } from "node:test";
import {
  accessibilityFaults,
  distance,
  drag,
  drawnPixels,
  drop,
  keepPicture,
  openPanels,
  openSample,
  revision,
  seen,
  serve,
  serverPositions,
  settle,
  until,
  visit,
  wideBoxes,
} from "./support.mjs";

let browser;
const server = serve((launched) => {
  browser = launched;
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

/** What the newest constraint says, and where the point is that it holds in frames of the server. */
async function newestPoint(page) {
  const { point, frame, target, corners } = await page.evaluate(() => {
    const { scene, geometry } = window.limber.opened.session;
    const { point, frame, target } = scene.constraints.at(-1);
    const { triangle, weights, surface } = point;
    const triangles = new Int32Array(geometry.surface.data.slice().buffer);
    return {
      point: { triangle, weights, surface },
      frame,
      target: [target.value.x, target.value.y, target.value.z],
      corners: [...triangles.slice(3 * triangle, 3 * triangle + 3)],
    };
  });
  const positions = await serverPositions(page, frame);
  const at = (weights) =>
    [0, 1, 2].map((axis) => corners.reduce((sum, node, k) => sum + weights[k] * positions[3 * node + axis], 0));
  return {
    point,
    frame,
    target,
    held: at(point.weights),
    nodes: corners.map((_, k) => at([0, 1, 2].map((i) => +(i === k)))),
  };
}

test("a point of the flower is dragged, and the server's motion goes there", async () => {
  const { page, at } = await flower();
  assert.ok((await drawnPixels(page)) > 5000, "the flower is not drawn");
  await drag(page, at, [-45, -15]);
  const constraints = () => page.evaluate(() => window.limber.opened.session.scene.constraints.length);
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  await settle(page, 1);
  const { frame, held, target } = await newestPoint(page);
  assert.equal(frame, FRAME);
  // It is soft: the constraints of the sample pull as well.
  assert.ok(distance(held, target) < 0.04, `${held} is not near ${target}`);
  assert.match(await page.locator("[data-test=result]").textContent(), /final, converged/);

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
  assert.ok(distance((await newestPoint(page)).held, await target()) < 1e-3);
  await page.locator("canvas.view").focus();
  await page.keyboard.press("Delete");
  await until(page, () => window.limber.opened.session.scene.constraints.length === 20);
  assert.deepEqual(page.faults, []);
});

test("a point that is no node is dragged, listed, dragged on where it is shown, and undone", async () => {
  const { page } = await flower();
  const MESH = 1;
  // The middle of a triangle that is seen, near the top.
  const middle = await page.evaluate((node) => {
    const { surface } = window.limber.opened.workspace;
    const { basis } = surface;
    const { stage, session, frame } = window.limber.opened;
    const triangles = new Int32Array(session.geometry.surface.data.slice().buffer);
    const coordinates = session.motion.frame(frame);
    const top = basis.mean([node], coordinates);
    let best = null;
    for (let t = 0; t < triangles.length / 3; t++) {
      const at = basis.mean([...triangles.slice(3 * t, 3 * t + 3)], coordinates);
      const apart = Math.hypot(...at.map((value, axis) => value - top[axis]));
      if (best && apart >= best.apart) continue;
      const pixel = stage.project(stage.camera.position.clone().set(...at));
      if (surface.pickAt(pixel.x, pixel.y)?.point.triangle === t) best = { t, at, apart };
    }
    return best;
  }, NODE);
  await drag(page, await seen(page, middle.at), [-40, -12]);
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  await page.waitForTimeout(600);
  await page.getByLabel("Hold exactly").check();
  await until(page, () => window.limber.opened.session.scene.constraints.at(-1).enforcement.case === "exact");
  await settle(page);
  const { point, held, nodes, target } = await newestPoint(page);
  assert.deepEqual([point.triangle, point.surface], [middle.t, MESH]);
  assert.ok(
    point.weights.every((weight) => weight > 0.2 && weight < 0.5),
    `${point.weights} is not the middle`,
  );
  assert.ok(distance(held, target) < 1e-3, `${held} is not ${target}`);
  for (const node of nodes) assert.ok(distance(node, target) > 5e-3, "a node was held");
  assert.match(
    await page.getByRole("group", { name: "Constraints" }).textContent(),
    new RegExp(`point of triangle ${middle.t}, exact`),
  );

  // Where it is shown it is dragged on: no second constraint comes.
  await drag(page, await seen(page, held), [0, 30]);
  await until(page, (y) => window.limber.opened.session.scene.constraints.at(-1).target.value.y < y - 0.01, target[1]);
  await settle(page);
  const moved = await newestPoint(page);
  assert.ok(distance(moved.held, moved.target) < 1e-3);
  assert.deepEqual(moved.point, point);
  assert.equal(await page.evaluate(() => window.limber.opened.session.scene.constraints.length), 21);
  await page.locator("canvas.view").focus();
  for (let undone = 0; undone < 3; undone++) await page.keyboard.press("Control+z");
  await until(page, () => window.limber.opened.session.scene.constraints.length === 20);
  assert.deepEqual(page.faults, []);
});

test("a box is drawn around nodes, which are held as a group", async () => {
  const { page, at } = await flower();
  const expected = () =>
    page.evaluate(([x, y]) => {
      const { stage, workspace, session, frame } = window.limber.opened;
      const { basis } = workspace.surface;
      const triangles = new Int32Array(session.geometry.surface.data.slice().buffer);
      const box = stage.canvas.getBoundingClientRect();
      return [...new Set(triangles)]
        .filter((node) => {
          const pixel = stage.project(
            stage.camera.position.clone().set(...basis.mean([node], session.motion.frame(frame))),
          );
          return Math.abs(pixel.x + box.left - x) <= 40 && Math.abs(pixel.y + box.top - y) <= 40;
        })
        .sort((a, b) => a - b);
    }, at);
  const inBox = await expected();
  assert.ok(inBox.length > 5, `${inBox.length} nodes are in the box`);
  await page.keyboard.down("Alt");
  await page.keyboard.down("Shift");
  await page.mouse.move(at[0] - 40, at[1] - 40);
  await page.mouse.down();
  await page.mouse.move(at[0], at[1] + 5, { steps: 4 });
  assert.equal(await page.locator("[data-test=rectangle]").count(), 1);
  await page.mouse.move(at[0] + 40, at[1] + 40, { steps: 4 });
  await page.mouse.up();
  await page.keyboard.up("Shift");
  await page.keyboard.up("Alt");
  assert.equal(await page.locator("[data-test=rectangle]").count(), 0);
  assert.deepEqual(await page.evaluate(() => window.limber.opened.workspace.group), inBox);
  await page.getByRole("button", { name: "Hold here" }).click();
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  assert.deepEqual(await page.evaluate(() => window.limber.opened.session.scene.constraints.at(-1).nodes), inBox);
  // From the ground, without Alt; where it goes around nothing, nothing is selected.
  const box = await page.locator("canvas.view").boundingBox();
  await page.keyboard.down("Shift");
  await drag(page, [box.x + 8, box.y + box.height - 30], [12, 12]);
  await page.keyboard.up("Shift");
  assert.deepEqual(await page.evaluate(() => window.limber.opened.workspace.group), []);
  assert.deepEqual(page.faults, []);
});

test("a painted group is held by its mean, a pose becomes a keyframe, a material is fitted", async () => {
  const { page, at } = await flower();
  await page.keyboard.down("Shift");
  await drag(page, at, [25, 10]);
  await page.keyboard.up("Shift");
  const group = await page.evaluate(() => window.limber.opened.workspace.group);
  assert.ok(group.length > 5, `${group.length} nodes were painted`);
  await drag(page, at, [30, -10]);
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  await settle(page, 1);
  const constraint = await page.evaluate(() => {
    const { nodes, target } = window.limber.opened.session.scene.constraints.at(-1);
    return { nodes, target: [target.value.x, target.value.y, target.value.z] };
  });
  assert.deepEqual(constraint.nodes, group);
  const positions = await serverPositions(page, FRAME);
  const mean = [0, 1, 2].map((axis) => group.reduce((sum, node) => sum + positions[3 * node + axis], 0) / group.length);
  assert.ok(distance(mean, constraint.target) < 0.04, `${mean} is not near ${constraint.target}`);

  await keepPicture(page, "flower");

  await openPanels(page, "Keyframes");
  await page.getByLabel("Frame of the new keyframe").fill("300");
  await page.getByRole("button", { name: "Add", exact: true }).click();
  await until(page, () => window.limber.opened.session.scene.keyframes.length === 1);
  await settle(page, 2);
  const repeated = await serverPositions(page, 300);
  const farthest = Math.max(...repeated.map((value, i) => Math.abs(value - positions[i])));
  assert.ok(farthest < 0.05, `the pose of frame 300 is ${farthest} from the keyframe`);

  await openPanels(page, "Dynamics");
  await page.getByLabel("Lively to calm").fill("0.3");
  await until(page, () => window.limber.opened.session.scene.dynamics.dampingRatio < 0.2);
  await settle(page, 3);
  assert.ok((await page.getByLabel("Forces change in").inputValue()) < 0.3);
  await page.getByLabel("Optimise").selectOption({ label: "frequencies and damping too" });
  await until(page, () => window.limber.opened.session.result.materialIterations > 0);
  await settle(page, 4);
  assert.deepEqual(page.faults, []);
});

test("what was chosen and why is explained, and files are taken away", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "beam");
  await openPanels(page, "Why");
  await until(page, () => /modes \(r\)/.test(document.querySelector(".sidebar").textContent));
  await openPanels(page, "Files");
  await page.getByLabel("Format").selectOption({ label: "Blender: surface (.pc2, .obj)" });
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.getByRole("button", { name: "Download" }).click(),
  ]);
  assert.match(download.suggestedFilename(), /\.zip$/);
  const listed = spawnSync("python3", ["-m", "zipfile", "-l", await download.path()], { encoding: "utf8" }).stdout;
  assert.match(listed, /_surface\.obj/);
  assert.match(listed, /_surface\.pc2/);
  assert.deepEqual(page.faults, []);
});

test("a page that nobody sees takes no frames, and shows the newest when it is seen again", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "beam");
  await page.evaluate(() => window.limber.opened.session.sleep());
  await page.waitForTimeout(300);
  const bytes = await page.evaluate(() => window.limber.streamedBytes);
  await page.evaluate(async () => {
    const { session } = window.limber.opened;
    for (let i = 0; i < 10; i++) {
      const target = { case: "displacement", value: { x: 0, y: 0.01 * i, z: 0 } };
      const constraint = { frame: 90, nodes: [1336], target };
      const { revision } = await session.edit([{ edit: { case: "add", value: { constraint } } }]);
      await session.connection.call("wait", { session: session.reference, revision });
    }
  });
  assert.equal(await page.evaluate(() => window.limber.streamedBytes), bytes);
  await page.evaluate(() => window.limber.opened.session.wake());
  await settle(page, 10);
  assert.deepEqual(page.faults, []);
});

test("a page that misses messages of the stream catches up by itself", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "beam");
  await page.evaluate(async () => {
    const { session } = window.limber.opened;
    session.takeFrames = async () => undefined; // Nothing that is streamed arrives from here on.
    const target = { case: "displacement", value: { x: 0, y: 0.1, z: 0 } };
    await session.edit([{ edit: { case: "add", value: { constraint: { frame: 90, nodes: [1336], target } } } }]);
  });
  await settle(page, 1);
  assert.deepEqual(page.faults, []);
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
  const isPlaying = () => page.evaluate(() => window.limber.opened.timeline.isPlaying);
  assert.equal(await isPlaying(), false);

  // Controls keep their own keys.
  const box = page.getByLabel("Show trajectories");
  await box.focus();
  await page.keyboard.press("Space");
  assert.equal(await box.isChecked(), false);
  assert.equal(await isPlaying(), false);

  // Without a pointer a node is selected by its number and held where it is.
  await page.getByLabel("Node by number").fill("957");
  await page.keyboard.press("Enter");
  await page.getByRole("button", { name: "Hold here" }).press("Enter");
  await until(page, () => window.limber.opened.session.scene.constraints.length === 21);
  assert.deepEqual(await page.evaluate(() => window.limber.opened.session.scene.constraints.at(-1).nodes), [957]);
});

test("the GPU's surface is the server's", async () => {
  const { page } = await flower();
  const positions = await serverPositions(page, FRAME);
  const worst = await page.evaluate((positions) => {
    const { workspace, stage } = window.limber.opened;
    const { deformer } = workspace.surface;
    if (!deformer.isOnGpu) return Number.POSITIVE_INFINITY;
    const { side } = deformer;
    const [target] = deformer.targets;
    const texels = new Float32Array(4 * side * target.height);
    stage.renderer.readRenderTargetPixels(target, 0, 0, side, target.height, texels);
    let worst = 0;
    workspace.surface.boundary.forEach((node, i) => {
      for (let axis = 0; axis < 3; axis++)
        worst = Math.max(worst, Math.abs(texels[4 * i + axis] - positions[3 * node + axis]));
    });
    return worst;
  }, positions);
  const length = await page.evaluate(() => window.limber.opened.stage.extent);
  assert.ok(worst < 5e-4 * length, `off by ${worst}`);
});

test("a GPU that draws no float textures shows the body all the same", async () => {
  const page = await visit(browser, server.url, {}, () => {
    const { getExtension } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.getExtension = function (name) {
      return name === "EXT_color_buffer_float" ? null : getExtension.call(this, name);
    };
  });
  await openSample(page, "flower");
  assert.equal(await page.evaluate(() => window.limber.opened.workspace.surface.deformer.isOnGpu), false);
  assert.ok((await drawnPixels(page)) > 5000, "the flower is not drawn");
});

test("nothing serious for who uses no mouse or sees little", async () => {
  const page = await visit(browser, server.url);
  assert.deepEqual(await accessibilityFaults(page), []);
  await keepPicture(page, "home");
  await openSample(page, "beam");
  await openPanels(page);
  await page.waitForTimeout(500);
  assert.deepEqual(await accessibilityFaults(page), []);
});

test("targets out of reach and compared starts are told, in the width of the panel", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "beam");
  const long = await page.evaluate(() => window.limber.opened.session.name.session);
  await page.evaluate(() =>
    window.limber.opened.openChanged((scene) => {
      scene.frames = 40;
      scene.constraints = [];
    }),
  );
  await until(page, (long) => window.limber.opened.session.name.session !== long, long);
  await settle(page);
  await openPanels(page);
  const [near, far] = await page.evaluate(async () => {
    const { session, workspace } = window.limber.opened;
    const nodes = [workspace.surface.basis.nodes - 1];
    const edits = [0.5, 30].map((lengths, i) => {
      const target = { case: "displacement", value: { y: lengths * workspace.extent } };
      const enforcement = { case: "weight", value: i ? 1e-3 : 100 };
      return { edit: { case: "add", value: { constraint: { frame: 12 + 12 * i, nodes, target, enforcement } } } };
    });
    return (await session.edit(edits)).constraintIds.map(Number);
  });
  const told = page.locator("[data-test=result]");
  await until(page, () => window.limber.opened.session.result.starts !== undefined);
  await settle(page, 1);
  assert.match(await told.textContent(), new RegExp(`out of reach: constraint ${far} \\([0-9.]+ (m|units) left\\)`));
  assert.doesNotMatch(await told.textContent(), new RegExp(`constraint ${near} \\(`));
  assert.match(await told.textContent(), /\d starts compared: /);
  assert.match(await page.locator(".notices").textContent(), /These targets are out of reach: constraint/);
  assert.deepEqual(await wideBoxes(page), []);
  await page.evaluate(
    (id) => window.limber.opened.session.edit([{ edit: { case: "remove", value: { id: BigInt(id) } } }]),
    far,
  );
  await settle(page, 2);
  assert.doesNotMatch(await told.textContent(), /out of reach/);
  assert.doesNotMatch(await page.locator(".notices").textContent(), /out of reach/);
  assert.deepEqual(page.faults, []);
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
});

/** A box with a roof, around the bar of the sample; longer than it, so that corners lie outside its tets. */
function skin([low, high]) {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) =>
    [0, 1, 2].map((axis) => ((i >> axis) & 1 ? high[axis] : low[axis])),
  );
  const roof = [(low[0] + high[0]) / 2, high[1] * 1.1, (low[2] + high[2]) / 2];
  const faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "1 5 7 3", "2 4 8 6", "3 7 9", "7 8 9", "8 4 9", "4 3 9"];
  const lines = [...corners, roof].map((at) => `v ${at.join(" ")}`);
  return ["mtllib paint.mtl", ...lines, "usemtl red", ...faces.map((face) => `f ${face}`), ""].join("\n");
}

test("a body is drawn as the surface it carries, dragged by it, and opened anew with it", async () => {
  const page = await visit(browser, server.url);
  const bar = { mesh: { sample: "beam" }, frames: 20, surface: { path: "skin.obj" } };
  const box = [
    [-0.52, -0.05, -0.1],
    [0.52, 0.05, 0.1],
  ];
  await drop(page, [
    { name: "bar.json", text: JSON.stringify(bar) },
    { name: "skin.obj", text: skin(box) },
    { name: "paint.mtl", text: "newmtl red\nKd 1 0 0\n" },
  ]);
  await settle(page);
  await page.evaluate(() => window.limber.opened.goTo(10));
  const roof = () =>
    page.evaluate(() => {
      const { surface } = window.limber.opened.workspace;
      return [...surface.positions(surface.basis).slice(24, 27)];
    });
  assert.ok((await drawnPixels(page)) > 2000, "the surface is not drawn");
  const before = await roof();
  const [x, y] = await seen(page, before);
  await drag(page, [x, y + 3], [0, -25]);
  await settle(page, 1);
  assert.ok(distance(await roof(), before) > 0.02, "the surface did not follow");
  // As drawn, as the page reckons, and as the server sends it.
  const { gpu, sent } = await page.evaluate(async () => {
    const { session, workspace, stage, frame } = window.limber.opened;
    const SURFACE = 4;
    const wanted = { session: session.reference, firstFrame: frame, frameCount: 1, encoding: SURFACE };
    const { frames } = await session.connection.call("getFrames", wanted);
    const { deformer } = workspace.surface;
    const texels = new Float32Array(4 * deformer.side * deformer.rows);
    stage.renderer.readRenderTargetPixels(deformer.targets[0], 0, 0, deformer.side, deformer.rows, texels);
    const gpu = [...texels].filter((_, i) => i % 4 < 3 && i < 36);
    return { gpu, sent: [...new Float32Array(frames.data.data.slice().buffer)] };
  });
  assert.equal(sent.length, 27);
  // What was dragged is a point of that surface, and the server shows it where it is to be.
  const CARRIED = 2;
  const { point, target, corners } = await page.evaluate(() => {
    const { scene, geometry } = window.limber.opened.session;
    const { point, target } = scene.constraints.at(-1);
    const triangles = new Int32Array(geometry.carriedSurface.triangles.data.slice().buffer);
    const corners = [...triangles.slice(3 * point.triangle, 3 * point.triangle + 3)];
    const { weights, surface } = point;
    return { point: { weights, surface }, target: [target.value.x, target.value.y, target.value.z], corners };
  });
  assert.equal(point.surface, CARRIED);
  const held = [0, 1, 2].map((axis) => corners.reduce((sum, v, k) => sum + point.weights[k] * sent[3 * v + axis], 0));
  assert.ok(distance(held, target) < 5e-3, `${held} is not near ${target}`);
  assert.ok(Math.max(...sent.map((value, i) => Math.abs(value - gpu[i]))) < 2e-3, `${gpu} is not ${sent}`);
  await page.selectOption("[data-test=drawn]", "mesh");
  assert.ok(await page.evaluate(() => window.limber.opened.workspace.surface.deformer.count > 100));
  await openPanels(page, "Files");
  assert.ok(await page.locator("option", { hasText: "the surface it carries (.obj" }).count());

  // Another page has not the files that it was opened with: the server's export has them.
  const name = await page.evaluate(() => window.limber.opened.session.name.session);
  await page.context().close();
  const second = await visit(browser, server.url);
  await second.click(`[data-session="${name}"]`);
  await settle(second);
  await second.evaluate(() => window.limber.opened.openChanged((scene) => scene.fixedNodes.push(0)));
  await until(second, (name) => window.limber.opened.session.name.session !== name, name);
  await settle(second);
  const again = await second.evaluate(() => {
    const { scene, geometry } = window.limber.opened.session;
    return [scene.fixedNodes.length, scene.constraints.length, geometry.carriedSurface?.triangles.shape.map(Number)];
  });
  assert.deepEqual(again, [1, 1, [14, 3]]);
  assert.deepEqual(page.faults.concat(second.faults), []);
});

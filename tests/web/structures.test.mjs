import assert from "node:assert/strict";
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

const extreme = (page, sign) =>
  page.evaluate((sign) => {
    const { positions } = window.limber.opened.workspace;
    let best = 0;
    positions.forEach((position, i) => {
      if (sign * position.z > sign * positions[best].z) best = i;
    });
    return { index: best, at: positions[best].toArray() };
  }, sign);
const lastFrame = (page) => page.evaluate(() => window.limber.opened.session.motion.frames - 1);

/** The slider of the mean opening angle, put to a value as a hand would. */
async function openTo(page, degrees) {
  await page.evaluate((degrees) => {
    const slider = document.querySelector("[data-test=opening]");
    slider.value = String(degrees);
    slider.dispatchEvent(new Event("input"));
    slider.dispatchEvent(new Event("change"));
  }, degrees);
}

test("a linkage opens by its slider, is pinned, and a joint is pulled where it is dragged", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "hyperboloid");
  await openTo(page, 55);
  await settle(page, 1);
  const angle = await page.evaluate(() => window.limber.opened.session.result.linkage.meanAngleDegrees);
  assert.ok(Math.abs(angle - 55) < 0.1, `opened to ${angle}`);
  await page.click("[data-test=pin-feet]");
  await until(page, () => window.limber.opened.session.scene.linkage.conditions.pins.length > 3);
  await settle(page, 2);
  assert.ok((await drawnPixels(page)) > 2000, "the linkage is not drawn");
  const top = await extreme(page, 1);
  await drag(page, await seen(page, top.at), [30, 25]);
  await until(page, () => window.limber.opened.session.scene.linkage.conditions.targets.length === 1);
  await settle(page, 4);
  const target = await page.evaluate(() => {
    const { x, y, z } = window.limber.opened.session.scene.linkage.conditions.targets[0].position;
    return [x, y, z];
  });
  // Nodes of the swept surface as the server encodes them: those of the joint's rods are around it.
  const nearest = async (point) => {
    const surface = await serverPositions(page, await lastFrame(page));
    let least = Number.POSITIVE_INFINITY;
    for (let i = 0; i < surface.length; i += 3) least = Math.min(least, distance(surface.slice(i, i + 3), point));
    return least;
  };
  const dragged = distance(target, top.at);
  const moved = await page.evaluate((joint) => window.limber.opened.workspace.positions[joint].toArray(), top.index);
  assert.ok(
    distance(moved, target) < 0.7 * dragged,
    `the joint is ${distance(moved, target)} from its target of ${dragged}`,
  );
  assert.ok((await nearest(moved)) < 0.03, "the page shows the joint where the server has no rod");
  await keepPicture(page, "linkage");
  await page.keyboard.press("Control+z");
  await until(page, () => window.limber.opened.session.scene.linkage.conditions.targets.length === 0);
  await settle(page);
  for (const by of ["twist", "angle", "stress"]) {
    await page.getByLabel("Colour by").selectOption(by);
    await page.waitForSelector(".legend:not([hidden])");
  }
  await until(
    page,
    () =>
      /final shape/.test(document.querySelector(".legend").textContent) &&
      /Pa/.test(document.querySelector(".legend").textContent),
  );
  assert.deepEqual(await accessibilityFaults(page), []);
  assert.deepEqual(page.faults, []);
});

test("a linkage that an edit has cut into more edges is drawn with them", async () => {
  const page = await visit(browser, server.url);
  await page.evaluate(async () => {
    const { scene } = await window.limber.connection.call("getSample", { name: "hyperboloid" });
    scene.linkage.edgesPerSegment = undefined;
    scene.linkage.conditions.meanAngleDegrees = 15;
    scene.linkage.tolerance = 1.5e-4;
    await window.limber.openScene(scene);
  });
  await settle(page);
  const drawn = () =>
    page.evaluate(() => {
      const { shapes, positions } = window.limber.opened.workspace;
      const { geometry, motion } = window.limber.opened.session;
      const isOfFrames = motion.basisHash === geometry.basisHash && motion.basisHash === shapes.hash;
      return { stations: shapes.stations, positions: positions.map((at) => at.toArray()), isOfFrames };
    });
  const before = await drawn();
  await page.getByLabel("Colour by").selectOption("stress");
  await openTo(page, 85);
  await until(page, (stations) => window.limber.opened.workspace.shapes.stations > stations, before.stations);
  await settle(page, 1);
  await until(page, () => /final shape/.test(document.querySelector(".legend").textContent));
  const after = await drawn();
  assert.ok(before.isOfFrames && after.isOfFrames);
  const moved = after.positions.map((at, i) => distance(at, before.positions[i]));
  assert.ok(Math.max(...moved) > 0.1, "the shape that was cut anew is not drawn");
  assert.ok((await drawnPixels(page)) > 2000);
  assert.deepEqual(page.faults, []);
});

test("a path opens at its end though its frames come before the scene and the first picture", async () => {
  const page = await visit(browser, server.url);
  await page.evaluate(() => {
    const { connection } = window.limber;
    const draw = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (callback) => window.setTimeout(() => draw(callback), 3000);
    const call = connection.call.bind(connection);
    connection.call = async (name, ...rest) => {
      const reply = await call(name, ...rest);
      if (name === "getSession") await new Promise((resolve) => window.setTimeout(resolve, 2000));
      return reply;
    };
  });
  await openSample(page, "gridshell");
  const [frame, frames] = await page.evaluate(() => {
    const { frame, session } = window.limber.opened;
    return [frame, session.motion.frames];
  });
  assert.ok(frames > 1);
  assert.equal(frame, frames - 1);
});

test("a node of a gridshell is brought where it is dragged", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "gridshell");
  assert.ok((await drawnPixels(page)) > 2000, "the gridshell is not drawn");
  await until(page, () => /%/.test(document.querySelector(".legend").textContent));
  await keepPicture(page, "beams");
  const node = await page.evaluate(() => window.limber.opened.session.scene.beams.structure.motions[0].node);
  const at = await page.evaluate((node) => window.limber.opened.workspace.positions[node].toArray(), node);
  await drag(page, await seen(page, at), [-25, 10], 8);
  await settle(page, 1);
  await until(page, () => window.limber.opened.dragged === undefined);
  const motion = await page.evaluate((node) => {
    const { structure } = window.limber.opened.session.scene.beams;
    const { x, y, z } = structure.motions.find((one) => one.node === node);
    const drawn = structure.nodes[node].position;
    return [drawn.x + x, drawn.y + y, drawn.z + z];
  }, node);
  assert.ok(distance(motion, at) > 0.05, "the node is where it was");
  const positions = await serverPositions(page, await lastFrame(page));
  const elements = await page.evaluate((node) => {
    const { shapes } = window.limber.opened.workspace;
    return [...shapes.elements].indexOf(node);
  }, node);
  const rows = positions.length / 3;
  const nodes = await page.evaluate(() => window.limber.opened.workspace.shapes.nodes);
  const row = rows === nodes ? node : elements;
  assert.ok(distance(positions.slice(3 * row, 3 * row + 3), motion) < 1e-4, "the server has the node elsewhere");
  const before = await revision(page);
  await page.keyboard.press("Control+z");
  await settle(page, before + 1);
  const back = await serverPositions(page, await lastFrame(page));
  assert.ok(distance(back.slice(3 * row, 3 * row + 3), at) < 1e-4, "undo did not bring the node back");
  assert.deepEqual(await accessibilityFaults(page), []);
  assert.deepEqual(page.faults, []);
});

/** A patch of surface as an .obj. */
function hill() {
  const [count, vertices, faces] = [17, [], []];
  for (let i = 0; i < count; i++) {
    for (let j = 0; j < count; j++) {
      const [x, y] = [-1 + (2 * i) / (count - 1), -0.7 + (1.4 * j) / (count - 1)];
      vertices.push(`v ${x} ${y} ${0.3 * (1 - x * x - y * y) * (1 + 0.4 * x)}`);
      const a = (i - 1) * count + j;
      if (i && j) faces.push(`f ${a} ${a + count} ${a + count + 1}`, `f ${a} ${a + count + 1} ${a + 1}`);
    }
  }
  return [...vertices, ...faces].join("\n");
}

test("a linkage is made for a dropped surface, designed, paused, and taken", async () => {
  const page = await visit(browser, server.url);
  await drop(page, [{ name: "hill.obj", text: hill() }]);
  await page.getByLabel("What to do with it").selectOption("linkage");
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByLabel("Joints along").fill("6");
  await page.getByLabel("Joints across").fill("5");
  await page.getByRole("button", { name: "Make the grid" }).click();
  await settle(page);
  await keepPicture(page, "design-before");
  const away = await page.evaluate(() => {
    const { workspace, stage } = window.limber.opened;
    const mesh = stage.content.children.find((child) => child.material?.opacity === 0.28);
    const vertices = mesh.geometry.attributes.position;
    const point = workspace.positions[0].clone();
    let sum = 0;
    for (const joint of workspace.positions) {
      let least = Infinity;
      for (let i = 0; i < vertices.count; i++) {
        point.fromBufferAttribute(vertices, i).applyQuaternion(mesh.quaternion).add(mesh.position);
        least = Math.min(least, point.distanceTo(joint));
      }
      sum += least;
    }
    return sum / workspace.positions.length;
  });
  assert.ok(away < 0.15, `the surface, 2 by 1.4, is drawn ${away} from the joints`);
  await openPanels(page, "Design");
  await page.getByRole("button", { name: "Start" }).click();
  const design = (name) => page.evaluate((name) => window.limber.opened.session.design?.[name], name);
  await until(page, () => {
    const design = window.limber.opened.session.design;
    return design?.iteration >= 2 && design.best.objective < design.start.objective;
  });
  const RUNNING = 2;
  if ((await design("state")) === RUNNING)
    await page
      .getByRole("button", { name: "Pause" })
      .click()
      .catch(() => undefined);
  await page.waitForTimeout(500);
  await keepPicture(page, "design");
  await page.getByRole("button", { name: "Take the best" }).click();
  await until(page, () => window.limber.opened.session.design?.takenRevision !== undefined);
  await settle(page, 1);
  const { start, best } = await page.evaluate(() => {
    const { start, best } = window.limber.opened.session.design;
    return { start: start.objective, best: best.objective };
  });
  assert.ok(best < start, `the design went from ${start} to ${best}`);
  const lengths = await page.evaluate(
    () => window.limber.opened.session.scene.linkage.conditions.segmentLengths.length,
  );
  assert.ok(lengths > 0);
  const { failure } = await page.evaluate(() => window.limber.opened.session.scene.linkage.erection);
  const plan = await page.locator("[data-test=erection]").textContent();
  if (failure) assert.equal(plan, `no working path from flat is known: ${failure}`);
  else assert.match(plan, /^opens from flat to [\d.]+°/);
  assert.deepEqual(await wideBoxes(page), []);
  assert.deepEqual(page.faults, []);
});

test("an arch that snaps says so", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "arch");
  const top = await extreme(page, 1);
  await page.getByLabel("Dragging a node").selectOption("load");
  await page.getByLabel("Force of a drag").fill("20000");
  await page.getByLabel("Force of a drag").blur();
  await drag(page, await seen(page, top.at), [0, 120], 3);
  await settle(page, 1);
  const snaps = await page.evaluate(() => window.limber.opened.session.result.beams.snaps.length);
  if (snaps) assert.match(await page.locator(".notices").textContent(), /snapped at/);
  assert.ok((await revision(page)) >= 1);
  assert.match(await page.locator("[data-test=result]").textContent(), /revision \d+: (final|no solution)/);
});

test("forces are drawn along the beams as the solution has them, and an overloaded structure says so", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "arch");
  const top = await extreme(page, 1);
  await page.getByLabel("Dragging a node").selectOption("load");
  await page.getByLabel("Force of a drag").fill("200");
  await page.getByLabel("Force of a drag").blur();
  await drag(page, await seen(page, top.at), [40, 60], 3);
  await settle(page, 1);
  for (const [kind, column] of [
    ["axial", 0],
    ["shear3", 3],
    ["moment3", 5],
    ["moment2", 4],
  ]) {
    await page.getByLabel("Diagram").selectOption(kind);
    await until(page, () => / N/.test(document.querySelector("[data-test=diagram]").textContent));
    const worst = await page.evaluate(async (column) => {
      const { workspace, session } = window.limber.opened;
      const { solution } = await session.connection.call("getBeamSolution", {
        session: session.reference,
        stations: 21,
      });
      const stations = new Float64Array(solution.stations.data.slice().buffer);
      const drawn = workspace.diagram.drawn.values.flatMap((of) => [...of]);
      return Math.max(
        drawn.length === stations.length / 8 ? 0 : Number.POSITIVE_INFINITY,
        ...drawn.map((value, i) => Math.abs(value - stations[8 * i + column])),
      );
    }, column);
    assert.equal(worst, 0, `${kind} is not what the solution has`);
    await keepPicture(page, `diagram-${kind}`);
  }
  await page.locator("canvas.view").focus();
  await page.keyboard.press("Escape");
  await page.getByLabel("Beam by number").fill("3");
  await page.getByRole("button", { name: "Select the beam" }).click();
  await until(page, () => /Axial force.* N/.test(document.querySelector("[data-test=forces]").textContent));
  assert.deepEqual(await accessibilityFaults(page), []);
  const last = await page.evaluate(async (node) => {
    const load = { node, force: { x: 0, y: 0, z: 5000 } };
    const edits = [{ edit: { case: "setBeamLoad", value: { load } } }];
    return Number((await window.limber.opened.session.edit(edits)).revision);
  }, top.index);
  await settle(page, last);
  assert.ok((await page.evaluate(() => window.limber.opened.session.result.beams.largestUtilisation)) > 1);
  assert.match(await page.locator("[data-test=result]").textContent(), /overloaded: .* times the yield stress/);
  await until(page, () => /overloaded/.test(document.querySelector(".notices").textContent));
  assert.deepEqual(page.faults, []);
});

test("what is said of the strength follows the result, and goes when it is not so any more", async () => {
  const page = await visit(browser, server.url);
  await openSample(page, "arch");
  const top = await extreme(page, 1);
  const load = async (force) => {
    const made = await page.evaluate(
      async ([node, z]) => {
        const edits = [{ edit: { case: "setBeamLoad", value: { load: { node, force: { x: 0, y: 0, z } } } } }];
        return Number((await window.limber.opened.session.edit(edits)).revision);
      },
      [top.index, force],
    );
    await settle(page, made);
  };
  const said = () => page.locator(".notice[data-key=strength]").allTextContents();
  const times = () => page.evaluate(() => window.limber.opened.session.result.beams.largestUtilisation);
  assert.deepEqual(await said(), []);
  const seen = [];
  for (const force of [3000, 6000]) {
    await load(force);
    const texts = await said();
    assert.equal(texts.length, 1, texts.join());
    const number = Number(/largest stress is ([\d.]+) times/.exec(texts[0])[1]);
    assert.ok(Math.abs(number / (await times()) - 1) < 0.01, `${texts[0]} beside ${await times()}`);
    seen.push(number);
  }
  assert.ok(seen[1] > 1.2 * seen[0], `${seen}`);
  const loaded = await revision(page);
  await page.keyboard.press("Control+z");
  await settle(page, loaded + 1);
  assert.ok((await times()) < 1.1 * seen[0] && (await said())[0].includes(String(seen[0])));
  await load(1);
  assert.ok((await times()) < 1);
  assert.deepEqual(await said(), []);
  assert.match(
    await page.locator("[data-test=messages]").textContent(),
    /problem: The structure is overloaded.*\(until /,
  );
  assert.deepEqual(page.faults, []);
});

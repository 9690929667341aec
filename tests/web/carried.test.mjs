// A surface that a body carries is drawn in place of the boundary of its tets.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { drawnPixels, launch, Server, settle, until, visit } from "./support.mjs";

/** An octahedron from end to end of the sample beam, whose box this is scaled to. */
const OCTAHEDRON = {
  vertices: [
    [0, 0.5, 0.5],
    [1, 0.5, 0.5],
    [0.5, 0, 0.5],
    [0.5, 1, 0.5],
    [0.5, 0.5, 0],
    [0.5, 0.5, 1],
  ],
  faces: "f 1 5 3\nf 1 4 5\nf 1 6 4\nf 1 3 6\nf 2 3 5\nf 2 5 4\nf 2 4 6\nf 2 6 3\n",
};
const FRAME = 75;

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

test("a carried surface is drawn where the server has it", async () => {
  const opener = await visit(browser, server.url);
  await opener.click("[data-sample=beam]");
  await settle(opener);
  await opener.evaluate(async ({ vertices, faces }) => {
    const { session } = window.limber.opened;
    const { rest } = window.limber.opened.workspace.surface.basis;
    const axis = (k) => [...rest].filter((_, i) => i % 3 === k);
    const [low, high] = [Math.min, Math.max].map((of) => [0, 1, 2].map((k) => of(...axis(k))));
    const lines = vertices.map((at) => `v ${at.map((share, k) => low[k] + share * (high[k] - low[k])).join(" ")}\n`);
    const content = new TextEncoder().encode(lines.join("") + faces);
    const { scene } = await session.connection.call("getSample", { name: "beam" });
    const surface = { source: { case: "file", value: { name: "octahedron.obj", content } } };
    // Without the name of its type it is what a message is made of, new parts included.
    const { $typeName, ...parts } = scene;
    await session.connection.call("openSession", { scene: { ...parts, surface }, session: "carried" }, 120_000);
  }, OCTAHEDRON);
  await opener.context().close();

  const page = await visit(browser, `${server.url}#carried`);
  await settle(page);
  await page.evaluate((frame) => window.limber.opened.goTo(frame), FRAME);
  await until(page, () => window.limber.opened.workspace.surface.carried !== null);
  assert.ok((await drawnPixels(page)) > 500, "it is not drawn");
  const apart = await page.evaluate(async (frame) => {
    const { session, stage, workspace } = window.limber.opened;
    const { deformer, mesh, basis } = workspace.surface;
    const SURFACE = 4;
    const wanted = { session: session.reference, firstFrame: frame, frameCount: 1, encoding: SURFACE };
    const { frames } = await session.connection.call("getFrames", wanted);
    const expected = new Float32Array(frames.data.data.slice().buffer);
    const vertices = expected.length / 3;
    const { side } = deformer;
    const rows = Math.ceil(vertices / side);
    const drawn = new Float32Array(4 * side * rows);
    stage.renderer.readRenderTargetPixels(deformer.targets[0], 0, 0, side, rows, drawn);
    const moved = (i) => Math.abs(drawn[4 * Math.floor(i / 3) + (i % 3)] - expected[i]);
    const atRest = deformer.basis.rest;
    return {
      vertices,
      triangles: mesh.geometry.index.count / 3,
      nodes: basis.nodes,
      farthest: Math.max(...expected.map((_, i) => moved(i))),
      motion: Math.max(...expected.map((value, i) => Math.abs(value - atRest[i]))),
    };
  }, FRAME);
  assert.deepEqual([apart.vertices, apart.triangles], [6, 8]);
  assert.ok(apart.nodes > 100, "nodes to pick are those of the tets");
  assert.ok(apart.motion > 0.01, "the sample does not move");
  assert.ok(apart.farthest < 2e-3, `drawn ${apart.farthest} from where the server has it`);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

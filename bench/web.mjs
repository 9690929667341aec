// The page in headless Chromium against a limberd of its own, as one JSON object. It measures from address to picture,
// from the mouse to the new motion and to its picture, bytes of an edit, several pages on one session, and a hidden
// page.
//
//     node bench/web.mjs [--sample flower] [--frame 150] [--node 957] [--moves 60] [--repeats 5] [--pages 8] [--sleep 60]
//
// Needs the same as scripts/test-web: limberd ($LIMBER_BIN or build/release/bin), clients/web/dist, Chromium.
import { readFileSync } from "node:fs";
import { cpus, loadavg } from "node:os";
import { parseArgs } from "node:util";
import { launch, openSample, Server, seen, settle, visit } from "../tests/web/support.mjs";

const { values: given } = parseArgs({
  options: {
    sample: { type: "string", default: "flower" },
    frame: { type: "string", default: "150" },
    node: { type: "string", default: "957" },
    moves: { type: "string", default: "60" },
    repeats: { type: "string", default: "5" },
    pages: { type: "string", default: "8" },
    sleep: { type: "string", default: "60" },
  },
});
const [FRAME, NODE, MOVES, REPEATS, PAGES, SLEEP_S] = ["frame", "node", "moves", "repeats", "pages", "sleep"].map(
  (name) => Number(given[name]),
);
/** Between two movements of the mouse: longer than most edits take, so that each is an edit. */
const PAUSE_MS = 80;

function quantile(times, share) {
  const sorted = [...times].sort((a, b) => a - b);
  const at = sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
  return at === undefined ? null : Number(at.toFixed(1));
}

/** Before the page's own scripts: when its first picture with a motion is drawn. [ms since the address was entered] */
function watchFirstPicture() {
  const look = () => {
    const opened = window.limber?.opened;
    if (opened?.session.motion.frames > 0 && opened.stage.frames > 0) {
      // The picture that shows it is the next one; reading it waits for the drawing.
      const drawn = opened.stage.frames;
      const wait = () => {
        if (opened.stage.frames <= drawn) {
          opened.stage.invalidate();
          requestAnimationFrame(wait);
          return;
        }
        const gl = opened.stage.renderer.getContext();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        window.firstPicture = performance.now();
      };
      wait();
    } else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}

/** Notes when the mouse moved for each revision that this page makes, and when motions come and are drawn. Absolute times. */
function instrument(page) {
  return page.evaluate(() => {
    const { session, stage } = window.limber.opened;
    const noted = { moved: [], sent: [], arrived: [], drawn: [] };
    window.noted = noted;
    let moved = 0;
    const now = () => performance.timeOrigin + performance.now();
    const record = (event) => {
      moved = performance.timeOrigin + event.timeStamp;
    };
    stage.canvas.addEventListener("pointermove", record, { capture: true });
    const edit = session.edit.bind(session);
    session.edit = async (edits, ...rest) => {
      const [at, sent] = [moved, now()];
      const response = await edit(edits, ...rest);
      noted.moved.push([Number(response.revision), at]);
      noted.sent.push([Number(response.revision), sent]);
      return response;
    };
    let isWaiting = false;
    let newest = 0;
    session.on("motion", () => {
      newest = Math.max(newest, Number(session.result?.revision ?? 0));
      noted.arrived.push([newest, now()]);
      if (isWaiting) return;
      isWaiting = true;
      // The page has asked to draw: this comes after that, in the same turn.
      requestAnimationFrame(() => {
        isWaiting = false;
        const shown = newest;
        const gl = stage.renderer.getContext();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        noted.drawn.push([shown, now()]);
      });
    });
  });
}

const take = (page) => page.evaluate(() => window.noted);

/** From each of these to the first later event whose revision contains it. [ms] */
function waits(begun, events) {
  return begun.flatMap(([revision, at]) => {
    const found = events.find(([seen, when]) => seen >= revision && when >= at);
    return found ? [found[1] - at] : [];
  });
}

/** Bytes of messages over both WebSockets of a page. */
function countBytes(page) {
  const counts = { requests: 0, replies: 0, stream: 0 };
  page.on("websocket", (socket) => {
    const isStream = socket.url().includes("/v1/stream");
    socket.on("framesent", ({ payload }) => {
      if (!isStream) counts.requests += payload.length;
    });
    socket.on("framereceived", ({ payload }) => {
      counts[isStream ? "stream" : "replies"] += payload.length;
    });
  });
  return counts;
}

/** Position of the dragged point. */
async function place(page) {
  await page.evaluate((frame) => window.limber.opened.goTo(frame), FRAME);
  const at = await page.evaluate(
    ([node, frame]) => {
      const { workspace, session } = window.limber.opened;
      return workspace.surface.basis.mean([node], session.motion.frame(frame));
    },
    [NODE, FRAME],
  );
  return seen(page, at);
}

/** Drags the point in circles, one movement at a time. */
async function dragAround(page, moves, pause = PAUSE_MS) {
  const [x, y] = await place(page);
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= moves; i++) {
    const angle = (2 * Math.PI * i) / 40;
    await page.mouse.move(x - 25 * Math.sin(angle), y - 12 * (1 - Math.cos(angle)));
    await page.waitForTimeout(pause);
  }
  await page.mouse.up();
  await settle(page, 1);
}

async function firstPictures(browser, server, session) {
  const times = [];
  for (let i = 0; i < REPEATS; i++) {
    const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
    const page = await context.newPage();
    await page.addInitScript(watchFirstPicture);
    await page.goto(`${server.url}#${session}`);
    await page.waitForFunction(() => window.firstPicture, undefined, { polling: 20, timeout: 60_000 });
    times.push(await page.evaluate(() => window.firstPicture));
    await context.close();
  }
  return times;
}

/** A page with its counts from the first message on. */
async function countedPage(browser, url) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
  const page = await context.newPage();
  const counts = countBytes(page);
  await page.goto(url);
  await page.waitForSelector('body[data-connection="open"]');
  return { page, counts };
}

/** As of a tab that is not seen: headless pages always are. */
const hide = (page, isHidden) =>
  page.evaluate((isHidden) => {
    Object.defineProperty(document, "hidden", { get: () => isHidden, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  }, isHidden);

const began = performance.now();
const note = (what) => console.error(`${((performance.now() - began) / 1000).toFixed(0)} s: ${what}`);

const server = new Server();
await server.start();
const browser = await launch();
const result = {
  suite: "web",
  sample: given.sample,
  date: new Date().toISOString().slice(0, 10),
  processor: cpus()[0]?.model ?? "",
  processors: cpus().length,
  load_before: Number(loadavg()[0].toFixed(1)),
  browser: browser.version(),
};
try {
  const { page, counts } = await countedPage(browser, server.url);
  await openSample(page, given.sample);
  const session = await page.evaluate(() => window.limber.opened.session.name.session);
  result.renderer = await page.evaluate(() => {
    const gl = window.limber.opened.stage.renderer.getContext();
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    return String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  });

  note("first pictures");
  const first = await firstPictures(browser, server, session);
  Object.assign(result, { first_picture_ms: quantile(first, 0.5), first_picture_most_ms: quantile(first, 1) });

  note("drags");
  await dragAround(page, 10); // for objects that are made once
  await instrument(page);
  const before = { ...counts };
  await dragAround(page, MOVES);
  const noted = await take(page);
  const edits = noted.moved.length;
  const [inMemory, drawn, sent] = [
    waits(noted.moved, noted.arrived),
    waits(noted.moved, noted.drawn),
    waits(noted.sent, noted.arrived),
  ];
  Object.assign(result, {
    edits,
    move_to_frame_p50_ms: quantile(inMemory, 0.5),
    move_to_frame_p99_ms: quantile(inMemory, 0.99),
    move_to_drawn_p50_ms: quantile(drawn, 0.5),
    move_to_drawn_p99_ms: quantile(drawn, 0.99),
    sent_to_frame_p50_ms: quantile(sent, 0.5),
    sent_to_frame_p99_ms: quantile(sent, 0.99),
  });
  const perEdit = (name) => Math.round((counts[name] - before[name]) / edits);
  const parts = { stream: perEdit("stream"), requests: perEdit("requests"), replies: perEdit("replies") };
  Object.assign(result, {
    bytes_per_edit: parts.stream + parts.requests + parts.replies,
    stream_bytes_per_edit: parts.stream,
    request_bytes_per_edit: parts.requests,
    reply_bytes_per_edit: parts.replies,
  });

  note("several pages");
  const others = [];
  for (let i = 1; i < PAGES; i++) {
    const other = await visit(browser, `${server.url}#${session}`);
    await settle(other, 1);
    await instrument(other);
    others.push(other);
  }
  await page.evaluate(() => {
    for (const list of Object.values(window.noted)) list.length = 0;
  });
  await dragAround(page, Math.ceil(MOVES / 3), 3 * PAUSE_MS);
  const own = await take(page);
  const all = [own, ...(await Promise.all(others.map(take)))];
  const shared = all.flatMap(({ arrived }) => waits(own.sent, arrived));
  Object.assign(result, {
    pages: PAGES,
    pages_edits: own.sent.length,
    pages_sent_to_frame_p50_ms: quantile(shared, 0.5),
    pages_sent_to_frame_p99_ms: quantile(shared, 0.99),
  });
  for (const other of others) await other.context().close();

  note("a page asleep");
  const asleep = await countedPage(browser, `${server.url}#${session}`);
  await settle(asleep.page, 1);
  await hide(asleep.page, true);
  await page.waitForTimeout(500);
  const slept = { ...asleep.counts };
  const revisions = () => page.evaluate(() => Number(window.limber.opened.session.revision));
  const earlier = await revisions();
  const cpu = () => {
    const fields = readFileSync(`/proc/${server.process.pid}/stat`, "utf8").split(") ")[1].split(" ");
    return (Number(fields[11]) + Number(fields[12])) * 10;
  };
  await dragAround(page, Math.ceil(MOVES / 5));
  const edited = performance.now();
  const quiet = cpu();
  await page.waitForTimeout(Math.max(0, 1000 * SLEEP_S));
  const silent = { s: (performance.now() - edited) / 1000, cpu: cpu() - quiet };
  const newest = await revisions();
  const total = (counts) => counts.stream + counts.requests + counts.replies;
  const sleeping = total(asleep.counts) - total(slept);
  const woke = performance.now();
  await hide(asleep.page, false);
  await asleep.page.waitForFunction(
    (revision) => {
      const { session } = window.limber.opened;
      return Number(session.revision) >= revision && session.motion.sequence === session.result?.sequence;
    },
    newest,
    { polling: 5, timeout: 60_000 },
  );
  Object.assign(result, {
    sleep_s: SLEEP_S,
    sleep_edits: newest - earlier,
    sleep_bytes: sleeping,
    sleep_server_cpu_ms_per_s: Number((silent.cpu / silent.s).toFixed(2)),
    wake_to_newest_ms: Number((performance.now() - woke).toFixed(1)),
    wake_bytes: total(asleep.counts) - total(slept) - sleeping,
    load_after: Number(loadavg()[0].toFixed(1)),
  });
} finally {
  await browser.close();
  await server.close();
}
console.log(JSON.stringify(result, null, 2));

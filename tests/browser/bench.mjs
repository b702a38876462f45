// node bench.mjs: how fast the operator's page draws, how soon, and in how much memory. It prints the table of docs/performance.md. The target is
// hueline_console_bench. The drive is the made street of mock_street.mjs; what clients receive is measured with the real hueline-console.
//   HUELINE_BENCH_PARTS  frames, pixel, memory, bytes (all)
//   HUELINE_BENCH_SPEED  how many times faster than the clock the eight hours of `memory` run (60)
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { launch, login, newPage } from "./browser.mjs";
import { Mock } from "./mock_server.mjs";

const { HUELINE_SOURCE: source, HUELINE_PAGE: folder, HUELINE_BIN: bin } = process.env;
const parts = (process.env.HUELINE_BENCH_PARTS ?? "frames pixel memory bytes").split(/[ ,]+/);
const speed = Number(process.env.HUELINE_BENCH_SPEED ?? 60);
const share = (values, q) => values.toSorted((a, b) => a - b)[Math.min(values.length - 1, Math.floor(q * values.length))];
const row = (what, figure) => console.log(`| ${what} | ${figure} |`);
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

/// A page on the made street, with a probe: the times of frames, of messages that bring points, and of draws.
async function onTheStreet(browser) {
  const mock = new Mock(folder, path.join(source, "storage/proto"), fs.readFileSync(path.join(source, "docs/images/shot_lidar_camera.jpg")));
  const url = await mock.start();
  const page = await newPage(browser);
  await page.addInitScript(() => {
    const probe = (globalThis.probe = { frames: [], waits: [], arrived: undefined, drawn: 0 });
    const Real = globalThis.WebSocket;
    globalThis.WebSocket = class extends Real {
      constructor(...words) {
        super(...words);
        this.addEventListener("message", ({ data }) => {
          if ((data.byteLength ?? data.size ?? 0) > 20000) probe.arrived ??= performance.now();
        });
      }
    };
    const draw = WebGL2RenderingContext.prototype.drawArrays;
    WebGL2RenderingContext.prototype.drawArrays = function (mode, first, count) {
      if (mode === this.POINTS) probe.drawn += count;
      return draw.call(this, mode, first, count);
    };
    let before = 0, whole = 0;
    const frame = (time) => {
      // The page's own frame is asked for before this one, so what it drew is in `drawn`.
      if (probe.drawn > 0) {
        if (before > 0) probe.frames.push({ ms: time - before, points: probe.drawn });
        if (probe.arrived !== undefined) probe.waits.push(performance.now() - probe.arrived);
        probe.arrived = undefined;
        before = time;
      } else {
        before = 0;
      }
      probe.drawn = 0;
      whole = requestAnimationFrame(frame);
    };
    whole = requestAnimationFrame(frame);
  });
  await login(page, url);
  mock.begin();
  return { mock, page, url };
}

const resident = (page, millions) =>
  page.waitForFunction(
    (most) => {
      const match = /([\d.]+) M points/.exec(document.querySelector(".legend")?.textContent ?? "");
      return match && Number(match[1]) >= most;
    },
    millions * 0.98,
    { timeout: 600_000 },
  );

async function benchFrames(browser) {
  const { mock, page, url } = await onTheStreet(browser);
  mock.pointsPerMessage = 100_000;
  mock.speed = 1;
  await page.goto(`${url}/#cloud`);
  for (const millions of [1, 5, 10]) {
    await resident(page, millions);
    mock.pointsPerMessage = 4000; // the usual stream of points while frames are timed
    await pause(3000);
    await page.evaluate(() => (globalThis.probe.frames = []));
    await pause(15_000);
    const frames = await page.evaluate(() => globalThis.probe.frames);
    assert.ok(frames.length >= 20, `${frames.length} frames in 15 s`);
    const times = frames.map((one) => one.ms);
    row(`frame with ${millions} M points resident, 1280 x 800, following the vehicle`,
      `${share(times, 0.5).toFixed(0)} ms (p50), ${share(times, 0.99).toFixed(0)} ms (p99); ${(share(frames.map((one) => one.points), 0.5) / 1e6).toFixed(2)} M points drawn`);
    mock.pointsPerMessage = 100_000;
  }
  assert.deepEqual(page.wrong, []);
  await page.context().close();
  await mock.stop();
}

async function benchPixel(browser) {
  const { mock, page, url } = await onTheStreet(browser);
  mock.pointsPerMessage = 4000;
  await page.goto(`${url}/#cloud`);
  await resident(page, 0.3);
  await page.evaluate(() => (globalThis.probe.waits = []));
  await pause(30_000);
  const waits = await page.evaluate(() => globalThis.probe.waits);
  assert.ok(waits.length >= 50, `${waits.length} messages with points in 30 s`);
  row("from a message with points to the frame that shows them", `${share(waits, 0.5).toFixed(0)} ms (p50), ${share(waits, 0.99).toFixed(0)} ms (p99)`);
  await page.context().close();
  await mock.stop();
}

async function benchMemory(browser) {
  const { mock, page, url } = await onTheStreet(browser);
  mock.speed = speed;
  mock.pointsPerMessage = 20_000;
  await page.goto(`${url}/#cloud`);
  const cdp = await page.context().newCDPSession(page), system = await browser.newBrowserCDPSession();
  // The arrays that hold the points lie outside JavaScript's heap, and what was uploaded lies in the process of the graphics.
  const look = async () => {
    await cdp.send("HeapProfiler.collectGarbage");
    const { usedSize, backingStorageSize } = await cdp.send("Runtime.getHeapUsage");
    const { processInfo } = await system.send("SystemInfo.getProcessInfo");
    const share_kB = (pid) => Number(/^Pss:\s*(\d+)/m.exec(fs.readFileSync(`/proc/${pid}/smaps_rollup`, "utf8"))[1]);
    const all_kB = processInfo.filter(({ type }) => /renderer|GPU/i.test(type)).reduce((sum, { id }) => sum + share_kB(id), 0);
    return { page: (usedSize + backingStorageSize) / 1e6, processes: all_kB / 1e3 };
  };
  await resident(page, 10);
  const began = mock.drive_s, sizes = [];
  while (mock.drive_s - began < 8 * 3600) {
    await pause(5000);
    sizes.push(await look());
  }
  assert.ok(sizes[0].page > 10 * 16, "ten million points of 20 bytes each are more than what was counted");
  for (const [what, name] of [["page", "JavaScript's heap and arrays"], ["processes", "the processes of the page and of the graphics"]]) {
    const all = sizes.map((one) => one[what]), tenth = Math.ceil(all.length / 10);
    row(`memory over 8 h at ${speed} times real time, 10 M points resident: ${name}`,
      `${share(all.slice(0, tenth), 0.5).toFixed(0)} MB in the first tenth, ${share(all.slice(-tenth), 0.5).toFixed(0)} MB in the last, ${Math.max(...all).toFixed(0)} MB at most`);
  }
  assert.deepEqual(page.wrong, []);
  await page.context().close();
  await mock.stop();
}

/// What a client receives from the real console on each view, while a simulated drive runs.
async function benchBytes(browser) {
  const program = path.join(bin, "hueline-console");
  const work = fs.mkdtempSync(path.join(os.tmpdir(), "console-"));
  const users = path.join(work, "users.json");
  for (const one of ["drives", "scenarios"]) fs.mkdirSync(path.join(work, one));
  fs.cpSync(path.join(source, "config/rigs"), path.join(work, "rigs"), { recursive: true });
  const quiet = fs.readFileSync(path.join(source, "tests/browser/scenarios/each_sensor_lost.yaml"), "utf8");
  fs.writeFileSync(path.join(work, "scenarios/quiet.yaml"), quiet.replace(/faults:[^]*/, "").replace("rate_hz: 2", "rate_hz: 4"));
  assert.equal(spawnSync(program, ["user", "add", "anna", "--role", "operator", "--users", users], { input: "a long word\n" }).status, 0);
  const server = spawn(program, ["serve", "--drives", path.join(work, "drives"), "--rigs", path.join(work, "rigs"), "--page", folder, "--users", users,
    "--plain", "--port", "0", "--hueline", path.join(bin, "hueline"), "--allow-simulate", path.join(work, "scenarios")], { stdio: ["ignore", "ignore", "pipe"] });
  try {
    const url = await new Promise((found) => {
      let said = "";
      server.stderr.on("data", (text) => {
        const match = /the console is at (http:[^/]*\/\/[^/;]+)/.exec((said += text));
        if (match) found(match[1]);
      });
    });
    const page = await newPage(browser);
    const cdp = await page.context().newCDPSession(page);
    await cdp.send("Network.enable");
    let bytes = 0;
    cdp.on("Network.webSocketFrameReceived", ({ response }) => {
      bytes += response.opcode === 2 ? Math.floor(response.payloadData.length * 0.75) : response.payloadData.length;
    });
    await login(page, url);
    await page.waitForSelector(".answer.not_ready, .answer.ready");
    await page.getByLabel("Sensors").selectOption("quiet");
    await page.getByLabel("Name of the drive").fill("bytes");
    await page.locator(".start-form .main").click();
    await page.waitForSelector(".drive-view .sensor", { timeout: 300_000 });
    await page.waitForSelector(".bar.ok", { timeout: 120_000 });
    await page.evaluate(() => {
      globalThis.tasks = [];
      new PerformanceObserver((list) => globalThis.tasks.push(...list.getEntries().map((one) => one.duration))).observe({ entryTypes: ["longtask"] });
    });
    const rates = [];
    for (const view of ["drive", "images", "cloud"]) {
      await page.goto(`${url}/#${view}`);
      await pause(3000);
      bytes = 0;
      await page.evaluate(() => (globalThis.tasks = []));
      await pause(15_000);
      assert.ok(bytes > 0, view);
      if (view === "images")
        row("longest task of the page in 15 s of images, 4 a second, with laser points over them", `${(await page.evaluate(() => Math.max(0, ...globalThis.tasks))).toFixed(0)} ms`);
      rates.push(`${view} ${(bytes / 15_000).toFixed(0)} kB/s`);
    }
    // A drive does not end with its console, and the next one needs the ports of its devices.
    await page.locator(".actions .stop").click();
    await page.locator("dialog .main").click();
    await page.waitForSelector(".verdict-view .answer", { timeout: 300_000 });
    row("bytes that a client receives, by the view it has open (the cloud goes on to all views once it was open)", rates.join(", "));
  } finally {
    server.kill();
    fs.rmSync(work, { recursive: true, force: true, maxRetries: 20, retryDelay: 500 });
  }
}

const browser = await launch();
console.log(`Chromium ${browser.version()}, graphics computed in software, ${os.cpus().length} cores\n\n| what is measured | figure |\n|---|---|`);
for (const [name, bench] of Object.entries({ frames: benchFrames, pixel: benchPixel, memory: benchMemory, bytes: benchBytes }))
  if (parts.includes(name)) await bench(browser);
await browser.close();

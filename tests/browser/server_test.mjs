// The page with the real hueline-console: a simulated drive is started from the page, all lamps become green, each sensor is lost and comes back,
// the drive is marked and stopped, and its verdict is read. Both languages are seen.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import protocol from "@foxglove/ws-protocol";
import { McapStreamReader } from "@mcap/core";
import WebSocket from "ws";
import { chromiumPath, launch, login, newPage } from "./browser.mjs";
import { checkFrames, readFrames } from "./frames.mjs";

const { HUELINE_SOURCE: source, HUELINE_PAGE: folder, HUELINE_BIN: bin } = process.env;
const program = path.join(bin, "hueline-console");
for (const [what, is] of [["Chromium", chromiumPath], [program, fs.existsSync(program)]])
  if (!is) {
    console.log(`SKIPPED: ${what} is not there`);
    process.exit(0);
  }

const work = fs.mkdtempSync(path.join(os.tmpdir(), "console-"));
const users = path.join(work, "users.json");
fs.mkdirSync(path.join(work, "drives"));
fs.cpSync(path.join(source, "config/rigs"), path.join(work, "rigs"), { recursive: true });
const made = spawnSync(program, ["user", "add", "anna", "--role", "operator", "--users", users], { input: "a long word\n" });
assert.equal(made.status, 0, String(made.stderr));
const server = spawn(program, ["serve", "--drives", path.join(work, "drives"), "--rigs", path.join(work, "rigs"), "--page", folder, "--users", users, "--plain",
  "--port", "0", "--hueline", path.join(bin, "hueline"), "--allow-simulate", path.join(source, "tests/browser/scenarios")],
  { env: { ...process.env, XDG_CONFIG_HOME: path.join(work, "config") } });
let said = "";
server.stderr.on("data", (data) => (said += data));
const url = await new Promise((found, failed) => {
  server.on("exit", () => failed(new Error(said)));
  const look = setInterval(() => {
    const match = /the console is at (http:[^/]*\/\/[^/;]+)/.exec(said);
    if (match) clearInterval(look), found(match[1]);
  }, 50);
});

/// Notes in the page when the first alarm of each sensor is there to be read, by the sensor's name (window.alarmsShown), and which sensors'
/// lamps have been red (window.lampsShown), for a busy computer may look after they are green again. The clock is that of this computer, on
/// which the drive runs too.
const watchAlarms = (page) =>
  page.evaluate(() => {
    window.alarmsShown = {};
    window.lampsShown = new Set();
    const look = () => {
      for (const one of document.querySelectorAll(".sensor.alarm")) window.lampsShown.add(one.innerText);
      for (const one of document.querySelectorAll(".alarms li.alarm:not(.seen)")) {
        if (!one.querySelector(".lamp.alarm")) continue; // a warning
        const name = one.querySelector("strong").textContent.split(":")[0];
        const action = one.querySelector("dd:last-of-type")?.textContent ?? "";
        window.alarmsShown[name] ??= { at_ms: Date.now(), text: one.innerText, action };
      }
    };
    look();
    new MutationObserver(look).observe(document.body, { childList: true, subtree: true });
  });

/// What the drive tells to a second client, which is not the page: when health found something, in seconds of the drive.
function listen(port) {
  const token = spawnSync(program, ["user", "token", "anna", "--users", users], { encoding: "utf8" }).stdout.trim();
  const client = new protocol.FoxgloveClient({ ws: new WebSocket(`ws://127.0.0.1:${port}/?token=${token}`, ["foxglove.websocket.v1"]) });
  const heard = [], topics = new Map();
  client.on("error", () => {});
  client.on("advertise", (channels) => {
    for (const { id, topic } of channels) if (topic === "/hueline/events") topics.set(client.subscribe(id), topic);
  });
  client.on("message", ({ data }) => heard.push(JSON.parse(new TextDecoder().decode(data))));
  return { heard, close: () => client.close() };
}

/// Returns the Unix time of the recording's first packet, ms. Its times of arrival are CLOCK_MONOTONIC_RAW, which node cannot read.
function beginOfDrive(file) {
  const clocks = spawnSync("python3", ["-c", "import time; print(time.time_ns() - time.clock_gettime_ns(time.CLOCK_MONOTONIC_RAW))"], { encoding: "utf8" });
  assert.equal(clocks.status, 0, clocks.stderr);
  const input = fs.openSync(file), head = new Uint8Array(16 << 20);
  const bytes = head.subarray(0, fs.readSync(input, head));
  fs.closeSync(input);
  const reader = new McapStreamReader(); // its chunks are not compressed
  reader.append(bytes);
  for (let record; (record = reader.nextRecord()); )
    if (record.type === "Message") return Number((record.logTime + BigInt(clocks.stdout.trim())) / 1000n) / 1000;
  throw new Error(`${file} has no message`);
}

const browser = await launch();
let page, other;
try {
  page = await newPage(browser);
  page.setDefaultTimeout(90000);
  await page.goto(url);
  await page.fill("input[name=name]", "anna");
  await page.fill("input[name=password]", "not this");
  await page.click("button[type=submit]");
  await page.locator(".login .wrong").getByText(/\w{4}/).waitFor();
  await login(page, url);

  // May I start? There is no vehicle here, so the check must find what is missing.
  await page.waitForSelector(".answer.not_ready");
  assert.ok((await page.locator(".item.missing").count()) > 0);
  await page.getByLabel("Sensors").selectOption("each_sensor_lost");
  await page.getByLabel("Name of the drive").fill("today");
  await page.locator(".start-form .main").click();
  other = listen(new URL(url).port);
  // The simulator makes the whole drive before it begins.
  await page.waitForSelector(".drive-view .sensor", { timeout: 300000 });

  // Is all well?
  await page.waitForFunction(() => {
    const sensors = [...document.querySelectorAll(".sensor")];
    return sensors.length >= 4 && sensors.every((one) => one.classList.contains("ok")) && document.querySelector(".bar.ok");
  });
  console.log("all lamps are green");
  await watchAlarms(page);
  await page.locator(".actions .mark").click();
  await page.fill("dialog input", "Kirche 教堂");
  await page.keyboard.press("Enter");
  // Who is told that the computer did not answer, as a busy one does, sets the mark again. What failed is printed (browser.mjs).
  await page.waitForFunction(() => !document.querySelector("dialog") || document.querySelector("dialog .wrong")?.textContent);
  if (await page.locator("dialog").count()) await page.keyboard.press("Enter");
  await page.waitForSelector("dialog", { state: "detached" });
  await page.goto(`${url}/#marks`);
  await page.getByText("Kirche 教堂").waitFor();
  await page.goto(`${url}/#cloud`);
  await page.waitForFunction(() => /[1-9]\S*( k)? points/.test(document.querySelector(".legend")?.textContent ?? ""));
  await page.goto(`${url}/#map`);
  await page.waitForFunction(() => /[1-9]\S* m driven/.test(document.querySelector(".legend")?.textContent ?? ""));
  await page.goto(`${url}/#drive`);
  // Each sensor is pulled out in the simulator and put back. The laser's and the camera's alarms are read in English, the others' in Chinese.
  for (const sensor of ["laser", "camera", "pps", "pos"]) {
    await page.waitForFunction((name) => window.alarmsShown[name], sensor);
    const { text, action } = await page.evaluate((name) => window.alarmsShown[name], sensor);
    console.log(`${sensor}: ${text.replaceAll("\n", " | ")}`);
    const [title, cause] = /^(pps|pos)$/.test(sensor)
      ? [/已连接，但没有数据|连接中断/, "原因"]
      : [/Connected, but sends nothing|Connection lost|Sends, but not what it is there for/, "Cause"];
    assert.match(text, title);
    assert.ok(text.includes(cause) && /sends nothing|connection lost|no returns/.test(text), `the cause of the ${sensor}: ${text}`);
    assert.ok(action.length > 10, `what to do about the ${sensor}: ${action}`);
    await page.waitForFunction((name) => [...window.lampsShown].some((text) => text.includes(name)), sensor);
    await page.keyboard.press("a"); // acknowledged alarms make room for new ones
    if (sensor === "camera") {
      await page.locator("button.menu").click();
      await page.getByRole("button", { name: "中文" }).click();
      await page.keyboard.press("Escape");
      await page.waitForFunction(() => document.documentElement.lang === "zh-CN");
    }
    // It is put back, and its lamp and the lamp of the whole become green again by themselves.
    await page.locator(".sensor.ok", { hasText: sensor }).waitFor();
    await page.waitForFunction(() => document.querySelector(".bar.ok") && [...document.querySelectorAll(".sensor")].every((one) => one.classList.contains("ok")));
    console.log(`${sensor}: green again`);
  }
  await page.locator("button.menu").click();
  await page.getByRole("button", { name: "English" }).click();
  await page.keyboard.press("Escape");

  // May I leave the site?
  await page.locator(".actions .stop").click();
  await page.getByRole("button", { name: "Stop the drive" }).click();
  await page.goto(`${url}/#stop`);
  await page.waitForSelector(".verdict-view .answer");
  const verdict = await page.innerText(".verdict-view .answer");
  console.log("verdict:", verdict.trim());
  assert.match(verdict, /GOOD|USABLE WITH REMARKS|DRIVE AGAIN/);
  await page.frameLocator("iframe.report").locator("svg").first().waitFor();
  const [pdf] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: "Save the report as PDF" }).click()]);
  assert.equal(pdf.suggestedFilename(), "today.pdf");
  assert.match(fs.readFileSync(await pdf.path(), "latin1"), /^%PDF-1\.4/);
  const summary = JSON.parse(fs.readFileSync(path.join(work, "drives/today/summary.json"), "utf8"));
  assert.equal(summary.marks.at(-1).note, "Kirche 教堂");

  // From the moment at which health found it, which is that of a packet's arrival, to the moment at which it could be read on the page. The
  // figures are for people: a busy computer draws late.
  const begin = beginOfDrive(path.join(work, "drives/today/drive.mcap"));
  const shown = await page.evaluate(() => window.alarmsShown);
  for (const sensor of ["laser", "camera", "pps", "pos"]) {
    const found = other.heard.find((one) => one.kind === "health" && one.level === "alarm" && one.sensor === sensor);
    const late_ms = shown[sensor].at_ms - (begin + 1000 * found.drive_s);
    console.log(`${sensor}: shown ${late_ms.toFixed(0)} ms after it was detected at ${found.drive_s.toFixed(1)} s`);
    assert.ok(late_ms > -20 && late_ms < 15000, `${sensor}: ${late_ms} ms from detection to alarm`);
  }
  const tree = checkFrames(await readFrames(path.join(work, "drives/today/view.mcap")));
  console.log(`${tree.frames} frames, ${tree.messages} messages of ${tree.topics.length} topics name them; none is an orphan`);
  assert.ok(tree.frames > 5 && tree.messages > 100, JSON.stringify(tree));
  await page.goto(`${url}/#drives`);
  await page.getByText("today").waitFor();
  assert.deepEqual(page.wrong, []);
} catch (error) {
  if (page) await page.screenshot({ path: path.join(os.tmpdir(), "hueline-console-failed.png") }).catch(() => {});
  console.log(said, await page?.innerText("body").catch(() => ""));
  for (const file of fs.readdirSync(path.join(work, "drives"), { recursive: true }))
    if (file.endsWith(".log")) console.log(file, fs.readFileSync(path.join(work, "drives", file), "utf8").slice(-2000));
  throw error;
} finally {
  other?.close();
  await browser.close();
  server.kill("SIGTERM");
  // A drive that still runs writes to the folder, which must not hide what went wrong.
  fs.rmSync(work, { recursive: true, force: true, maxRetries: 20, retryDelay: 500 });
}

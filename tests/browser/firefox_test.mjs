// The operator's page in Firefox: it is entered, every view is opened while a drive runs, an alarm is read, and the drive is marked and stopped.
// What the page does in detail is tested in Chromium (page_test.mjs). With HUELINE_PICTURES=FOLDER it keeps pictures of the views.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import fs from "node:fs";
import path from "node:path";
import puppeteer from "puppeteer-core";
import { Mock } from "./mock_server.mjs";

const { HUELINE_SOURCE: source, HUELINE_PAGE: folder, HUELINE_PICTURES: pictures } = process.env;
const firefox = [process.env.HUELINE_FIREFOX, "/usr/bin/firefox-esr", "/usr/bin/firefox"].find((one) => one && fs.existsSync(one));
const screen = "/usr/bin/Xvfb";
for (const [what, is] of [["Firefox", firefox], ["Xvfb", fs.existsSync(screen)]])
  if (!is) {
    console.log(`SKIPPED: ${what} is not installed (apt install firefox-esr xvfb)`);
    process.exit(0);
  }

const mock = new Mock(folder, path.join(source, "storage/proto"), fs.readFileSync(path.join(source, "docs/images/shot_lidar_camera.jpg")));
mock.tiles = { least_zoom: 12, most_zoom: 18, attribution: "the surveyors" };
const url = await mock.start();
// Firefox has WebGL on a screen only; this one is in memory, and its graphics are computed in software.
const xvfb = spawn(screen, ["-displayfd", "1", "-screen", "0", "1400x1000x24", "-nolisten", "tcp"], { stdio: ["ignore", "pipe", "ignore"] });
process.on("exit", () => xvfb.kill()); // also if Firefox does not start
const [display] = await once(xvfb.stdout, "data");
const browser = await puppeteer.launch({
  browser: "firefox",
  executablePath: firefox,
  headless: false,
  env: { ...process.env, DISPLAY: `:${String(display).trim()}` },
  extraPrefsFirefox: { "webgl.force-enabled": true, "intl.accept_languages": "en-GB" },
});
try {
  const page = await browser.newPage();
  await page.setViewport({ width: 1280, height: 800 });
  page.setDefaultTimeout(60_000);
  const wrong = [];
  page.on("pageerror", (error) => wrong.push(`exception: ${error.message}`));
  page.on("console", (message) => {
    if (message.type() === "error" && !/WebSocket|NetworkError/.test(message.text())) wrong.push(message.text());
  });
  /// Waits until a place of the page has a text. A pattern is sought in all of it, as it is seen.
  const see = (selector, pattern) =>
    page.waitForFunction((where, source) => [...document.querySelectorAll(where)].some((one) => new RegExp(source).test(one.textContent)), {}, selector, pattern.source);
  const press = (selector) => page.locator(selector).click();
  const go = (view) => page.evaluate((hash) => (location.hash = hash), view);
  let shots = 0;
  const keep = async (view) => pictures && (await page.screenshot({ path: path.join(pictures, `firefox_${++shots}_${view}.png`) }));

  await page.goto(url);
  await page.locator("input[name=name]").fill("anna");
  await page.locator("input[name=password]").fill("a long word");
  await press("button[type=submit]");
  await see(".answer.ready", /READY/);
  await keep("start");
  await press(".start-form .main");
  await page.waitForSelector(".drive-view .sensor.ok");
  await page.waitForFunction(() => [...document.querySelectorAll(".sensor")].every((one) => one.classList.contains("ok")) && document.querySelector(".bar.ok"));
  await keep("drive");

  await go("cloud");
  await see(".legend", /[1-9]\S*( k)? points/);
  // What WebGL has drawn: more than the background.
  await page.waitForFunction(async () => {
    const canvas = document.querySelector(".cloud-view canvas");
    const picture = await createImageBitmap(canvas);
    const copy = new OffscreenCanvas(picture.width, picture.height).getContext("2d");
    await new Promise(requestAnimationFrame);
    copy.drawImage(canvas, 0, 0);
    const { data } = copy.getImageData(0, 0, picture.width, picture.height);
    const colours = new Set();
    for (let i = 0; i < data.length; i += 4 * 97) colours.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
    return colours.size > 30;
  });
  await keep("cloud");
  await go("images");
  await page.waitForFunction(() => document.querySelector(".images img")?.naturalWidth > 0);
  await keep("images");
  await go("map");
  await see(".legend", /[1-9]\S* m driven/);
  await see(".attribution", /the surveyors/);
  await keep("map");
  await go("clocks");
  await page.waitForSelector(".curve canvas");
  await go("events");
  await see(".events", /every sensor is there/);

  mock.trouble("laser", "silent", "alarm", "it has sent nothing for 3 s", "check power and cable");
  await see(".alarms", /check power and cable/);
  await keep("alarm");
  await page.keyboard.press("a");
  for (let i = 0; mock.state.acknowledged.length === 0; ++i) {
    assert.ok(i < 100, "the alarm is acknowledged");
    await new Promise((done) => setTimeout(done, 100));
  }
  mock.well("laser");
  await press("button.menu");
  await page.locator("::-p-text(中文)").click();
  await page.waitForFunction(() => document.documentElement.lang === "zh-CN");
  await page.keyboard.press("Escape");
  await go("drive");
  await press(".actions .mark");
  await page.locator("dialog input").fill("Kirche 教堂");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => !document.querySelector("dialog"));
  assert.equal(mock.marks.at(-1).note, "Kirche 教堂");

  mock.cut();
  await page.waitForFunction(() => document.querySelector(".bar.ok")); // it connects again by itself
  await press(".actions .stop");
  await press("dialog .main");
  await go("stop");
  await page.waitForSelector(".verdict-view .answer.good");
  await keep("stop");
  await go("drives");
  await see(".drives", /2026-11-20_0900/);
  assert.deepEqual(wrong, [], "the page threw, or broke the server's policy");
  console.log(`${await browser.version()}: every view was shown`);
} finally {
  await browser.close();
  await mock.stop();
  xvfb.kill();
}

// The operator's page in Chromium: what an operator does, what goes wrong, both languages, three sizes, and axe-core's rules of accessibility.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import test, { after, afterEach, before, beforeEach } from "node:test";
import { createRequire } from "node:module";
import { chromiumPath, kSizes, launch, login, newPage } from "./browser.mjs";
import { Mock } from "./mock_server.mjs";

if (!chromiumPath) {
  console.log("SKIPPED: Chromium is not installed (apt install chromium)");
  process.exit(0);
}
const source = process.env.HUELINE_SOURCE, folder = process.env.HUELINE_PAGE;
const axe = fs.readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const views = ["start", "drive", "stop", "cloud", "images", "map", "clocks", "events", "marks", "drives"];

let browser, mock, url, page;
before(async () => {
  browser = await launch();
});
after(() => browser.close());
beforeEach(async () => {
  mock = new Mock(folder, path.join(source, "storage/proto"), fs.readFileSync(path.join(source, "docs/images/shot_lidar_camera.jpg")));
  url = await mock.start();
});
afterEach(async () => {
  const wrong = page?.wrong ?? [];
  await page?.context().close();
  page = undefined;
  await mock.stop();
  assert.deepEqual(wrong, [], "the page threw, or broke the server's policy");
});

const open = async (view, options = {}) => {
  page = await newPage(browser, options);
  await login(page, url, options.name, options.password);
  if (view) await page.goto(`${url}/#${view}`);
  return page;
};
const see = (text, options = {}) => page.getByText(text, options).first().waitFor();
const posts = (call) => mock.calls.filter((one) => one.method === "POST" && one.path === call);

test("a wrong password is refused with a reason, a right one enters, and logging out leaves nothing", async () => {
  page = await newPage(browser);
  await page.goto(url);
  await page.fill("input[name=name]", "anna");
  await page.fill("input[name=password]", "wrong");
  await page.click("button[type=submit]");
  await see("Name or password is wrong.");
  await page.fill("input[name=password]", "a long word");
  await page.press("input[name=password]", "Enter");
  await page.waitForSelector("nav.tabs");
  await page.reload();
  await page.waitForSelector("nav.tabs");
  await page.click("button.menu");
  await page.getByRole("button", { name: /Log out/ }).click();
  await page.waitForSelector("input[name=password]");
  await page.reload();
  await page.waitForSelector("input[name=password]");
});

test("without users the page says how to make one", async () => {
  mock.noUsers = true;
  page = await newPage(browser);
  await page.goto(url);
  await see("hueline-console user add NAME");
  assert.equal(await page.locator("input[name=password]").count(), 0);
});

test("start, drive, mark, stop, verdict", async () => {
  await open();
  await page.waitForSelector(".answer.ready");
  await see("Remarks: 1.");
  await page.getByRole("button", { name: "Start the drive" }).click();
  await page.waitForSelector(".drive-view");
  assert.deepEqual(posts("start")[0].body, { rig: "street" });
  await page.waitForFunction(() => document.querySelectorAll(".sensor.ok").length === 5);
  await page.waitForFunction(() => [...document.querySelectorAll(".card")].every((one) => one.classList.contains("ok")));
  await see("ALL WELL");
  await page.keyboard.press("m");
  await page.fill("dialog input", "Kirche 教堂 ♜");
  await page.keyboard.press("Enter");
  await see("The mark is sent.");
  assert.equal(posts("mark")[0].body.note, "Kirche 教堂 ♜");
  await page.goto(`${url}/#marks`);
  await see("Kirche 教堂 ♜");
  await page.getByRole("button", { name: "Stop", exact: false }).click();
  await page.getByRole("button", { name: "Go on driving" }).click();
  assert.equal(posts("stop").length, 0, "stopping asks first");
  await page.goto(`${url}/#drive`);
  await page.locator(".actions .stop").click();
  await page.getByRole("button", { name: "Stop the drive" }).click();
  await page.goto(`${url}/#stop`);
  await page.waitForSelector(".verdict-view .answer.good");
  await see("You may leave the site.");
  await page.frameLocator("iframe.report").getByText("Drive report").waitFor();
  assert.match(await page.getByRole("link", { name: "Save the report as PDF" }).getAttribute("href"), /^\/api\/drives\/[^/]+\/report\.pdf$/);
});

test("another rig may be chosen while one is checked, and a second page follows a check that runs", async () => {
  mock.check_ms = 1500;
  await open();
  await page.waitForSelector(".answer.checking");
  const rig = page.locator(".start-form select").first();
  assert.ok(await page.locator(".start-form .main").isDisabled(), "the devices are in use while they are checked");
  await rig.selectOption("minimal");
  await page.waitForSelector(".answer.ready");
  await page.locator(".judgement .at", { hasText: "minimal" }).waitFor();
  assert.deepEqual(posts("check").map((one) => one.body.rig), ["street", "minimal"]);
  assert.equal(await page.locator(".start-form .wrong").textContent(), "");
  // Another page checks the same rig; this one waits for that instead of being refused.
  await page.evaluate(() => fetch("/api/check", { method: "POST", body: JSON.stringify({ rig: "street" }), headers: { "X-Csrf": "token" } }));
  await rig.selectOption("street");
  await page.locator(".judgement .at", { hasText: "street" }).waitFor();
  await page.waitForSelector(".answer.ready");
  assert.equal(posts("check").length, 3, "the third is that of the other page");
});

test("what is missing is named with what to do, and starting anyway needs a reason", async () => {
  mock.checkItems.push({ name: "pps", state: "missing", text: "/dev/pps0 does not exist.", action: "sudo modprobe pps-gpio" });
  await open();
  await page.waitForSelector(".answer.not_ready");
  await see("sudo modprobe pps-gpio");
  const start = page.getByRole("button", { name: "Start anyway" });
  assert.ok(await start.isDisabled());
  await page.getByLabel("Reason to start although something is missing").fill("test of the scanner only");
  await start.click();
  await page.waitForSelector(".drive-view");
  assert.deepEqual(posts("start")[0].body, { rig: "street", override: "test of the scanner only" });
});

test("a check that cannot be done is told in the operator's words, with the program's behind them", async () => {
  mock.checkError = { error: "the check ended with status 2: hueline: rigs/street.yaml:7: key 'sensors' is missing", exit_status: 2 };
  await open();
  await see("The rig street cannot be used: its file is wrong.");
  assert.ok(!(await page.getByText("key 'sensors' is missing").isVisible()));
  await page.getByText("What the program said").click();
  await see("key 'sensors' is missing");
  await page.waitForSelector(".answer.unknown");
  mock.checkError = { error: "the check ended with status 1: hueline: no memory", exit_status: 1 };
  await page.getByRole("button", { name: "Check again" }).click();
  await see("The check could not be done");
});

test("a page without a drive says so, and how to start one", async () => {
  await open("start");
  for (const view of ["drive", "cloud", "images", "map", "clocks", "events", "marks"]) {
    await page.goto(`${url}/#${view}`);
    await see("No drive is running. Start one on the page Start, or replay one on the page Drives.");
  }
});

test("the answer to whether a drive may start stands in one line", async () => {
  mock.check_ms = 20000;
  await open("start");
  await page.waitForSelector(".answer.checking");
  for (const width of [1920, 1366, 1280, 1024, 390]) {
    await page.setViewportSize({ width, height: 768 });
    const { lines, wide } = await page.evaluate(() => {
      const lamp = document.querySelector(".answer .lamp"), range = document.createRange();
      range.selectNodeContents(lamp.lastElementChild);
      return { lines: range.getClientRects().length, wide: lamp.scrollWidth - lamp.clientWidth };
    });
    assert.equal(lines, 1, `at ${width} px`);
    assert.ok(wide <= 0, `at ${width} px it is ${wide} px wider than its place`);
  }
});

test("the rig's checklist is ticked by hand before it says ready", async () => {
  mock.checklist = ["The caps of the lenses are off.", "镜头已擦净。"];
  await open();
  await page.waitForSelector(".answer.by_hand");
  assert.ok(await page.getByRole("button", { name: "Start anyway" }).isDisabled());
  await page.getByLabel("The caps of the lenses are off.").check();
  await page.waitForSelector(".answer.by_hand");
  await page.getByLabel("镜头已擦净。").check();
  await page.waitForSelector(".answer.ready");
  await page.getByRole("button", { name: "Start the drive" }).click();
  await page.waitForSelector(".drive-view");
  assert.deepEqual(posts("start")[0].body, { rig: "street", checked: 2 });
});

test("the test exposure shows how bright each lens is", async () => {
  await open();
  await page.getByRole("img", { name: "left: median 91 of 255, 3.1 % dark, 0.4 % saturated" }).waitFor();
  const heights = await page.$$eval(".light:first-of-type rect", (bars) => bars.map((bar) => bar.getBoundingClientRect().height));
  assert.equal(heights.length, 64);
  assert.equal(heights.indexOf(Math.max(...heights)), 22);
  assert.ok(heights[63] > 5, "some saturated pixels are to be seen");
});

test("the answer is read from a metre away", async () => {
  for (const size of ["tablet", "phone"]) {
    await open("start", { size });
    await page.waitForSelector(".answer.ready");
    const px = await page.$eval(".answer .word", (word) => parseFloat(getComputedStyle(word).fontSize));
    // 96 px are an inch; letters of 9 mm height are read from a metre by the road-sign rule of 1:250 with reserve.
    assert.ok(px >= 35, `letters of ${px} px on a ${size}`);
    if (size === "tablet") await page.context().close();
  }
});

test("an alarm comes within a second with cause and action, sounds, is acknowledged and stays until it is over", async () => {
  await open();
  mock.begin();
  await page.waitForSelector(".sensor.ok");
  await page.evaluate(() => {
    window.tones = 0;
    const start = OscillatorNode.prototype.start;
    OscillatorNode.prototype.start = function (...when) {
      ++window.tones;
      return start.apply(this, when);
    };
  });
  await page.mouse.click(640, 650); // sound is allowed after a touch
  await page.evaluate(() => {
    new MutationObserver(() => (window.alarmAt ??= document.querySelector(".alarms li.alarm") ? Date.now() : undefined)).observe(document.body, { childList: true, subtree: true });
  });
  await page.waitForTimeout(1500); // the browser starts its audio
  const told = Date.now();
  mock.trouble("head", "gone", "alarm", "connection lost: no heartbeat from 192.168.1.20", "Check the camera's cable.");
  await page.waitForSelector(".alarms li.alarm");
  const shown = await page.evaluate(() => window.alarmAt);
  assert.ok(shown - told < 1000, `${shown - told} ms`);
  console.log(`alarm shown after ${shown - told} ms`);
  const alarm = page.locator(".alarms li.alarm");
  const text = await alarm.innerText();
  for (const part of ["ALARM", "head", "Connection lost", "no heartbeat", "Check the camera's cable."]) assert.ok(text.includes(part), part);
  await page.waitForFunction(() => window.tones >= 3);
  await page.waitForFunction(() => window.tones >= 6, undefined, { timeout: 8000 }); // again, until it is acknowledged
  await page.waitForSelector(".bar.alarm");
  await page.keyboard.press("a");
  await page.waitForSelector(".alarms li.alarm.seen");
  const tones = await page.evaluate(() => window.tones);
  await page.waitForTimeout(3500);
  assert.equal(await page.evaluate(() => window.tones), tones, "an acknowledged alarm is silent");
  assert.equal(await page.locator(".alarms li.alarm.seen").count(), 1, "and in sight");
  await page.getByRole("button", { name: "head: ALARM", exact: false }).click();
  await page.locator(".sensor.alarm .more").getByText("no heartbeat").waitFor();
  mock.well("head");
  await page.waitForFunction(() => document.querySelectorAll(".alarms li").length === 0);
  await see("ALL WELL");
  mock.trouble("head", "gone", "alarm", "again", "");
  await page.waitForSelector(".alarms li.alarm:not(.seen)");
});

test("who acknowledges an alarm acknowledges it on every page; a viewer, on the viewer's page alone", async () => {
  await open();
  mock.begin();
  await page.waitForSelector(".sensor.ok");
  mock.trouble("head", "gone", "alarm", "connection lost", "");
  await page.waitForSelector(".alarms li.alarm:not(.seen)");
  mock.acknowledge("head gone alarm");
  await page.waitForSelector(".alarms li.alarm.seen");
  mock.trouble("pos", "weak_gnss", "warning", "DGNSS instead of RTK", "");
  await page.waitForSelector(".alarms li.warning:not(.seen)");
  await page.keyboard.press("a");
  await page.waitForSelector(".alarms li.warning.seen");
  const acknowledged = () => posts("acknowledge").map((one) => one.body.alarm);
  assert.deepEqual(acknowledged(), ["pos weak_gnss warning"]);
  mock.well("head");
  mock.well("pos");
  await page.waitForFunction(() => document.querySelectorAll(".alarms li").length === 0);
  await page.context().close();

  await open("drive", { name: "victor", password: "another word" });
  mock.trouble("head", "gone", "alarm", "connection lost", "");
  await page.waitForSelector(".alarms li.alarm:not(.seen)");
  await page.keyboard.press("a");
  await page.waitForSelector(".alarms li.alarm.seen");
  assert.equal(acknowledged().length, 1);
});

test("a capture that ends by itself is an alarm, until somebody has seen it", async () => {
  await open();
  mock.begin();
  await page.waitForSelector(".sensor.ok");
  mock.kill();
  await page.locator(".alarms li.alarm", { hasText: "The capture has ended by itself" }).waitFor();
  await see("Nothing is recorded now");
  await page.keyboard.press("a");
  await page.waitForFunction(() => document.querySelectorAll(".alarms li").length === 0);
  assert.equal(mock.state.ended, false);
  await page.goto(`${url}/#stop`);
  await page.waitForSelector(".verdict-view .answer.unknown");
  await see("What was recorded until then is whole");
});

test("an operator hears the alarm of the vehicle's computer, or reads why nobody can", async () => {
  await open();
  await page.locator("button.menu").click();
  await page.getByRole("button", { name: "Hear the alarm" }).click();
  while (posts("sound").length === 0) await page.waitForTimeout(50);
  mock.state.sound_trouble = "no alarm can be heard: the sound device 'default' cannot be opened";
  await page.locator("dialog").getByText("the sound device 'default' cannot be opened").waitFor();
});

test("each lamp has a shape and a word of its own, not colour alone", async () => {
  await open();
  mock.begin();
  mock.trouble("pos", "weak_gnss", "warning", "DGNSS instead of RTK", "");
  mock.trouble("laser", "silent", "alarm", "nothing for 2.0 s", "");
  mock.trouble("pps", "no_clock", "waiting", "no label yet", "");
  await page.waitForSelector(".sensor.waiting");
  const lamps = await page.$$eval(".sensor .lamp", (all) => all.map((one) => [one.querySelector(".word").textContent, one.querySelector("svg").innerHTML]));
  assert.deepEqual([...new Set(lamps.map(([word]) => word))].sort(), ["ALARM", "OK", "WAITING", "WARNING"]);
  assert.equal(new Set(lamps.map(([word]) => word)).size, new Set(lamps.map(([, shape]) => shape)).size);
});

test("a lost connection is told at once, the data are marked as old, and it is back by itself", async () => {
  await open();
  mock.begin();
  await page.waitForSelector(".sensor.ok");
  mock.isFrozen = true;
  await page.waitForSelector(".bar .link.lost");
  assert.match(await page.innerText(".bar .link"), /old data: \d+/);
  await page.waitForSelector(".drive-view.old");
  mock.isFrozen = false;
  await page.waitForFunction(() => !document.querySelector(".bar .link.lost"));
  for (let round = 0; round < 3; ++round) {
    mock.cut();
    await page.waitForFunction(() => /live/.test(document.querySelector(".bar .link")?.textContent) && !document.querySelector(".drive-view.old"));
  }
  await page.goto(`${url}/#events`);
  // What the server tells again after a connection is not there twice. Between the two the list is empty for a moment.
  await page.waitForFunction(() => document.querySelectorAll(".events li").length > 0);
  await page.waitForTimeout(1000);
  await page.waitForFunction(() => document.querySelectorAll(".events li").length === 1);
});

test("events are filtered by level, sensor and words", async () => {
  await open("events");
  mock.begin();
  for (let i = 0; i < 40; ++i) mock.event("fault", i % 4 === 0 ? "warning" : "info", i % 2 ? "laser" : "head", `datagram ${i} lost`);
  await see("datagram 39 lost");
  await page.getByLabel("Level").selectOption("warning");
  await see("10 of 41 events");
  await page.getByLabel("Sensor").selectOption("head");
  await page.getByLabel("Search").fill("datagram 8 ");
  await see("1 of 41 events");
  await page.getByLabel("Search").fill("nothing like it");
  await see("No event fits the filters.");
});

test("the cloud grows: its points are on the canvas, and damaged messages do not stop it", async () => {
  await open("cloud");
  mock.pointsPerMessage = 3000;
  mock.begin();
  await page.waitForFunction(() => /\d k points/.test(document.querySelector(".legend")?.textContent ?? ""));
  mock.damage("/cloud");
  const count = async () => parseFloat((await page.innerText(".legend")).replace(/[^\d.].*/s, ""));
  const before = await count();
  await page.waitForFunction((n) => parseFloat(document.querySelector(".legend")?.textContent) > n, before + 10);
  // The picture has many colours where an empty one has two.
  const png = await page.locator(".cloud-view canvas").screenshot();
  assert.ok(png.length > 20000, `${png.length} bytes of picture`);
  for (const mode of ["intensity", "height", "quality", "sigma", "exposure", "moving"]) await page.getByLabel("Show by").selectOption(mode);
  await page.getByRole("button", { name: /Camera/ }).click();
});

test("images of each camera, the clocks' curves and the map come", async () => {
  await open("images");
  mock.speed = 3;
  mock.begin();
  await page.waitForFunction(() => document.querySelector(".images img")?.naturalWidth > 0);
  await page.goto(`${url}/#clocks`);
  await page.waitForSelector(".curve canvas");
  mock.hole = true;
  mock.fix = "Single";
  await page.goto(`${url}/#map`);
  await page.waitForFunction(() => /[1-9]\d* m without points, [1-9]\d* m with weak GNSS/.test(document.querySelector(".legend")?.textContent));
});

test("the map is drawn on the console's tiles, which lie where the vehicle drives", async () => {
  mock.tiles = { least_zoom: 12, most_zoom: 18, attribution: 'Map by <a href="https://example.org/">the surveyors</a>' };
  mock.speed = 40;
  mock.begin();
  await open("map");
  await see("Map by the surveyors");
  await page.waitForFunction(() => /^[1-9],\d{3} m driven/.test(document.querySelector(".legend > p:last-child")?.textContent));
  // Along a line across the middle of the block: the two streets of the tiles, and the driven paths in their middles.
  const look = () =>
    page.evaluate(() => {
      const canvas = document.querySelector(".map-view canvas"), { width, height } = canvas;
      const { data } = canvas.getContext("2d").getImageData(0, Math.round(height * 0.56), width, 1);
      const of = (wanted) => [...Array(width).keys()].filter((x) => wanted(...data.subarray(4 * x, 4 * x + 3)));
      return { street: of((r, g, b) => r - g > 60 && b - g > 60), path: of((r, g, b) => g - r > 60 && g - b > 30), width };
    });
  const until = async (is) => {
    for (let i = 0; ; ++i) {
      const seen = await look();
      if (is(seen)) return seen;
      assert.ok(i < 100, JSON.stringify(seen));
      await new Promise((done) => setTimeout(done, 300));
    }
  };
  const seen = await until(({ street, path }) => street.length > 10 && path.length > 4);
  const middles = ({ street, path, width }, side) => [street, path].map((all) => all.filter((x) => x < width / 2 === side)).map((all) => (all[0] + all.at(-1)) / 2);
  for (const side of [true, false]) {
    const [street, path] = middles(seen, side);
    assert.ok(Math.abs(street - path) < 2, `the street's middle is at ${street}, the path at ${path}`);
  }
  await page.getByRole("button", { name: "Background" }).click();
  await until(({ street, path }) => street.length === 0 && path.length > 4); // on a grid
  assert.equal(await page.locator(".attribution").count(), 0);
});

test("a viewer sees everything and can change nothing", async () => {
  mock.begin();
  await open("drive", { name: "victor", password: "another word" });
  await page.waitForSelector(".sensor.ok");
  assert.equal(await page.locator(".actions").count(), 0);
  await page.goto(`${url}/#start`);
  await see("You are logged in as a viewer.");
  assert.equal(posts("start").length + posts("check").length, 0);
});

test("a drive whose summary a full disk has cut has no verdict, and no praise", async () => {
  const drive = { name: "cut", begin: null, duration_s: null, path_m: null, points: null, coloured_share: null, grade: null, bytes: 5e6, running: false };
  mock.drives.push(drive);
  mock.allDrives = 5000;
  for (const text of ["", "{}", "null", "[1]", '{"verdict": {"grade": "go', '{"verdict": {}}']) {
    mock.summaryText = text;
    await open("drives");
    await see("of 5000 drives");
    await page.getByText("cut", { exact: true }).click();
    await page.waitForSelector(".verdict-view .answer.unknown");
    await see("gives points and verdict");
    assert.equal(await page.getByText("Nothing was worse").count(), 0, text);
  }
});

test("other drives have their verdicts, and one can be replayed", async () => {
  await open("drives");
  await page.getByText("2026-11-18_1100").click();
  await page.waitForSelector(".verdict-view .answer.again");
  await see("without images for 64.0 s");
  await page.getByLabel("Speed").selectOption("5");
  await page.getByRole("button", { name: /Replay/ }).click();
  await page.waitForSelector(".drive-view");
  assert.deepEqual(posts("replay")[0].body, { drive: "2026-11-18_1100", speed: 5 });
});

test("a replay has a time line: it is paused without an alarm, goes on elsewhere, and gets another speed", async () => {
  await open("drives");
  mock.beginReplay("2026-11-18_1100"); // 640 s
  for (const view of ["drive", "cloud", "map"]) {
    await page.goto(`${url}/#${view}`);
    await page.waitForSelector(".time-line input[type=range]");
  }
  const line = page.locator(".time-line"), slider = line.locator("input");
  assert.equal(await slider.getAttribute("max"), "640");
  await page.waitForFunction(() => Number(document.querySelector(".time-line input")?.value) >= 2, undefined, { timeout: 10000 });

  await line.getByRole("button", { name: "Pause" }).click();
  await see("replay, paused");
  assert.deepEqual(posts("replay/pace").map((one) => one.body), [{ paused: true }]);
  const at = await slider.inputValue();
  await page.waitForTimeout(3500); // longer than data may be old
  assert.equal(await slider.inputValue(), at, "a paused replay stands");
  assert.equal(await page.locator(".bar .link.lost, .alarms li, .drive-view.old").count(), 0, "a paused replay is no lost link");

  // By keys: two steps, one jump.
  await slider.focus();
  await page.keyboard.press("End");
  await page.keyboard.press("ArrowLeft");
  await see("Going to 10:39");
  await page.waitForFunction(() => document.querySelector(".time-line .value")?.textContent === "10:39 of 10:40", undefined, { timeout: 10000 });
  assert.deepEqual(posts("replay/seek").map((one) => one.body), [{ position_s: 639 }]);
  assert.equal(await slider.getAttribute("aria-valuetext"), "10:39 of 10:40");
  await see("replay, paused");
  assert.equal(await page.locator(".bar .link.lost, .alarms li").count(), 0, "neither is one that goes on elsewhere");

  await line.getByRole("button", { name: "Go on" }).click();
  await line.getByLabel("Speed").selectOption("10");
  for (let i = 0; i < 100 && posts("replay/pace").length < 3; ++i) await page.waitForTimeout(50);
  assert.deepEqual(posts("replay/pace").slice(1).map((one) => one.body), [{ paused: false }, { speed: 10 }]);
  await page.waitForFunction(() => /^10:5|^11:/.test(document.querySelector(".time-line .value")?.textContent), undefined, { timeout: 10000 });
  // What stops is still told.
  mock.isFrozen = true;
  await page.waitForSelector(".bar .link.lost");
});

test("a viewer sees where a replay is, and cannot move it", async () => {
  mock.beginReplay("2026-11-18_1100");
  await open("map", { name: "victor", password: "another word" });
  await page.waitForSelector(".time-line input:disabled");
  assert.equal(await page.locator(".time-line button, .time-line select").count(), 0);
});

test("the whole page in Chinese, with what to do in Chinese too", async () => {
  await open("start", { locale: "zh-CN" });
  await see("就绪");
  mock.begin();
  mock.trouble("pps", "holdover", "warning", "no pulse for 3.0 s", "Check the PPS wire.");
  await see("秒脉冲中断");
  await see("检查 PPS 线缆");
  assert.equal(await page.getAttribute("html", "lang"), "zh-CN");
  for (const view of views) {
    await page.goto(`${url}/#${view}`);
    await page.waitForTimeout(150);
    // What is English is marked as English, and is a sentence or a name of the program.
    const english = await page.evaluate(() => {
      const walk = document.createTreeWalker(document.querySelector(".frame"), NodeFilter.SHOW_TEXT);
      const found = [];
      while (walk.nextNode()) {
        const text = walk.currentNode.textContent.trim();
        if (/[A-Za-z]{4,} [A-Za-z]{3,}/.test(text) && !walk.currentNode.parentElement.closest("[lang=en]")) found.push(text);
      }
      return found;
    });
    assert.deepEqual(english.filter((text) => !/^INS SOLUTION/.test(text)), [], view);
  }
});

for (const size of Object.keys(kSizes))
  test(`nothing is too small to touch, and nothing is wider than the page: ${size}`, async () => {
    await open("start", { size });
    await page.waitForSelector(".answer.ready");
    for (const view of views) {
      if (view === "drive") mock.beginReplay("2026-11-18_1100"); // with its time line
      await page.goto(`${url}/#${view}`);
      await page.waitForTimeout(300);
      const small = await page.evaluate(() =>
        [...document.querySelectorAll("button, a, select, input, summary")]
          .filter((one) => one.checkVisibility() && !one.matches(".skip"))
          .map((one) => [one.textContent.slice(0, 20), one.getBoundingClientRect()])
          .filter(([, { width, height }]) => width < 44 || height < 43.5)
          .map(([text, { width, height }]) => `${text} ${width} x ${height}`));
      assert.deepEqual(small, [], view);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      assert.ok(wide <= 0, `${view} is ${wide} px wider than the page`);
    }
  });

for (const colorScheme of ["light", "dark"])
  test(`axe-core finds no serious fault: ${colorScheme}`, async () => {
    await open("start", { colorScheme });
    await page.waitForSelector(".answer.ready");
    const check = async (what) => {
      const found = await page.evaluate(() => window.axe.run(document, { iframes: false, resultTypes: ["violations"] }));
      const serious = found.violations.filter((one) => one.impact === "serious" || one.impact === "critical");
      assert.deepEqual(serious.map((one) => `${one.id}: ${one.nodes[0].html} ${one.nodes[0].failureSummary}`), [], what);
    };
    await page.addInitScript(axe); // not subject to the page's policy, as a script of the page would be
    await page.reload();
    await page.waitForSelector(".answer.ready");
    await check("start");
    mock.begin();
    mock.trouble("head", "gone", "alarm", "connection lost", "Check the cable.");
    mock.trouble("pos", "weak_gnss", "warning", "DGNSS", "Find free sky.");
    for (const view of views) {
      await page.goto(`${url}/#${view}`);
      await page.waitForTimeout(300);
      await check(view);
    }
    await page.goto(`${url}/#drive`);
    await page.locator(".sensor.alarm .line").click();
    await page.locator(".actions .mark").click();
    await check("mark");
    await page.keyboard.press("Escape");
    mock.end();
    mock.beginReplay("2026-11-18_1100");
    await page.waitForSelector(".time-line");
    await check("replay");
  });

// The page with the real hueline-console: a simulated drive is started from the page, all lamps become green, the camera's link is lost and comes
// back, the drive is marked and stopped, and its verdict is read.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { chromiumPath, launch, login, newPage } from "./browser.mjs";

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

const browser = await launch();
let page;
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
  await page.getByLabel("Sensors").selectOption("camera_lost");
  await page.getByLabel("Name of the drive").fill("today");
  await page.locator(".start-form .main").click();
  // The simulator makes the whole drive before it begins.
  await page.waitForSelector(".drive-view .sensor", { timeout: 300000 });

  // Is all well?
  await page.waitForFunction(() => {
    const sensors = [...document.querySelectorAll(".sensor")];
    return sensors.length >= 4 && sensors.every((one) => one.classList.contains("ok")) && document.querySelector(".bar.ok");
  });
  console.log("all lamps are green");
  await page.locator(".actions .mark").click();
  await page.fill("dialog input", "Kirche 教堂");
  await page.keyboard.press("Enter");
  await page.goto(`${url}/#marks`);
  await page.getByText("Kirche 教堂").waitFor();
  await page.goto(`${url}/#cloud`);
  await page.waitForFunction(() => /[1-9]\S*( k)? points/.test(document.querySelector(".legend")?.textContent ?? ""));
  await page.goto(`${url}/#map`);
  await page.waitForFunction(() => /[1-9]\S* m driven/.test(document.querySelector(".legend")?.textContent ?? ""));
  await page.goto(`${url}/#drive`);
  // On a busy computer the emulated devices themselves may be late, which is a warning of its own.
  const alarm = page.locator(".alarms li.alarm", { hasText: "alarm" }).first();
  await alarm.waitFor();
  const text = await alarm.innerText();
  console.log(text.replaceAll("\n", " | "));
  assert.match(text, /ALARM/);
  assert.match(text, /Cause/);
  await page.waitForSelector(".sensor.alarm");

  // It is back by itself.
  await page.waitForFunction(() => document.querySelector(".sensor") && !document.querySelector(".sensor.alarm"));

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
  await browser.close();
  server.kill("SIGTERM");
  // A drive that still runs writes to the folder, which must not hide what went wrong.
  fs.rmSync(work, { recursive: true, force: true, maxRetries: 20, retryDelay: 500 });
}

// Makes the pictures of docs/operating.md: node pictures.mjs FOLDER, or the target hueline_console_pictures. The drive is the made street
// of mock_street.mjs.
import fs from "node:fs";
import path from "node:path";
import { launch, login, newPage } from "./browser.mjs";
import { Mock } from "./mock_server.mjs";

const kMostBytes = 150_000;
const folder = process.argv[2], source = process.env.HUELINE_SOURCE;
const mock = new Mock(process.env.HUELINE_PAGE, path.join(source, "storage/proto"), fs.readFileSync(path.join(source, "docs/images/shot_lidar_camera.jpg")));
const url = await mock.start();
const browser = await launch();

async function take(page, name) {
  // A picture of the cloud has too many colours for PNG.
  const isCloud = name.endsWith(".jpg");
  const file = path.join(folder, name);
  await page.screenshot({ path: file, timeout: 120000, ...(isCloud ? { type: "jpeg", quality: 32 } : { type: "png" }) });
  const { size } = fs.statSync(file);
  if (size > kMostBytes) throw new Error(`${name} has ${size} bytes, more than ${kMostBytes}`);
  console.log(name, size);
}

const tablet = await newPage(browser, { size: "tablet" });
await login(tablet, url);
await tablet.waitForSelector(".answer.ready");
await take(tablet, "console_start.png");
mock.begin("2026-11-23_0100", "street", true);
mock.pointsPerMessage = 20000;
await tablet.goto(`${url}/#cloud`);
await tablet.waitForFunction(() => / M points/.test(document.querySelector(".legend")?.textContent), undefined, { timeout: 120000 });
await tablet.getByLabel("Point size").fill("1.5");
mock.speed = 0; // at rest the page draws more points
await tablet.waitForTimeout(5000);
await take(tablet, "console_cloud.jpg");
mock.pointsPerMessage = 500;
mock.speed = 4;
await tablet.goto(`${url}/#map`);
await tablet.waitForTimeout(5000);
mock.fix = "RtkFloat";
await tablet.waitForTimeout(1500);
mock.fix = "RtkFixed";
mock.hole = true;
await tablet.waitForTimeout(1200);
mock.hole = false;
await tablet.waitForTimeout(2500);
mock.speed = 1;
mock.mark("Church");
await tablet.waitForTimeout(1500);
await take(tablet, "console_map.png");
await tablet.goto(`${url}/#marks`);
await tablet.getByText("Church").waitFor();
await take(tablet, "console_marks.png");
await tablet.goto(`${url}/#images`);
await tablet.waitForFunction(() => document.querySelector(".images img")?.naturalWidth > 0);
await tablet.waitForTimeout(500);
await take(tablet, "console_images.jpg");
await tablet.goto(`${url}/#clocks`);
await tablet.waitForSelector(".curve canvas");
await tablet.waitForTimeout(1000);
await take(tablet, "console_clocks.png");
await tablet.goto(`${url}/#drive`);
mock.trouble("head", "gone", "alarm", "connection lost: no heartbeat from 192.168.1.20 for 1.0 s", "Check the camera's cable and power; it is connected again by itself.");
await tablet.waitForSelector(".alarms li");
await take(tablet, "console_drive.png");

await tablet.goto(`${url}/#events`);
await tablet.locator(".events").getByText("no heartbeat").first().waitFor();
await take(tablet, "console_events.png");

const phone = await newPage(browser, { size: "phone", locale: "zh-CN", colorScheme: "dark" });
await login(phone, url);
await phone.goto(`${url}/#drive`);
await phone.waitForSelector(".alarms li");
await take(phone, "console_phone.png");
mock.well("head");
mock.end(0, "good");
await tablet.goto(`${url}/#stop`);
await tablet.waitForSelector(".verdict-view .answer.good");
await take(tablet, "console_stop.png");
await tablet.goto(`${url}/#drives`);
await tablet.getByText("2026-11-20_0900").waitFor();
await take(tablet, "console_drives.png");

await browser.close();
await mock.stop();

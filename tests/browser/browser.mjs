// A page in Debian's Chromium, and what the tests of the page have in common.
import fs from "node:fs";
import { chromium } from "playwright-core";

const programs = [process.env.HUELINE_CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
export const chromiumPath = programs.find((one) => one && fs.existsSync(one));
export const kSizes = { tablet: { width: 1280, height: 800 }, desk: { width: 1920, height: 1080 }, phone: { width: 390, height: 844 } };

export async function launch() {
  return chromium.launch({
    executablePath: chromiumPath,
    // Root has no sandbox in a container; the graphics are computed in software, so that the tests need no display.
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--autoplay-policy=user-gesture-required"],
  });
}

/// A page whose errors are collected in page.wrong: exceptions, refused resources, violations of the server's policy.
export async function newPage(browser, { size = "tablet", locale = "en-GB", colorScheme = "light" } = {}) {
  const context = await browser.newContext({ viewport: kSizes[size], locale, colorScheme, ignoreHTTPSErrors: true, hasTouch: size === "phone" });
  const page = await context.newPage();
  page.setDefaultTimeout(60000);
  page.wrong = [];
  page.on("pageerror", (error) => page.wrong.push(`exception: ${error.message}`));
  page.on("console", (message) => {
    // A refused login and a cut connection are what some tests are about.
    if (message.type() === "error" && !/WebSocket|Failed to load resource/.test(message.text())) page.wrong.push(message.text());
  });
  // Not a fault by itself: it explains one.
  page.on("requestfailed", (request) => console.log(`${request.method()} ${request.url()}: ${request.failure()?.errorText}`));
  return page;
}

export async function login(page, url, name = "anna", password = "a long word") {
  await page.goto(url);
  await page.fill("input[name=name]", name);
  await page.fill("input[name=password]", password);
  await page.click("button[type=submit]");
  await page.waitForSelector("nav.tabs");
}

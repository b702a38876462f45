// The page's TypeScript as a module for node: bundled by the esbuild that builds the page.
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const work = process.env.HUELINE_PAGE_WORK;
export const source = process.env.HUELINE_SOURCE;

/// load("link/decode.ts")
export async function load(file) {
  const esbuild = createRequire(pathToFileURL(path.join(work, "package.json")))("esbuild");
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "page-"));
  const outfile = path.join(folder, "module.mjs");
  await esbuild.build({ entryPoints: [path.join(work, "src", file)], bundle: true, format: "esm", platform: "node", outfile, logLevel: "warning" });
  const module = await import(pathToFileURL(outfile));
  fs.rmSync(folder, { recursive: true });
  return module;
}

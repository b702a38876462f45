// node read_e57.mjs FOLDER: web-e57 (the e57 crate for Rust) accepts the checksums and the description of cloud.e57, and finds every point of
// cloud.json in it with its place and colour. What it does not give out is read from the packets here: intensity, return and time.
import fs from "node:fs";
import path from "node:path";
import assert from "node:assert/strict";
import { createRequire } from "node:module";

// The package's own entry is for bundlers, which know how to import WebAssembly.
const folder_of_package = path.dirname(createRequire(import.meta.url).resolve("web-e57"));
const e57 = await import(path.join(folder_of_package, "e57_bg.js"));
const wasm = await WebAssembly.instantiate(fs.readFileSync(path.join(folder_of_package, "e57_bg.wasm")), { "./e57_bg.js": e57 });
e57.__wbg_set_wasm(wasm.instance.exports);

const folder = process.argv[2];
const wanted = JSON.parse(fs.readFileSync(path.join(folder, "cloud.json")));
const file = fs.readFileSync(path.join(folder, "cloud.e57"));
const lines = e57.convertE57(new Uint8Array(file), "XYZ").trim().split("\n");
assert.equal(lines.length, wanted.length);
for (let i = 0; i < wanted.length; i++) {
  const have = lines[i].split(" ").map(Number), want = wanted[i];
  for (const [at, key] of [[0, "X"], [1, "Y"], [2, "Z"]]) assert.ok(Math.abs(have[at] - want[key]) < 6e-4, `${key} of point ${i}: ${have[at]}, not ${want[key]}`);
  assert.deepEqual(have.slice(3, 6).map((c) => c * 257), [want.Red, want.Green, want.Blue], `colour of point ${i}`);
}
const damaged = Buffer.from(file);
damaged[5000] ^= 1;
let is_told = false;
try {
  is_told = e57.convertE57(new Uint8Array(damaged), "XYZ").trim().split("\n").length !== wanted.length;
} catch {
  is_told = true;
}
assert.ok(is_told, "a damaged page is noticed");

const xml = e57.convertE57(new Uint8Array(file), "XML");
const fields = [...xml.slice(xml.indexOf("<prototype"), xml.indexOf("</prototype>")).matchAll(/<(\w+) type="(Float|Integer)"(?: [^/]*maximum="(\d+)")?/g)];
const sizes = fields.map(([, , type, most]) => (type === "Float" ? 8 : most === "65535" ? 2 : 1));
const begin = Number(/<acquisitionStart[^]*?<dateTimeValue type="Float">([^<]*)/.exec(xml)[1]);
// The bytes without the pages' checksums.
const logical = Buffer.concat(Array.from({ length: file.length / 1024 }, (_, page) => file.subarray(page * 1024, page * 1024 + 1020)));
const columns = Object.fromEntries(fields.map(([, name]) => [name, []]));
for (let at = 80; logical[at] === 1; at += logical.readUInt16LE(at + 2) + 1) {
  let stream = at + 6 + 2 * fields.length;
  fields.forEach(([, name], k) => {
    const bytes = logical.readUInt16LE(at + 6 + 2 * k);
    for (let i = 0; i < bytes; i += sizes[k])
      columns[name].push(sizes[k] === 8 ? logical.readDoubleLE(stream + i) : sizes[k] === 2 ? logical.readUInt16LE(stream + i) : logical[stream + i]);
    stream += bytes;
  });
}
for (let i = 0; i < wanted.length; i++) {
  const want = wanted[i];
  assert.equal(columns.intensity[i], want.Intensity);
  assert.equal(columns.returnIndex[i] + 1, want.ReturnNumber);
  assert.equal(columns.returnCount[i], want.NumberOfReturns);
  assert.ok(Math.abs(begin + columns.timeStamp[i] - 1e9 - want.GpsTime) < 2e-6, `time of point ${i}`);
}
console.log(`cloud.e57: ${wanted.length} points with ${fields.length} fields`);

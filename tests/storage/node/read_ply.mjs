// node read_ply.mjs FOLDER: the loader of three.js finds every point of cloud.json in cloud.ply, with its colour and all its fields. It keeps
// numbers in single precision, so these are compared.
import fs from "node:fs";
import path from "node:path";
import assert from "node:assert/strict";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";

const folder = process.argv[2];
const wanted = JSON.parse(fs.readFileSync(path.join(folder, "cloud.json")));
const names = { intensity: "Intensity", return_number: "ReturnNumber", return_count: "NumberOfReturns", sensor: "PointSourceId", time: "GpsTime" };
const known = new Set(["X", "Y", "Z", "Red", "Green", "Blue", ...Object.values(names)]);
for (const key of Object.keys(wanted[0])) if (!known.has(key)) names[key] = key;

const loader = new PLYLoader();
loader.setCustomPropertyNameMapping(Object.fromEntries(Object.keys(names).map((name) => [`field_${name}`, [name]])));
const file = fs.readFileSync(path.join(folder, "cloud.ply"));
const cloud = loader.parse(file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength));
const place = cloud.getAttribute("position");
assert.equal(place.count, wanted.length);
assert.ok(Object.keys(names).length > 10, "the extra bytes are there");
for (let i = 0; i < wanted.length; i++) {
  const want = wanted[i];
  assert.ok(Math.abs(place.getX(i) - want.X) < 0.04 && Math.abs(place.getY(i) - want.Y) < 0.5 && Math.abs(place.getZ(i) - want.Z) < 1e-3, `place of point ${i}`);
  for (const [name, key] of Object.entries(names)) {
    const have = cloud.getAttribute(`field_${name}`).getX(i);
    assert.ok(Math.abs(have - Math.fround(want[key])) <= 1e-6 * Math.abs(want[key]), `${name} of point ${i}: ${have}, not ${want[key]}`);
  }
}
// The loader turns colours into linear light; the bytes themselves stand behind the three doubles of a place.
const begin = file.indexOf("end_header\n") + 11;
const size = (file.length - begin) / wanted.length;
assert.equal(size % 1, 0);
for (let i = 0; i < wanted.length; i++) {
  const at = begin + i * size;
  assert.deepEqual([...file.subarray(at + 24, at + 27)].map((c) => c * 257), [wanted[i].Red, wanted[i].Green, wanted[i].Blue], `colour of point ${i}`);
  assert.ok(Math.abs(file.readDoubleLE(at + 8) - wanted[i].Y) < 6e-4, `northing of point ${i}`);
}
console.log(`cloud.ply: ${wanted.length} points with ${Object.keys(names).length + 6} fields`);

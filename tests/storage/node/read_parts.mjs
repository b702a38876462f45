// node read_parts.mjs FOLDER: laz-perf unpacks the tiles of cloud.las in parts/. Together they have each of its records once, and the index
// names each of them with its number of points.
import fs from "node:fs";
import path from "node:path";
import assert from "node:assert/strict";
import copc from "copc";
import { createLazPerf } from "laz-perf";

const folder = process.argv[2];
const las = fs.readFileSync(path.join(folder, "cloud.las"));
const header = copc.Las.Header.parse(new Uint8Array(las.subarray(0, 375)));
const size = header.pointDataRecordLength;
const wanted = new Set();
for (let i = 0; i < header.pointCount; i++) wanted.add(las.toString("latin1", header.pointDataOffset + i * size, header.pointDataOffset + (i + 1) * size));
assert.equal(wanted.size, header.pointCount, "the records tell the points apart");

const lazPerf = await createLazPerf();
const index = JSON.parse(fs.readFileSync(path.join(folder, "parts", "index.geojson")));
assert.ok(index.features.length > 10, "several tiles");
assert.equal(index.features.length, fs.readdirSync(path.join(folder, "parts")).length - 1);
for (const { properties } of index.features) {
  const laz = fs.readFileSync(path.join(folder, "parts", properties.file));
  const bytes = lazPerf._malloc(laz.length);
  lazPerf.HEAPU8.set(laz, bytes);
  const unpacker = new lazPerf.LASZip();
  unpacker.open(bytes, laz.length);
  assert.equal(unpacker.getCount(), properties.points, properties.file);
  const record = lazPerf._malloc(size);
  for (let i = 0; i < properties.points; i++) {
    unpacker.getPoint(record);
    assert.ok(wanted.delete(Buffer.from(lazPerf.HEAPU8.subarray(record, record + size)).toString("latin1")), `point ${i} of ${properties.file}`);
  }
  unpacker.delete();
  lazPerf._free(record);
  lazPerf._free(bytes);
}
assert.equal(wanted.size, 0, "every point is in a tile");
console.log(`${index.features.length} tiles: ${header.pointCount} points`);

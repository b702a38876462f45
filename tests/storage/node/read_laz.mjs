// node read_laz.mjs FOLDER: laz-perf unpacks cloud.laz, and each of its records has the bytes of the record in cloud.las; the same of old.laz,
// which has an older point format. The module copc reads the same file's header and records.
import fs from "node:fs";
import path from "node:path";
import assert from "node:assert/strict";
import copc from "copc";
import { createLazPerf } from "laz-perf";

const folder = process.argv[2];
const lazPerf = await createLazPerf();

for (const [name, of, format] of [["cloud.laz", "cloud.las", 7], ["cloud_live.laz", "cloud.las", 7], ["old.laz", "old.las", 3]]) {
  const las = fs.readFileSync(path.join(folder, of));
  const header = copc.Las.Header.parse(new Uint8Array(las.subarray(0, 375)));
  const laz = fs.readFileSync(path.join(folder, name));
  const lazHeader = copc.Las.Header.parse(new Uint8Array(laz.subarray(0, 375)));
  for (const key of ["pointCount", "pointDataRecordFormat", "pointDataRecordLength", "scale", "offset", "min", "max", "pointCountByReturn"])
    assert.deepEqual(lazHeader[key], header[key], `${key} of ${name}`);
  const vlrs = await copc.Las.Vlr.walk(async (begin, end) => new Uint8Array(laz.subarray(begin, end)), lazHeader);
  assert.ok(copc.Las.Vlr.find(vlrs, "laszip encoded", 22204), "the record of LASzip");

  const bytes = lazPerf._malloc(laz.length);
  lazPerf.HEAPU8.set(laz, bytes);
  const unpacker = new lazPerf.LASZip();
  unpacker.open(bytes, laz.length);
  assert.equal(unpacker.getCount(), header.pointCount);
  assert.equal(unpacker.getPointLength(), header.pointDataRecordLength);
  assert.equal(unpacker.getPointFormat(), format);
  const size = header.pointDataRecordLength;
  const record = lazPerf._malloc(size);
  for (let i = 0; i < header.pointCount; i++) {
    unpacker.getPoint(record);
    const at = header.pointDataOffset + i * size;
    assert.ok(las.subarray(at, at + size).equals(lazPerf.HEAPU8.subarray(record, record + size)), `point ${i} of ${name}`);
  }
  unpacker.delete();
  lazPerf._free(record);
  lazPerf._free(bytes);
  assert.ok(laz.length < 0.6 * las.length + 65536, "it is compressed");
  console.log(`${name}: ${header.pointCount} points, ${(laz.length / las.length).toFixed(3)} of the size of LAS`);
}

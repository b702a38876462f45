// node read_cloud.mjs FOLDER: the Las module of the package copc reads every point of the sample cloud as it was written.
import fs from "node:fs";
import path from "node:path";
import assert from "node:assert/strict";
import copc from "copc";

const { Las } = copc;
const folder = process.argv[2];
const bytes = fs.readFileSync(path.join(folder, "cloud.las"));
const expected = JSON.parse(fs.readFileSync(path.join(folder, "cloud.json"), "utf8"));
const get = async (begin, end) => new Uint8Array(bytes.subarray(begin, end));

const header = Las.Header.parse(new Uint8Array(bytes.subarray(0, 375)));
assert.deepEqual([header.majorVersion, header.minorVersion, header.pointDataRecordFormat], [1, 4, 7]);
assert.equal(header.globalEncoding, 0x11, "adjusted standard GPS time, WKT");
assert.deepEqual(header.scale, [0.001, 0.001, 0.001]);
assert.deepEqual([header.fileCreationYear, header.fileCreationDayOfYear], [2026, 60]);
assert.equal(header.pointCount, expected.length);
for (let n = 1; n <= 15; n++)
  assert.equal(header.pointCountByReturn[n - 1], expected.filter((p) => p.ReturnNumber === n).length, `returns ${n}`);

const vlrs = await Las.Vlr.walk(get, header);
const wkt = Buffer.from(await Las.Vlr.fetch(get, Las.Vlr.at(vlrs, "LASF_Projection", 2112))).toString();
assert.match(wkt, /UTM zone 32N/);
const extra = Las.ExtraBytes.parse(await Las.Vlr.fetch(get, Las.Vlr.at(vlrs, "LASF_Spec", 4)));

const end = header.pointDataOffset + header.pointCount * header.pointDataRecordLength;
assert.equal(end, bytes.length, "nothing but points behind the records");
const view = Las.View.create(new Uint8Array(bytes.subarray(header.pointDataOffset, end)), header, extra);
const tolerance = { X: 0.00051, Y: 0.00051, Z: 0.00051, GpsTime: 2e-7 };
for (const name of Object.keys(expected[0])) {
  const value = view.getter(name);
  expected.forEach((point, i) => {
    const difference = Math.abs(value(i) - point[name]);
    assert.ok(difference <= (tolerance[name] ?? 1e-6), `${name} of point ${i}: ${value(i)}, written ${point[name]}`);
  });
}
["X", "Y", "Z"].forEach((name, k) => {
  const values = expected.map((p) => p[name]);
  assert.ok(Math.abs(header.min[k] - values.reduce((a, b) => Math.min(a, b))) < 0.00051, `least ${name}`);
  assert.ok(Math.abs(header.max[k] - values.reduce((a, b) => Math.max(a, b))) < 0.00051, `greatest ${name}`);
});
console.log(`cloud.las: ${view.pointCount} points, ${Object.keys(view.dimensions).length} dimensions`);

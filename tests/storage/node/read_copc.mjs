// node read_copc.mjs FOLDER: the package copc finds every point of cloud.las once in cloud.copc.laz, and in
// cloud_live.copc.laz, which was written while the points came; each in a node whose cube contains it.
import fs from "node:fs";
import path from "node:path";
import assert from "node:assert/strict";
import copc from "copc";

const { Copc, Key, Bounds, Las } = copc;
const folder = process.argv[2];
const las = fs.readFileSync(path.join(folder, "cloud.las"));
const lasGet = async (begin, end) => new Uint8Array(las.subarray(begin, end));

const lasHeader = Las.Header.parse(new Uint8Array(las.subarray(0, 375)));
const extra = Las.ExtraBytes.parse(await Las.Vlr.fetch(lasGet, Las.Vlr.at(await Las.Vlr.walk(lasGet, lasHeader), "LASF_Spec", 4)));
const end = lasHeader.pointDataOffset + lasHeader.pointCount * lasHeader.pointDataRecordLength;
const wanted = Las.View.create(new Uint8Array(las.subarray(lasHeader.pointDataOffset, end)), lasHeader, extra);

const times = wanted.getter("GpsTime");
const byTime = new Map();
for (let i = 0; i < wanted.pointCount; i++) byTime.set(times(i), i);
assert.equal(byTime.size, wanted.pointCount, "the times tell the points apart");
for (const file of ["cloud.copc.laz", "cloud_live.copc.laz"]) {
  const bytes = fs.readFileSync(path.join(folder, file));
  const get = async (begin, end) => new Uint8Array(bytes.subarray(begin, end));
  const cloud = await Copc.create(get);
  assert.equal(cloud.header.pointCount, lasHeader.pointCount);
  assert.deepEqual(cloud.header.pointCountByReturn, lasHeader.pointCountByReturn);
  assert.match(cloud.wkt, /UTM zone 32N/);
  assert.deepEqual(cloud.info.gpsTimeRange, [times(0), times(wanted.pointCount - 1)]);

  const nodes = {};
  let pages = [cloud.info.rootHierarchyPage];
  for (let n = 0; n < pages.length; n++) {
    const page = await Copc.loadHierarchyPage(get, pages[n]);
    Object.assign(nodes, page.nodes);
    pages.push(...Object.values(page.pages));
  }
  assert.ok(pages.length > 1, "the hierarchy has several pages");
  assert.ok(Object.keys(nodes).length > 100, "the octree has many nodes");

  const seen = new Set();
  let deepest = 0;
  for (const [name, node] of Object.entries(nodes)) {
    const key = Key.create(name);
    deepest = Math.max(deepest, key[0]);
    if (key[0] > 0) assert.ok(nodes[Key.toString([key[0] - 1, key[1] >> 1, key[2] >> 1, key[3] >> 1])], `${name} has its parent`);
    if (node.pointCount === 0) continue;
    assert.ok(node.pointCount <= 2 * 200, `${name} has ${node.pointCount} points`);
    const view = await Copc.loadPointDataView(get, cloud, node);
    assert.equal(view.pointCount, node.pointCount);
    assert.deepEqual(Object.keys(view.dimensions), Object.keys(wanted.dimensions));
    const bounds = Bounds.stepTo(cloud.info.cube, key);
    const getters = Object.keys(view.dimensions).map((d) => [d, view.getter(d), wanted.getter(d)]);
    const place = ["X", "Y", "Z"].map((d) => view.getter(d));
    for (let i = 0; i < view.pointCount; i++) {
      const index = byTime.get(view.getter("GpsTime")(i));
      assert.ok(index !== undefined && !seen.has(index), `a point of ${name} that is in the cloud once`);
      seen.add(index);
      for (const [d, have, want] of getters) assert.equal(have(i), want(index), `${d} of point ${index}`);
      place.forEach((value, k) => assert.ok(value(i) >= bounds[k] - 1e-6 && value(i) <= bounds[k + 3] + 1e-6, `${name} contains its points`));
    }
  }
  assert.equal(seen.size, wanted.pointCount, "every point is in a node");
  console.log(`${file}: ${seen.size} points in ${Object.keys(nodes).length} nodes of ${deepest + 1} levels, ${pages.length} pages`);
}

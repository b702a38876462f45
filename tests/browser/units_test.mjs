// What the page makes of bytes and numbers, without a browser: messages as protobufjs encodes them, damaged messages, the store of points, the
// level of detail, the map, and the catalogue of words.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import test from "node:test";
import { load, source } from "./load.mjs";
import { loadSchemas } from "./mock_schemas.mjs";
import { kFields, kStride, pointsAt } from "./mock_street.mjs";

const schemas = loadSchemas(path.join(source, "storage/proto"));
const { decoderOf } = await load("link/decode.ts");
const { readPoints } = await load("link/point_message.ts");
const channel = (topic, name) => ({ id: 1, topic, encoding: "protobuf", schemaName: name, schema: schemas.base64(name) });
const encode = (name, json) => {
  const type = schemas.type(name);
  return type.encode(type.fromObject(json)).finish();
};
let seed = 1;
const random = () => (seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0) / 4294967296;

test("a cloud of protobufjs is read to the byte", () => {
  const data = pointsAt(3, 500, 0.9);
  const message = decoderOf(channel("/cloud", "foxglove.PointCloud"))(
    encode("foxglove.PointCloud", { timestamp: { seconds: 1e9, nanos: 5 }, frameId: "enu", pointStride: kStride, fields: kFields, data }));
  assert.equal(message.frameId, "enu");
  assert.equal(message.pointStride, kStride);
  assert.equal(message.timestamp.seconds, 1000000000n);
  const points = readPoints(message);
  assert.equal(points.count, 500);
  assert.deepEqual([...points.has].sort(), ["exposure", "intensity", "moving", "sigma"]);
  for (let i = 0; i < 500; ++i) {
    const at = i * kStride;
    assert.equal(points.place[3 * i + 1], data.readFloatLE(at + 4));
    assert.deepEqual([...points.colour.subarray(4 * i, 4 * i + 4)], [data[at + 12], data[at + 13], data[at + 14], data[at + 17]]);
    assert.deepEqual([...points.extra.subarray(4 * i, 4 * i + 2)], [data[at + 16], data[at + 18]]);
    const exposure = data.readUInt32LE(at + 23);
    assert.equal(points.extra[4 * i + 3], exposure === 0xffffffff ? 0 : 1 + (exposure % 255));
  }
});

test("a cloud with fewer fields, and one in another order", () => {
  const fields = [{ name: "z", offset: 0, type: 7 }, { name: "y", offset: 4, type: 7 }, { name: "x", offset: 8, type: 7 }];
  const data = Buffer.alloc(12);
  [3, 2, 1].forEach((value, i) => data.writeFloatLE(value, 4 * i));
  const points = readPoints({ frameId: "enu", pointStride: 12, fields, data });
  assert.deepEqual([...points.place], [1, 2, 3]);
  assert.deepEqual([...points.colour], [0, 0, 0, 255]);
  assert.equal(points.has.size, 0);
});

test("points that are nowhere are left out", () => {
  const data = pointsAt(0, 3);
  data.writeFloatLE(NaN, kStride);
  data.writeFloatLE(Infinity, 2 * kStride + 8);
  assert.equal(readPoints({ frameId: "enu", pointStride: kStride, fields: kFields, data }).count, 1);
});

test("a cloud that contradicts itself is refused with the reason", () => {
  const good = { frameId: "enu", pointStride: kStride, fields: kFields, data: pointsAt(0, 2) };
  const wrong = [
    [{ pointStride: 4 }, /4 bytes/],
    [{ data: good.data.subarray(1) }, /no whole points/],
    [{ fields: kFields.filter((one) => one.name !== "y") }, /missing/],
    [{ fields: kFields.map((one) => (one.name === "z" ? { ...one, type: 8 } : one)) }, /type 8/],
    [{ fields: kFields.map((one) => (one.name === "z" ? { ...one, offset: 24 } : one)) }, /behind/],
  ];
  for (const [change, why] of wrong) assert.throws(() => readPoints({ ...good, ...change }), why);
});

test("damaged bytes of every message end in an error or a message, never in a hang", () => {
  for (const [name, json] of [
    ["foxglove.PointCloud", { pointStride: kStride, fields: kFields, data: pointsAt(0, 20) }],
    ["foxglove.PoseInFrame", { frameId: "enu", pose: { position: { x: 1, y: 2, z: 3 }, orientation: { w: 1 } } }],
    ["foxglove.CompressedImage", { format: "jpeg", data: Buffer.alloc(50), frameId: "head" }],
    ["foxglove.Log", { level: 3, message: "x", name: "laser" }],
  ]) {
    const decode = decoderOf(channel("/x", name));
    const good = Buffer.from(encode(name, json));
    let refused = 0;
    for (let round = 0; round < 3000; ++round) {
      let bytes = Buffer.from(good);
      if (random() < 0.3) bytes = bytes.subarray(0, Math.floor(random() * bytes.length));
      for (let n = 1 + Math.floor(random() * 4); n > 0 && bytes.length > 0; --n) bytes[Math.floor(random() * bytes.length)] = Math.floor(random() * 256);
      try {
        const message = decode(bytes);
        if (name === "foxglove.PointCloud") readPoints(message);
      } catch (error) {
        ++refused;
        assert.ok(error instanceof Error && error.message.length > 0);
      }
    }
    assert.ok(refused > 0, `${name}: no damage was noticed`);
  }
});

test("a channel that cannot be read names its topic", () => {
  assert.throws(() => decoderOf({ ...channel("/y", "foxglove.Log"), schemaName: "foxglove.Other" }), /\/y/);
  assert.throws(() => decoderOf({ ...channel("/y", "foxglove.Log"), encoding: "cdr" }), /\/y.*cdr/);
  const json = decoderOf({ id: 1, topic: "/j", encoding: "json", schemaName: "", schema: "{}" });
  assert.deepEqual(json(Buffer.from('{"a":1}')), { a: 1 });
  assert.throws(() => json(Buffer.from([0x22, 0xff, 0xfe, 0x22])), "bytes that are no UTF-8");
  assert.throws(() => json(Buffer.alloc((1 << 20) + 1, 0x20)), /\/j/);
});

const { PointRing, kBlockPoints } = await load("cloud/point_ring.ts");
const made = (from, count) => {
  const points = { count, place: new Float32Array(3 * count), colour: new Uint8Array(4 * count), extra: new Uint8Array(4 * count) };
  for (let i = 0; i < count; ++i) {
    points.place.set([from + i, 1, 2], 3 * i);
    new DataView(points.colour.buffer).setUint32(4 * i, from + i, true);
    new DataView(points.extra.buffer).setUint32(4 * i, from + i, true);
  }
  return points;
};

test("the store of points is bounded, keeps the newest, and keeps each point's values together", () => {
  const ring = new PointRing(4 * kBlockPoints);
  let given = 0;
  for (const count of [1, 1000, 65535, 65536, 65537, 200000, 7, 100000]) {
    ring.append(made(given, count));
    given += count;
    assert.ok(ring.count <= ring.capacity);
    assert.equal(ring.count + ring.dropped, given);
  }
  assert.equal(ring.blocks.length, 4);
  const seen = new Set();
  for (const block of ring.blocks) {
    const colour = new DataView(block.colour.buffer), extra = new DataView(block.extra.buffer);
    for (let i = 0; i < block.count; ++i) {
      const id = block.place[3 * i];
      assert.equal(colour.getUint32(4 * i, true), id);
      assert.equal(extra.getUint32(4 * i, true), id);
      assert.ok(id >= block.least[0] && id <= block.most[0]);
      seen.add(id);
    }
  }
  assert.equal(seen.size, ring.count, "no point is there twice");
  assert.equal(Math.max(...ring.blocks.map((one) => one.most[0])), given - 1);
  assert.equal(Math.min(...ring.blocks.map((one) => one.least[0])), ring.dropped, "the oldest went first");
});

test("only new points are uploaded; a block is uploaded once more when it is full", () => {
  const ring = new PointRing(4 * kBlockPoints);
  ring.append(made(0, 1000));
  ring.blocks[0].dirtyFrom = ring.blocks[0].count; // as the scene does after an upload
  ring.append(made(1000, 500));
  assert.equal(ring.blocks[0].dirtyFrom, 1000);
  ring.append(made(1500, kBlockPoints));
  assert.equal(ring.blocks[0].dirtyFrom, 0);
  assert.ok(ring.blocks[0].isShuffled);
  const first = ring.blocks[0].place[0], order = Array.from({ length: 50 }, (_, i) => ring.blocks[0].place[3 * i]);
  assert.ok(order.some((one, i) => one !== first + i), "the points of a full block stand in random order");
  const mean = order.reduce((a, b) => a + b) / order.length;
  assert.ok(mean > 0.25 * kBlockPoints && mean < 0.75 * kBlockPoints, "its first points are a sample of all");
});

test("a smaller store drops the oldest at once, and grows again", () => {
  const ring = new PointRing(4 * kBlockPoints);
  ring.append(made(0, 6 * kBlockPoints));
  ring.resize(2 * kBlockPoints);
  assert.deepEqual(ring.blocks.map((one) => one.least[0]), [4 * kBlockPoints, 5 * kBlockPoints]);
  ring.resize(3 * kBlockPoints);
  ring.append(made(6 * kBlockPoints, 10));
  assert.equal(ring.count, 2 * kBlockPoints + 10);
  ring.clear();
  assert.equal(ring.count, 0);
});

const { nearFor, pointsDrawn, Budget } = await load("cloud/detail.ts");
test("the level of detail keeps its budget and thins what is far first", () => {
  const blocks = [0, 10, 50, 200, 800].map((distance) => ({ block: { count: kBlockPoints, isShuffled: true }, distance }));
  for (const budget of [1e5, 1.5e5, 2e5, 1e7]) {
    const near = nearFor(budget, blocks);
    const drawn = blocks.map(({ block, distance }) => pointsDrawn(block, distance, near));
    assert.ok(drawn.reduce((a, b) => a + b) <= Math.max(budget, kBlockPoints * 1.2));
    assert.equal(drawn[0], kBlockPoints);
    for (let i = 1; i < drawn.length; ++i) assert.ok(drawn[i] <= drawn[i - 1] && drawn[i] > 0);
  }
  const slow = new Budget(40), fast = new Budget(40);
  const before = slow.points;
  for (let i = 0; i < 50; ++i) slow.frame(400), fast.frame(16);
  assert.ok(slow.points < before && slow.points > 0);
  assert.ok(fast.points > before);
});

const { kindOf, isWeak, lengths, roundStep, whole } = await load("map/drive_map.ts");
test("the map tells driven, pale, hole and weak apart, and sums their lengths", () => {
  const second = (i, points, coloured, fix) => [i, 10 * i, 0, points, coloured, 0.02, fix];
  const drive = [second(0, 100, 90, "RtkFixed"), second(1, 100, 90, "RtkFixed"), second(2, 0, 0, "Single"), second(3, 100, 10, null), second(4, 100, 100, "RtkFloat")];
  assert.deepEqual(drive.map(kindOf), ["coloured", "coloured", "hole", "pale", "coloured"]);
  assert.deepEqual(drive.map(isWeak), [false, false, true, false, true]);
  assert.deepEqual(lengths(drive), { coloured: 20, pale: 10, hole: 10, weak: 20, all: 40 });
  drive.push([5, 5000, 0, 1, 1, null, null]);
  assert.equal(lengths(drive).all, 40, "a jump is not driven");
  const sight = whole(drive, 800, 600);
  for (const [, east, north] of drive) {
    assert.ok(Math.abs((east - sight.east) * sight.scale) < 400 && Math.abs((north - sight.north) * sight.scale) < 300);
  }
  for (const [most, step] of [[9, 5], [10, 10], [0.3, 0.2], [4999, 2000]]) assert.ok(Math.abs(roundStep(most) / step - 1) < 1e-9);
});

const { LocalPlane, toWebMercator, fromWebMercator } = await load("map/earth.ts");
const { tilesOf } = await load("map/tiles.ts");
test("places in degrees and in metres of a drive are those of PROJ", () => {
  // cct -d 6 +proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84
  //   +step +proj=topocentric +ellps=WGS84 +lon_0=11.5 +lat_0=48.1 +h_0=520
  for (const [origin, place, east, north] of [
    [[48.1, 11.5], [48.2, 11.6], 7434.247243, 11125.05469],
    [[48.1, 11.5], [48.09, 11.49], -745.01527, -1111.964063],
    [[-33.5, -70.3], [-33.4, -70.2], 9303.677571, 11087.669936],
  ]) {
    const plane = new LocalPlane({ latitude_deg: origin[0], longitude_deg: origin[1], height_m: 520 });
    const there = plane.local({ latitude_deg: place[0], longitude_deg: place[1] });
    assert.ok(Math.abs(there.east - east) < 1e-4 && Math.abs(there.north - north) < 1e-4, JSON.stringify(there));
    const back = plane.place(east, north);
    assert.ok(Math.abs(back.latitude_deg - place[0]) < 1e-9 && Math.abs(back.longitude_deg - place[1]) < 1e-9, JSON.stringify(back));
  }
  // The example of EPSG's guidance note 7-2 for EPSG:3857.
  const world = 2 * Math.PI * 6378137, { x, y } = toWebMercator({ latitude_deg: 24 + 22 / 60 + 54.433 / 3600, longitude_deg: -(100 + 20 / 60) });
  assert.ok(Math.abs((x - 0.5) * world - -11169055.58) < 0.01 && Math.abs((0.5 - y) * world - 2800000) < 0.01);
  assert.ok(Math.abs(fromWebMercator(x, y).latitude_deg - (24 + 22 / 60 + 54.433 / 3600)) < 1e-9);
});

test("the tiles of a sight cover it, at the zoom that fits, and are never too many", () => {
  const plane = new LocalPlane({ latitude_deg: 48.1, longitude_deg: 11.5, height_m: 520 });
  const set = { least_zoom: 12, most_zoom: 19, attribution: "" };
  const at = (scale, of = set) => tilesOf(plane, { east: 100, north: -50, scale }, 1280, 800, 1, of);
  for (const scale of [0.05, 0.5, 2, 20]) {
    const tiles = at(scale);
    assert.ok(tiles.length >= 1 && tiles.length <= 60, `${scale}: ${tiles.length}`);
    const { zoom } = tiles[0];
    const pixel_m = (156543.034 * Math.cos((48.1 * Math.PI) / 180)) / 2 ** zoom;
    assert.ok(zoom === 19 || Math.abs(Math.log2(pixel_m * scale)) <= 0.51, `${scale}: zoom ${zoom}`);
    for (const [dx, dy] of [[-639, -399], [639, -399], [639, 399], [-639, 399], [0, 0]]) {
      const { x, y } = toWebMercator(plane.place(100 + dx / scale, -50 + dy / scale));
      assert.ok(tiles.some((one) => one.x === Math.floor(x * 2 ** zoom) && one.y === Math.floor(y * 2 ** zoom)), `${scale}: ${dx} ${dy}`);
    }
  }
  assert.deepEqual(at(0.0005), [], "a country of street maps is not loaded");
  assert.equal(at(20, { ...set, most_zoom: 14 })[0].zoom, 14, "what is coarser than the screen is enlarged");
  const pacific = new LocalPlane({ latitude_deg: -17, longitude_deg: 179.999, height_m: 0 });
  const columns = new Set(tilesOf(pacific, { east: 0, north: 0, scale: 1 }, 1280, 800, 1, set).map((one) => one.x));
  assert.ok(columns.has(0) && columns.has(2 ** 17 - 1), "the world goes on behind the antimeridian");
});

const { Frames, rigid, compose, inverse } = await load("images/frames.ts");
const { drawSeen, overlay, project } = await load("images/project.ts");
const half = Math.SQRT1_2;
const pinhole = { frame: "lens/front", width: 1000, height: 800, isFisheye: false, D: [], fx: 500, fy: 500, cx: 500, cy: 400 };

test("laser points are drawn where the lens saw them", () => {
  const frames = new Frames();
  // The head is 2 m above the body, its lens looks ahead: body y is the lens's z, body x its x, body z is up.
  frames.mount("body", "head", rigid({ x: 0, y: 0, z: 0, w: 1 }, { x: 0, y: 0, z: 2 }));
  frames.mount("head", "lens/front", rigid({ x: -half, y: 0, z: 0, w: half }, { x: 0, y: 0.1, z: 0 }));
  // The vehicle drives east at 10 m/s: turned by 90 degrees clockwise.
  const east = { x: 0, y: 0, z: -half, w: half };
  frames.pose(1_000_000_000n, east, { x: 100, y: 50, z: 0 });
  frames.pose(1_100_000_000n, east, { x: 101, y: 50, z: 0 });
  const T = inverse(compose(frames.bodyAt(1_050_000_000n), frames.onBody("lens/front")));
  // 10 m ahead of the lens, 1 m to the right (south), 0.5 m above it.
  const seen = overlay(new Float32Array([100.5 + 0.1 + 10, 49, 2.5]), [{ model: pinhole, T_lens_enu: T }], 100);
  assert.equal(seen.length, 3);
  assert.ok(Math.abs(seen[0] - 550) < 1e-3 && Math.abs(seen[1] - 375) < 1e-3, String(seen));
  assert.ok(Math.abs(seen[2] - Math.hypot(10, 1, 0.5)) < 1e-4);
  assert.equal(overlay(new Float32Array([90, 50, 2]), [{ model: pinhole, T_lens_enu: T }], 100).length, 0, "what is behind is not seen");
  const hidden = overlay(new Float32Array([110.6, 50, 2, 130.6, 50, 2]), [{ model: pinhole, T_lens_enu: T }], 100);
  assert.equal(hidden.length, 3, "what is behind something is not drawn");
  assert.equal(frames.bodyAt(2_000_000_000n), undefined);
  assert.equal(frames.bodyAt(900_000_000n), undefined);
  assert.equal(frames.onBody("lens/other"), undefined);
  frames.mount("a", "b", rigid(east, { x: 0, y: 0, z: 0 }));
  frames.mount("b", "a", rigid(east, { x: 0, y: 0, z: 0 }));
  assert.equal(frames.onBody("a"), undefined, "a ring of frames ends");
});

test("distortion follows OpenCV's formulas and does not fold points back", () => {
  // Worked by hand for x' = 0.2, y' = 0.1: r2 = 0.05.
  const D = [0.1, 0.01, 0.001, 0.002, 0.0005];
  const radial = 1 + 0.1 * 0.05 + 0.01 * 0.0025 + 0.0005 * 0.000125;
  const [u, v] = project({ ...pinhole, D }, 0.2, 0.1, 1);
  assert.ok(Math.abs(u - (500 * (0.2 * radial + 2 * 0.001 * 0.02 + 0.002 * (0.05 + 0.08)) + 500)) < 1e-9);
  assert.ok(Math.abs(v - (500 * (0.1 * radial + 0.001 * (0.05 + 0.02) + 2 * 0.002 * 0.02) + 400)) < 1e-9);
  assert.equal(project({ ...pinhole, D: [-0.5] }, 1, 0, 1), undefined);
  const fisheye = { ...pinhole, isFisheye: true, D: [0.02, 0, 0, 0] };
  const a = Math.PI / 4;
  assert.ok(Math.abs(project(fisheye, 1, 0, 1)[0] - (500 * (a + 0.02 * a ** 3) + 500)) < 1e-9);
  assert.ok(project(fisheye, 1, 0, -0.05), "a fisheye sees beyond 90 degrees");
  assert.deepEqual(project(fisheye, 0, 0, 1), [500, 400]);
  assert.equal(project(fisheye, 0, 1, -5), undefined);
});

test("a pixel of an image that lenses share belongs to one lens", () => {
  const T = rigid({ x: 0, y: 0, z: 0, w: 1 }, { x: 0, y: 0, z: 0 });
  const left = { ...pinhole, cx: 250 }, right = { ...pinhole, cx: 750 };
  const seen = overlay(new Float32Array([2, 0, 5]), [{ model: left, T_lens_enu: T }, { model: right, T_lens_enu: T }], 100);
  assert.deepEqual([seen[0], seen[3], seen.length], [450, 950, 6]);
  assert.equal(overlay(new Float32Array([3, 0, 5]), [{ model: left, T_lens_enu: T }, { model: right, T_lens_enu: T }], 100).length, 0);
});

test("of too many points an image shows as many as it may, all over it", () => {
  const T = rigid({ x: 0, y: 0, z: 0, w: 1 }, { x: 0, y: 0, z: 0 });
  const places = new Float32Array(3 * 5000);
  for (let i = 0; i < 5000; ++i) places.set([i / 500 - 5, (i % 71) / 15 - 2.3, 6], 3 * i);
  const all = overlay(places, [{ model: pinhole, T_lens_enu: T }], 1e6);
  for (const most of [1, 7, 1000, 4000]) {
    const seen = overlay(places, [{ model: pinhole, T_lens_enu: T }], most);
    assert.equal(seen.length, 3 * most);
    if (most < 1000) continue;
    const columns = (points) => new Set([...points].filter((_, i) => i % 3 === 0).map((u) => Math.floor(u / 50)));
    assert.deepEqual(columns(seen), columns(all));
  }
});

test("points are drawn as squares, red near and blue far, and nothing is drawn beside the image", () => {
  const pixels = new Uint32Array(20 * 10);
  drawSeen(new Float32Array([4, 4, 1.5, 15, 8, 70, 0, 0, 5, 20, 10, 5, -3, 4, 5]), pixels, 20, 10);
  const at = (u, v) => [...new Uint8Array(pixels.buffer, 4 * (20 * v + u), 4)];
  const near = at(4, 4), far = at(15, 8);
  assert.ok(near[0] > 240 && near[2] < 40 && near[3] === 255, String(near));
  assert.ok(far[2] > 240 && far[0] < 40 && far[3] === 255, String(far));
  assert.deepEqual(at(10, 5), [0, 0, 0, 0]);
  assert.equal(pixels.filter((one) => one !== 0).length, 4 + 4 + 1 + 1, "squares of two pixels, cut at the edges");
});

const { catalogue } = await load("words/catalogue.ts");
const code = fs.readdirSync(path.join(source, "console/web/src"), { recursive: true })
  .filter((file) => /\.tsx?$/.test(file) && !file.endsWith("catalogue.ts"))
  .map((file) => fs.readFileSync(path.join(source, "console/web/src", file), "utf8")).join("\n");
const header = (file) => fs.readFileSync(path.join(source, file), "utf8");

test("every word is there in both languages, with the same values", () => {
  for (const [key, [english, chinese]] of Object.entries(catalogue)) {
    assert.ok(english.trim() && chinese.trim(), `${key} is empty`);
    const values = (text) => (text.match(/\{\w+\}/g) ?? []).sort();
    assert.deepEqual(values(chinese), values(english), key);
    const same = new Set(["app.title", "role.pos", "fix.Ppp", "drive.speed", "bar.language"]);
    if (!same.has(key)) assert.match(chinese, /\p{Script=Han}/u, `${key} is not translated`);
    if (key !== "bar.language") assert.doesNotMatch(english, /\p{Script=Han}/u, key);
  }
});

test("every word is used, and every word that is used is there", () => {
  // Words of a group are asked for by what the server names: known("trouble", ...), or t(`tab.${name}`).
  const groups = new Set([...code.matchAll(/known\("(\w+)"/g), ...code.matchAll(/`(\w+(?:\.\w+)*)\.\$\{/g)].map(([, group]) => group));
  for (const key of Object.keys(catalogue)) {
    const isInGroup = [...groups].some((group) => key.startsWith(`${group}.`));
    assert.ok(isInGroup || code.includes(`"${key}"`), `${key} is used nowhere`);
  }
  for (const [, key] of code.matchAll(/\bt\("([\w.]+)"/g)) assert.ok(key in catalogue, `${key} is missing`);
});

test("no word stands in the code outside the catalogue", () => {
  // Text between tags, and texts of attributes that are read out.
  const outside = [...code.matchAll(/>\s*([A-Za-z][a-z]{2,}[^<>{}=;()]*)<\/[a-z]/g)].map(([, text]) => text.trim());
  assert.deepEqual(outside, []);
  assert.deepEqual([...code.matchAll(/(?:aria-label|title|alt|placeholder)="([^"]+)"/g)].map(([, text]) => text), []);
});

test("the page knows every trouble, clock state and kind of fix of the program", () => {
  const words = (text, from, to) => text.slice(text.indexOf(from), text.indexOf(to, text.indexOf(from)));
  const names = words(header("runtime/health.cpp"), "const char* name(Trouble", "\n}\n");
  const troubles = [...names.matchAll(/"(\w+)"/g)].map(([, word]) => word).filter((word) => word !== "?");
  assert.ok(troubles.length >= 20, `${troubles.length} troubles were found in runtime/health.cpp`);
  for (const word of troubles) {
    assert.ok(`trouble.${word}` in catalogue, `trouble.${word}`);
    assert.ok(`todo.${word}` in catalogue, `todo.${word}`);
  }
});

// The words follow the language of the page, so they ask the browser for it.
Object.defineProperties(globalThis, {
  document: { value: { documentElement: { dataset: {} } } },
  navigator: { value: { language: "en-GB" }, configurable: true },
  matchMedia: { value: () => ({ matches: false }) },
});
const { formatTime, formatLength, formatDriveTime, formatCount, formatBytes } = await load("words/words.ts");
test("figures are short and have their units", () => {
  assert.deepEqual([2.1e-6, 0.0123, 3, 14, 200, 14615, null, 0].map(formatTime), ["2.1 µs", "12 ms", "3.0 s", "14 s", "3 min", "4 h 04 min", "–", "0 s"]);
  assert.deepEqual([0.0021, 0.018, 0.3, 1.5, 98.7, 24100].map(formatLength), ["2.1 mm", "1.8 cm", "30 cm", "1.5 m", "99 m", "24.1 km"]);
  assert.deepEqual([0, 61, 3605].map(formatDriveTime), ["00:00", "01:01", "1:00:05"]);
  assert.deepEqual([999, 1.7e6, 3.1e8].map(formatCount), ["999", "1.7 M", "310 M"]);
  assert.equal(formatBytes(3.8e11), "380 GB");
});

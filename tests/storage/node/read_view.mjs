// node read_view.mjs FOLDER: @mcap/core reads every message of the sample view; each decodes with the schema that is in the file.
import path from "node:path";
import assert from "node:assert/strict";
import { openMcap } from "./open_mcap.mjs";

const { reader, streamed, decode } = await openMcap(path.join(process.argv[2], "view.mcap"));
const byTopic = new Map();
for (const message of streamed) {
  const { topic, schemaId } = reader.channelsById.get(message.channelId);
  const value = decode(message);
  // The message with several transforms has a time in each of them.
  const timestamp = value.timestamp ?? value.transforms[0].timestamp;
  const time = BigInt(timestamp.seconds.toString()) * 1000000000n + BigInt(timestamp.nanos ?? 0);
  assert.equal(time, message.logTime, `${topic}: timestamp and log time`);
  if (!byTopic.has(topic)) byTopic.set(topic, { schema: reader.schemasById.get(schemaId).name, values: [] });
  byTopic.get(topic).values.push(value);
}
const counts = Object.fromEntries([...byTopic].map(([topic, { schema, values }]) => [topic, `${schema} ${values.length}`]));
assert.equal(counts["/pose"], "foxglove.PoseInFrame 5");
assert.equal(counts["/tf"], "foxglove.FrameTransform 6");
assert.equal(counts["/fix"], "foxglove.LocationFix 1");
assert.equal(counts["/image/head"], "foxglove.CompressedImage 2");
assert.equal(counts["/camera/left"], "foxglove.CameraCalibration 2");
assert.equal(counts["/log"], "foxglove.Log 1");
const clouds = byTopic.get("/cloud").values;
assert.equal(byTopic.get("/cloud").schema, "foxglove.PointCloud");
const points = clouds.reduce((sum, cloud) => sum + cloud.data.length / cloud.point_stride, 0);
assert.equal(points, 1000, "every tenth of 10 000 points");
assert.deepEqual(
  clouds[0].fields.map((f) => [f.name, f.offset]),
  [["x", 0], ["y", 4], ["z", 8], ["red", 12], ["green", 13], ["blue", 14], ["alpha", 15], ["intensity", 16], ["quality", 17], ["moving", 18]],
);
const jpeg = byTopic.get("/image/head").values[0].data;
assert.deepEqual([jpeg[0], jpeg[1], jpeg.at(-2), jpeg.at(-1)], [0xff, 0xd8, 0xff, 0xd9], "a whole JPEG");
// Every frame that a message names has a way to enu.
const parents = new Map();
for (const one of [...byTopic.get("/tf").values, ...byTopic.get("/tf_static").values.flatMap((all) => all.transforms)])
  parents.set(one.child_frame_id, one.parent_frame_id);
for (const [topic, { values }] of byTopic)
  for (const value of values) {
    let frame = value.frame_id ?? value.child_frame_id;
    if (!frame) continue;
    for (let steps = 0; frame !== "enu"; frame = parents.get(frame), ++steps)
      assert.ok(steps < 10 && parents.has(frame), `${topic}: the frame ${frame} has no way to enu`);
  }
console.log(`view.mcap: ${JSON.stringify(counts)}`);

// The tree of frames of a view.mcap, read by Foxglove's own @mcap/core. By hand: node frames.mjs VIEW.mcap
import assert from "node:assert/strict";
import fs from "node:fs";
import { pathToFileURL } from "node:url";
import { McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers, protobufFromBinaryDescriptor } from "@mcap/support";

const kNever = -1n;
const nsOf = ({ seconds, nanos }) => BigInt(seconds.toString()) * 1000000000n + BigInt(nanos ?? 0);

/// {transforms: [{parent, child, at}], uses: [{topic, frame, at}]} in the order of the file; times are ns.
export async function readFrames(file) {
  const reader = new McapStreamReader({ decompressHandlers: await loadDecompressHandlers(), validateCrcs: true });
  reader.append(fs.readFileSync(file));
  const types = new Map(), channels = new Map(), transforms = [], uses = [];
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") types.set(record.id, protobufFromBinaryDescriptor(record.data).lookupType(record.name));
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type !== "Message") continue;
    const { topic, schemaId } = channels.get(record.channelId);
    const message = types.get(schemaId).decode(record.data);
    for (const one of message.transforms ?? (message.child_frame_id ? [message] : []))
      transforms.push({ parent: one.parent_frame_id, child: one.child_frame_id, at: nsOf(one.timestamp) });
    if (message.frame_id !== undefined) uses.push({ topic, frame: message.frame_id, at: nsOf(message.timestamp) });
  }
  assert.ok(reader.done(), `${file} ends in the middle of a record`);
  return { transforms, uses };
}

/// Checks that every frame that a message names hangs on one root, which is `root`: no frame has two parents, none is its own ancestor, and
/// when a message names a frame, each step to the root has a transform of that time or before. Returns figures.
export function checkFrames({ transforms, uses }, root = "enu") {
  const parents = new Map(), times = new Map();
  for (const { parent, child, at } of transforms) {
    assert.ok(parent && child, `a transform from ${JSON.stringify(parent)} to ${JSON.stringify(child)}`);
    assert.equal(parents.get(child) ?? parent, parent, `the frame ${child} has two parents`);
    parents.set(child, parent);
    if (!times.has(child)) times.set(child, []);
    times.get(child).push(at);
  }
  for (const list of times.values()) list.sort((a, b) => (a < b ? -1 : a > b ? 1 : 0));
  assert.ok(!parents.has(root), `the root ${root} has the parent ${parents.get(root)}`);
  const wayOf = (frame) => {
    const way = [];
    for (let at = frame; at !== root; at = parents.get(at)) {
      assert.ok(parents.has(at), `the frame ${frame} is an orphan: ${at} has no parent`);
      assert.ok(!way.includes(at), `the frame ${at} is its own ancestor`);
      way.push(at);
    }
    return way;
  };
  const ways = new Map([...new Set([...parents.keys(), ...uses.map((one) => one.frame)])].map((frame) => [frame, wayOf(frame)]));
  const newestBefore = (list, at) => {
    let begin = 0, end = list.length;
    while (begin < end) {
      const middle = (begin + end) >> 1;
      if (list[middle] <= at) begin = middle + 1;
      else end = middle;
    }
    return begin > 0 ? list[begin - 1] : kNever;
  };
  let oldest_s = 0;
  for (const { topic, frame, at } of uses)
    for (const step of ways.get(frame)) {
      const newest = newestBefore(times.get(step), at);
      assert.notEqual(newest, kNever, `${topic}: the frame ${step} has no transform yet at ${at}`);
      if (times.get(step).length > 1) oldest_s = Math.max(oldest_s, Number(at - newest) / 1e9);
    }
  const topics = [...new Set(uses.map((one) => one.topic))].sort();
  return { frames: ways.size, transforms: transforms.length, messages: uses.length, topics, oldest_s };
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? "").href) console.log(checkFrames(await readFrames(process.argv[2])));

// node read_raw.mjs FOLDER: @mcap/core reads every packet of the sample recordings as it was written.
import fs from "node:fs";
import path from "node:path";
import assert from "node:assert/strict";
import { crc32, openMcap } from "./open_mcap.mjs";

const folder = process.argv[2];
const expected = JSON.parse(fs.readFileSync(path.join(folder, "raw.json"), "utf8"));

for (const kind of ["none", "lz4", "zstd"]) {
  const { reader, streamed, indexed, decode } = await openMcap(path.join(folder, `raw_${kind}.mcap`));
  assert.equal(reader.header.profile, "hueline-raw");
  assert.equal(streamed.length, expected.length);
  streamed.forEach((message, i) => {
    const packet = decode(message);
    const want = expected[i];
    assert.deepEqual(
      {
        topic: reader.channelsById.get(message.channelId).topic,
        sequence: packet.sequence.toString(),
        received_ns: packet.received_ns.toString(),
        kind: packet.kind,
        shed: packet.shed,
        sensor: packet.sensor,
        size: packet.payload.length,
        crc: crc32(packet.payload),
      },
      want,
      `packet ${i} of raw_${kind}`,
    );
    assert.equal(message.logTime.toString(), want.received_ns);
  });
  for (let i = 1; i < indexed.length; i++) assert.ok(indexed[i - 1].logTime <= indexed[i].logTime);
  const key = (m) => `${m.logTime} ${m.channelId} ${m.sequence}`;
  assert.deepEqual(indexed.map(key).sort(), streamed.map(key).sort(), "the index leads to the same messages");

  const attachments = [];
  for await (const a of reader.readAttachments({ validateCrcs: true })) attachments.push(a);
  assert.deepEqual(attachments.map((a) => [a.name, a.mediaType]), [
    ["rig.yaml", "application/yaml"],
    ["head.yaml", "application/yaml"],
  ]);
  assert.equal(Buffer.from(attachments[0].data).toString(), "name: van\nsensors: []\n");
  const metadata = [];
  for await (const m of reader.readMetadata()) metadata.push(m);
  assert.equal(metadata[0].name, "hueline.journal");
  assert.equal(metadata[0].metadata.get("git_revision"), "0123abc");
  console.log(`raw_${kind}.mcap: ${streamed.length} messages, ${reader.chunkIndexes.length} chunks`);
}

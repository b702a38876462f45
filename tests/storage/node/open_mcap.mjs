// An MCAP file opened by @mcap/core with every CRC checked, in both ways that library reads.
import fs from "node:fs";
import assert from "node:assert/strict";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers, protobufFromBinaryDescriptor } from "@mcap/support";
import zlib from "node:zlib";

function readable(bytes) {
  return {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + length))),
  };
}

// zlib.crc32 exists since node 22.2. The plain table serves older versions.
const table = new Uint32Array(256).map((_, n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? (n >>> 1) ^ 0xedb88320 : n >>> 1;
  return n >>> 0;
});
export function crc32(bytes) {
  if (zlib.crc32) return zlib.crc32(bytes);
  let crc = 0xffffffff;
  for (const byte of bytes) crc = (crc >>> 8) ^ table[(crc ^ byte) & 0xff];
  return (crc ^ 0xffffffff) >>> 0;
}

/// {reader, streamed: messages in file order, indexed: in log time order, decode(message)}.
export async function openMcap(path) {
  const bytes = fs.readFileSync(path);
  const decompressHandlers = await loadDecompressHandlers();
  const reader = await McapIndexedReader.Initialize({ readable: readable(bytes), decompressHandlers });

  const streamed = [];
  const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(bytes);
  let dataEnd;
  for (let record; (record = stream.nextRecord()); ) {
    if (record.type === "Message") streamed.push({ ...record, data: Uint8Array.from(record.data) });
    if (record.type === "DataEnd") dataEnd = record;
  }
  assert.ok(stream.done(), "the stream reader saw the end of the file");
  assert.equal(stream.bytesRemaining(), 0);
  // The library does not check the CRC of the data section, so it is checked here. It covers everything before the DataEnd record, which
  // ends where the summary starts.
  const dataEndAt = Number(reader.footer.summaryStart) - (1 + 8 + 4);
  assert.equal(bytes[dataEndAt], 0x0f, "DataEnd stands before the summary");
  assert.equal(dataEnd.dataSectionCrc, crc32(bytes.subarray(0, dataEndAt)), "CRC of the data section");

  const indexed = [];
  for await (const message of reader.readMessages({ validateCrcs: true }))
    indexed.push({ ...message, data: Uint8Array.from(message.data) });

  const types = new Map();
  for (const schema of reader.schemasById.values()) {
    assert.equal(schema.encoding, "protobuf");
    types.set(schema.id, protobufFromBinaryDescriptor(schema.data).lookupType(schema.name));
  }
  const decode = (message) => types.get(reader.channelsById.get(message.channelId).schemaId).decode(message.data);

  // Compares the summary with what was read.
  const { statistics } = reader;
  assert.equal(Number(statistics.messageCount), streamed.length);
  assert.equal(indexed.length, streamed.length);
  assert.equal(statistics.chunkCount, reader.chunkIndexes.length);
  for (const [id, count] of statistics.channelMessageCounts)
    assert.equal(Number(count), streamed.filter((m) => m.channelId === id).length, `messages of channel ${id}`);
  return { reader, streamed, indexed, decode };
}

import {
  createFileRegistry,
  fromBinary,
  type DescMessage,
  type FileRegistry,
} from "@bufbuild/protobuf";
import { FileDescriptorSetSchema } from "@bufbuild/protobuf/wkt";

/// A channel as the server advertises it.
export interface Channel {
  id: number;
  topic: string;
  encoding: string;
  schemaName: string;
  schema: string; // protobuf: a FileDescriptorSet in base64
}

export type Decoder = (payload: ArrayBufferView) => unknown;

const kMostJsonBytes = 1 << 20;

function bytesOfBase64(text: string): Uint8Array<ArrayBuffer> {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

function messageType(channel: Channel): DescMessage {
  const files: FileRegistry = createFileRegistry(fromBinary(FileDescriptorSetSchema, bytesOfBase64(channel.schema)));
  const type = files.getMessage(channel.schemaName);
  if (!type) throw new Error(`${channel.topic}: its schema does not describe ${channel.schemaName}`);
  return type;
}

/// Makes the function that turns the payloads of a channel into objects: by the schema that the server sent, so the page
/// holds no copy of it and a field more does no harm. No code is generated, which the server's policy would refuse.
/// Throws an Error that names the topic if the channel cannot be read; the function throws on damaged payloads.
export function decoderOf(channel: Channel): Decoder {
  if (channel.encoding === "json") {
    const text = new TextDecoder("utf-8", { fatal: true });
    return (payload) => {
      if (payload.byteLength > kMostJsonBytes) throw new Error(`${channel.topic}: message of ${payload.byteLength} bytes`);
      return JSON.parse(text.decode(payload));
    };
  }
  if (channel.encoding !== "protobuf") throw new Error(`${channel.topic}: unknown encoding ${channel.encoding}`);
  const type = messageType(channel);
  return (payload) =>
    fromBinary(type, new Uint8Array(payload.buffer as ArrayBuffer, payload.byteOffset, payload.byteLength), {
      readUnknownFields: false,
    });
}

// The schemas in storage/proto are Foxglove's own: the same names, numbers and types as npm's @foxglove/schemas has.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import test from "node:test";
import protobuf from "protobufjs";
import { compareWithFoxglove } from "./schemas.mjs";

const folder = path.join(process.env.HUELINE_SOURCE, "storage/proto");
const load = (change = {}) => {
  const root = new protobuf.Root();
  const files = fs.readdirSync(path.join(folder, "foxglove")).filter((name) => name.endsWith(".proto"));
  for (const name of files) {
    const file = `foxglove/${name}`;
    const text = fs.readFileSync(path.join(folder, file), "utf8");
    protobuf.parse(change[file] ? change[file](text) : text, root, { keepCase: true });
  }
  for (const name of ["timestamp", "duration"]) root.addJSON(protobuf.common.get(`google/protobuf/${name}.proto`).nested);
  root.resolveAll();
  return { types: files.map((name) => root.lookupType(`foxglove.${path.parse(name).name}`)), root };
};

test("every field and every enum of storage/proto is Foxglove's", () => {
  const { types } = load();
  assert.ok(types.length >= 12, `${types.length} messages`);
  const left_out = new Set();
  let fields = 0;
  for (const type of types) {
    const found = compareWithFoxglove(type);
    assert.deepEqual(found.differences, []);
    fields += type.fieldsArray.length;
    for (const one of found.left_out) left_out.add(one);
  }
  console.log(`${types.length} messages with ${fields} fields are those of @foxglove/schemas; left out: ${[...left_out].join(", ") || "none"}`);
});

test("a field of another number, type, name or count, and an enum of another number, are found", () => {
  const wrong = (file, from, to) => {
    const { root } = load({ [`foxglove/${file}.proto`]: (text) => (assert.ok(text.includes(from)), text.replace(from, to)) });
    return compareWithFoxglove(root.lookupType(`foxglove.${file}`)).differences;
  };
  assert.match(wrong("Log", "line = 6", "line = 7")[0], /Log\.line: here number 7/);
  assert.match(wrong("Log", "fixed32 line", "uint32 line")[0], /Log\.line: here uint32/);
  assert.match(wrong("Log", "string file", "string files")[0], /Log\.files: here a field/);
  assert.match(wrong("PointCloud", "repeated PackedElementField", "PackedElementField")[0], /PointCloud\.fields: here repeated: false/);
  assert.match(wrong("Log", "FATAL = 5", "FATAL = 6")[0], /Log\.Level/);
});

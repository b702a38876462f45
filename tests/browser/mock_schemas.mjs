// The project's own Foxglove schemas: their description by protoc, their messages by protobufjs, which is another encoder than the
// program's and shares nothing with the page's reader.
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import protobuf from "protobufjs";

/// {type(name), base64(name): the FileDescriptorSet of the type's file and of what it imports}
export function loadSchemas(folder) {
  const root = new protobuf.Root();
  root.resolvePath = (_, target) => (target.startsWith("google/") ? target : path.join(folder, target));
  const files = fs.readdirSync(path.join(folder, "foxglove")).filter((name) => name.endsWith(".proto"));
  root.loadSync(files.map((name) => `foxglove/${name}`));
  root.resolveAll();
  const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "schemas-"));
  const described = new Map(
    files.map((name) => {
      const out = path.join(scratch, `${name}.bin`);
      execFileSync("protoc", [`-I${folder}`, "--include_imports", `--descriptor_set_out=${out}`, `foxglove/${name}`]);
      return [`foxglove.${path.parse(name).name}`, fs.readFileSync(out).toString("base64")];
    }),
  );
  fs.rmSync(scratch, { recursive: true });
  return { type: (name) => root.lookupType(name), base64: (name) => described.get(name) };
}

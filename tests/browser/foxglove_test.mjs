// node foxglove_test.mjs: hueline-console as a Foxglove client sees it, by npm's @foxglove/ws-protocol, in both versions of the protocol. A drive
// of emulated devices runs; every message decodes by the schema that the server advertised, and every frame has a way to enu.
import { spawn, spawnSync } from "node:child_process";
import assert from "node:assert/strict";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import protocol from "@foxglove/ws-protocol";
import WebSocket from "ws";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor/index.js";
import { compareWithFoxglove } from "./schemas.mjs";

const { FoxgloveClient } = protocol;

const { HUELINE_CONSOLE: program, HUELINE_SOURCE: source, HUELINE_PROGRAM: hueline } = process.env;
const work = fs.mkdtempSync(path.join(os.tmpdir(), "hueline-foxglove-"));
const users = path.join(work, "users.json");
// Longer than a busy computer needs to bring a message of each topic; then it is stopped.
const scenarios = path.join(work, "scenarios");
fs.mkdirSync(scenarios);
const short = fs.readFileSync(path.join(source, "tests/scenarios/short.yaml"), "utf8");
fs.writeFileSync(path.join(scenarios, "short.yaml"), short.replace(/^duration_s: .*/m, "duration_s: 40"));
const run = (...words) => spawnSync(program, [...words, "--users", users], { input: "correct horse\n", encoding: "utf8" });
assert.equal(run("user", "add", "anna", "--role", "operator").status, 0);
const token = run("user", "token", "anna").stdout.trim();
const server = spawn(program, [
  "serve", "--drives", path.join(work, "drives"), "--users", users, "--port", "0", "--plain", "--hueline", hueline,
  "--allow-simulate", scenarios,
]);
try {
  let said = "";
  const port = await new Promise((found, failed) => {
    server.stderr.on("data", (text) => {
      said += text;
      const at = /127\.0\.0\.1:(\d+)\/;/.exec(said);
      if (at) found(at[1]);
    });
    server.on("exit", () => failed(new Error(said)));
  });
  const api = `http://127.0.0.1:${port}/api/`;
  const headers = { "Content-Type": "application/json" };
  const login = await fetch(`${api}login`, { method: "POST", headers, body: JSON.stringify({ name: "anna", password: "correct horse" }) });
  assert.equal(login.status, 200);
  headers.Cookie = login.headers.get("set-cookie").split(";")[0];
  headers["X-Csrf"] = (await login.json()).csrf;
  const started = await fetch(`${api}start`, { method: "POST", headers, body: JSON.stringify({ rig: "short", simulate: "short", name: "fox" }) });
  assert.equal(started.status, 202, await started.text());

  // A client that subscribes to all channels.
  const listen = (version) => {
    const seen = { protocol: version, topics: new Map(), counts: new Map(), parents: new Map(), frames: new Set(), errors: [], server: undefined };
    const client = new FoxgloveClient({ ws: new WebSocket(`ws://127.0.0.1:${port}/?token=${token}`, [version]) });
    const decoders = new Map();
    client.on("serverInfo", (info) => (seen.server = info.name));
    client.on("error", (error) => seen.errors.push(error));
    client.on("advertise", (channels) => {
      for (const channel of channels) {
        seen.topics.set(channel.topic, channel.schemaName);
        let decode = (data) => JSON.parse(new TextDecoder().decode(data));
        if (channel.encoding === "protobuf") {
          const root = protobuf.Root.fromDescriptor(Buffer.from(channel.schema, "base64"));
          root.resolveAll();
          const type = root.lookupType(channel.schemaName);
          // What the server advertises is what Foxglove publishes, so that its panels know the messages.
          assert.deepEqual(compareWithFoxglove(type).differences, [], channel.topic);
          decode = (data) => type.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
        }
        decoders.set(client.subscribe(channel.id), { topic: channel.topic, decode });
      }
    });
    client.on("message", ({ subscriptionId, timestamp, data }) => {
      const { topic, decode } = decoders.get(subscriptionId);
      const message = decode(data);
      assert.ok(timestamp > 1_600_000_000_000_000_000n, `${topic}: ${timestamp}`);
      seen.counts.set(topic, (seen.counts.get(topic) ?? 0) + 1);
      const transforms = topic === "/tf_static" ? message.transforms : topic === "/tf" ? [message] : [];
      for (const one of transforms) seen.parents.set(one.child_frame_id, one.parent_frame_id);
      if (message.frame_id) seen.frames.add(message.frame_id);
      if (topic === "/cloud") assert.equal(message.data.length % message.point_stride, 0);
      if (topic === "/image/camera") assert.deepEqual([...message.data.slice(0, 2)], [0xff, 0xd8]);
    });
    return { seen, client };
  };
  const clients = ["foxglove.websocket.v1", "foxglove.sdk.v1"].map(listen);
  const wanted = ["/hueline/console", "/hueline/status", "/diagnostics", "/cloud", "/pose", "/tf", "/tf_static", "/fix", "/image/camera", "/camera/lens0", "/health"];
  const end = Date.now() + 180_000;
  while (!clients.every(({ seen }) => wanted.every((topic) => seen.counts.has(topic)))) {
    assert.ok(Date.now() < end, JSON.stringify(clients.map(({ seen }) => [...seen.counts])));
    await new Promise((done) => setTimeout(done, 100));
  }
  for (const { seen, client } of clients) {
    assert.equal(seen.server, "hueline");
    assert.deepEqual(seen.errors, []);
    for (let frame of seen.frames)
      for (let steps = 0; frame !== "enu"; frame = seen.parents.get(frame), ++steps)
        assert.ok(steps < 10 && seen.parents.has(frame), `${seen.protocol}: the frame ${frame} has no way to enu`);
    console.log(seen.protocol, Object.fromEntries(seen.counts));
    client.close();
  }
  await fetch(`${api}stop`, { method: "POST", headers, body: "{}" });
  for (let state = ""; state !== "idle"; ) {
    assert.ok(Date.now() < end + 60_000, state);
    await new Promise((done) => setTimeout(done, 200));
    state = (await (await fetch(`${api}state`, { headers })).json()).state;
  }
} finally {
  server.kill();
  // A drive that still runs writes to the folder, which must not hide what went wrong.
  fs.rmSync(work, { recursive: true, force: true, maxRetries: 20, retryDelay: 500 });
}

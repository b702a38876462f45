// Plays hueline-console for the tests of the page: the same REST calls, headers and messages as docs/formats.md describes, about a made
// street. A test changes what it says: mock.trouble(...), mock.well(...), mock.cut(). By hand:
//   node mock_server.mjs PAGE_FOLDER PROTO_FOLDER [PORT]
import fs from "node:fs";
import http from "node:http";
import path from "node:path";
import zlib from "node:zlib";
import { pathToFileURL } from "node:url";
import protocol from "@foxglove/ws-protocol";
import { WebSocketServer } from "ws";
import { loadSchemas } from "./mock_schemas.mjs";
import { groundAt, kFields, kStride, pointsAt, vehicleAt } from "./mock_street.mjs";

const kPolicy =
  "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; font-src 'self'; connect-src 'self'; " +
  "worker-src 'self' blob:; media-src 'self' blob:; manifest-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'";
const kTypes = { ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".css": "text/css", ".json": "application/json" };
const kReport =
  "<!doctype html><html lang=en><title>Report</title><style>body{font-family:sans-serif}</style><h1>Drive report</h1><p>good</p></html>";
export const kUsers = { anna: { password: "a long word", role: "operator" }, victor: { password: "another word", role: "viewer" } };
const kOrigin = { latitude_deg: 48.1, longitude_deg: 11.5, height_m: 520 };
// Metres a degree there: the usual series for the ellipsoid, and what its height adds.
const kLat = (kOrigin.latitude_deg * Math.PI) / 180, kUp = 1 + kOrigin.height_m / 6378137;
const kNorth = (111132.92 - 559.82 * Math.cos(2 * kLat) + 1.175 * Math.cos(4 * kLat)) * kUp;
const kEast = (111412.84 * Math.cos(kLat) - 93.5 * Math.cos(3 * kLat) + 0.118 * Math.cos(5 * kLat)) * kUp;

export const kSensors = [
  { name: "laser", role: "scanner", driver: "velodyne", rate_hz: 754.2 },
  { name: "head", role: "camera", driver: "genicam", rate_hz: 2.0 },
  { name: "pos", role: "pos", driver: "novatel", rate_hz: 208.5 },
  { name: "pps", role: "pps", driver: "pps", rate_hz: 1.0 },
  { name: "wheel", role: "wheel", driver: "wheel", rate_hz: 100.0 },
];

/// The check sum of a PNG's chunk.
function crc32(bytes) {
  let crc = -1;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; ++bit) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

/// A square picture of rows that each begin with a filter's byte, as a PNG.
function png(px, rows) {
  const chunk = (type, data) => {
    const length = Buffer.alloc(4), sum = Buffer.alloc(4), named = Buffer.concat([Buffer.from(type, "latin1"), data]);
    length.writeUInt32BE(data.length), sum.writeUInt32BE(crc32(named));
    return Buffer.concat([length, named, sum]);
  };
  const size = Buffer.alloc(13);
  size.writeUInt32BE(px), size.writeUInt32BE(px, 4), size.set([8, 2], 8);
  return Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), chunk("IHDR", size), chunk("IDAT", zlib.deflateSync(rows)), chunk("IEND", Buffer.alloc(0))]);
}

export class Mock {
  state = { state: "idle", drive: null, rig: null, since: null, allow_simulate: true, scenarios: ["short", "street"], last: null, feed: "none", ended: false, acknowledged: [], sound_trouble: "" };
  check = { state: "none", rig: null, at: null, ready: null, items: [], lenses: [], checklist: [], error: "", exit_status: null };
  check_ms = 700; // how long it takes
  checkError = null; // error and exit_status of a check that cannot be done
  /// What a check will answer.
  checklist = [];
  checkLenses = ["front", "left"].map((lens) => ({ camera: "camera", lens, median: 91, dark_share: 0.031, saturated_share: 0.004,
    histogram: Array.from({ length: 64 }, (_, i) => Math.round(1000 * Math.exp(-(((i - 22) / 12) ** 2))) + (i === 63 ? 200 : 0)) }));
  checkItems = [
    { name: "rig", state: "ok", text: "The rig contradicts nothing.", action: "" },
    { name: "laser", state: "ok", text: "754 packets a second.", action: "" },
    { name: "head", state: "ok", text: "2 images a second.", action: "" },
    { name: "computer", state: "remark", text: "net.core.rmem_max is 212992 bytes.", action: "sysctl -w net.core.rmem_max=33554432" },
    { name: "disk", state: "ok", text: "380 GB free, enough for 31 hours.", action: "" },
  ];
  drives = [
    { name: "2026-11-20_0900", begin: "2026-11-20T09:00:00Z", duration_s: 3605, path_m: 24100, points: 9.1e8, coloured_share: 0.97, grade: "good", bytes: 9.4e10, running: false },
    { name: "2026-11-19_1400", begin: "2026-11-19T14:00:00Z", duration_s: 1200, path_m: 8200, points: 3.1e8, coloured_share: 0.91, grade: "usable with remarks", bytes: 3.1e10, running: false },
    { name: "2026-11-18_1100", begin: "2026-11-18T11:00:00Z", duration_s: 640, path_m: 3900, points: 1.4e8, coloured_share: 0.4, grade: "drive again", bytes: 1.6e10, running: false },
  ];
  calls = []; // what the page has asked: {method, path, body}
  pointsPerMessage = 4000;
  colouredShare = 0.97;
  fix = "RtkFixed";
  tiles = null; // or { least_zoom, most_zoom, attribution }
  /// The drive runs this many times faster than the clock.
  speed = 1;
  marks = [];
  drive_s = 0;

  #server;
  #foxglove;
  #sockets = new WebSocketServer({ noServer: true, handleProtocols: (offered) => this.#foxglove.handleProtocols?.(offered) ?? [...offered][0] });
  #schemas;
  #page;
  #image;
  #channels = new Map();
  #subscribed = new Set();
  #timers = [];
  #troubles = new Map(); // sensor or "drive" to its troubles
  #events = [];
  #seconds = [];
  #session = { cookie: "s3cret", who: null };
  #holdover = null;

  constructor(page, protos, image) {
    this.#page = page;
    this.#schemas = loadSchemas(protos);
    this.#image = image;
  }

  async start(port = 0) {
    this.#foxglove = new protocol.FoxgloveServer({ name: "hueline-console" });
    this.#foxglove.on("subscribe", (channel) => this.#onSubscribe(channel));
    this.#foxglove.on("unsubscribe", (channel) => this.#subscribed.delete(channel));
    this.#foxglove.on("error", () => {});
    this.#addChannel("/hueline/console");
    this.#server = http.createServer((request, response) => void this.#answer(request, response));
    this.#server.on("upgrade", (request, socket, head) => {
      if (!this.#isIn(request) || !request.url.startsWith("/ws")) return void socket.destroy();
      this.#sockets.handleUpgrade(request, socket, head, (client) => this.#foxglove.handleConnection(client, request.socket.remoteAddress ?? ""));
    });
    await new Promise((done) => this.#server.listen(port, "127.0.0.1", done));
    this.#timers.push(setInterval(() => this.#send("/hueline/console", this.state), 2000), setInterval(() => this.#tick(), 100));
    return `http://127.0.0.1:${this.#server.address().port}`;
  }
  async stop() {
    for (const timer of this.#timers) clearInterval(timer);
    this.cut();
    this.#server.closeAllConnections();
    await new Promise((done) => this.#server.close(done));
  }

  /// Cuts every WebSocket, as a lost network does. The server then takes new ones at once.
  cut() {
    for (const client of this.#sockets.clients) client.terminate();
  }

  /// Something is wrong with a sensor, or with "drive".
  trouble(who, trouble, level, cause, action = "") {
    const list = this.#troubles.get(who) ?? [];
    list.push({ trouble, level, cause, action, since_s: this.drive_s });
    this.#troubles.set(who, list);
    if (trouble === "holdover") this.#holdover = this.drive_s;
    this.#event("health", level, who, cause, action);
    this.#sendStatus();
  }
  /// All is well again.
  well(who) {
    this.#troubles.delete(who);
    this.state.acknowledged = this.state.acknowledged.filter((id) => !id.startsWith(`${who} `));
    this.#send("/hueline/console", this.state);
    if (who === "pps") this.#holdover = null;
    this.#event("health", "ok", who, "all is well");
    this.#sendStatus();
  }
  /// As when an operator has acknowledged an alarm on some page.
  acknowledge(id) {
    if (id === "console ended") this.state.ended = false;
    else this.state.acknowledged.push(id);
    this.#send("/hueline/console", this.state);
  }
  /// As when the capture is killed.
  kill() {
    const { drive } = this.state;
    this.drives.unshift({ name: drive, begin: this.state.since, duration_s: null, path_m: null, points: null, coloured_share: null, grade: null, bytes: 2e9, running: false });
    this.#dropChannels();
    Object.assign(this.state, { state: "idle", drive: null, rig: null, since: null, feed: "none", ended: true, last: { drive, exit_status: 137, text: "" } });
    this.#send("/hueline/console", this.state);
  }
  mark(note) {
    this.marks.push({ number: this.marks.length + 1, drive_s: this.drive_s, time: new Date().toISOString(), note, ...this.#place() });
    this.#event("mark", "info", "operator", `mark ${this.marks.length}: ${note}`);
  }
  event(kind, level, sensor, text) {
    this.#event(kind, level, sensor, text);
  }

  /// As when POST /api/start has started a drive.
  begin(drive, rig, isSimulated) {
    this.#begin({ state: "driving", replay: null }, drive, rig, isSimulated);
  }
  #begin(state, drive = "2026-11-23_0100", rig = "street", isSimulated = false) {
    Object.assign(this, { drive_s: state.replay?.from_s ?? 0, marks: [], isSimulated });
    this.#events = [];
    this.#seconds = [];
    this.#troubles.clear();
    this.#holdover = null;
    Object.assign(this.state, { ...state, drive, rig, since: new Date().toISOString(), last: null, feed: "connected", ended: false, acknowledged: [] });
    for (const topic of ["/hueline/status", "/hueline/events", "/hueline/map"]) this.#addChannel(topic);
    this.#addChannel("/cloud", "foxglove.PointCloud");
    this.#addChannel("/pose", "foxglove.PoseInFrame");
    this.#addChannel("/log", "foxglove.Log");
    this.#addChannel("/image/head", "foxglove.CompressedImage");
    this.#event("health", "ok", "drive", "all is well: every sensor is there, and points are placed");
    this.#send("/hueline/console", this.state);
  }
  /// As when a replay has begun, from a second of the drive.
  beginReplay(drive, { speed = 1, paused = false, from_s = 0 } = {}) {
    const duration_s = this.drives.find((one) => one.name === drive)?.duration_s ?? null;
    this.speed = speed;
    this.#begin({ state: paused ? "paused" : "replaying", replay: { speed, paused, from_s, duration_s } }, drive);
  }
  /// What POST /api/replay/pace and /api/replay/seek do.
  #pace({ paused = this.state.replay.paused, speed = this.state.replay.speed }) {
    Object.assign(this.state.replay, { paused, speed });
    this.state.state = paused ? "paused" : "replaying";
    this.speed = speed;
    this.#send("/hueline/console", this.state);
  }
  #seek(position_s) {
    const { drive, replay } = this.state;
    const next = { ...replay, from_s: position_s };
    this.#dropChannels();
    Object.assign(this.state, { state: "starting", replay: next });
    this.#send("/hueline/console", this.state);
    setTimeout(() => this.beginReplay(drive, next), 3000); // longer than data may be old
  }
  #dropChannels() {
    for (const [topic, id] of this.#channels)
      if (topic !== "/hueline/console") {
        this.#foxglove.removeChannel(id);
        this.#channels.delete(topic);
        this.#subscribed.delete(id);
      }
  }
  end(exit_status = 0, text = "good") {
    const { drive, replay } = this.state;
    if (!replay) this.drives.unshift({ name: drive, begin: this.state.since, duration_s: this.drive_s, path_m: 8 * this.drive_s, points: 1e6, coloured_share: 0.97, grade: "good", bytes: 2e9, running: false });
    this.#dropChannels();
    Object.assign(this.state, { state: "idle", replay: null, drive: null, rig: null, since: null, feed: "none", last: { drive, exit_status, text } });
    this.#send("/hueline/console", this.state);
  }

  // ---- WebSocket
  #addChannel(topic, type) {
    const json = { encoding: "json", schemaName: "", schemaEncoding: "jsonschema", schema: "{}" };
    const protobuf = { encoding: "protobuf", schemaName: type, schemaEncoding: "protobuf", schema: type ? this.#schemas.base64(type) : "" };
    this.#channels.set(topic, this.#foxglove.addChannel({ topic, ...(type ? protobuf : json) }));
  }
  #onSubscribe(channel) {
    this.#subscribed.add(channel);
    // The server sends what it remembers after the subscription, as hueline-console does.
    setTimeout(() => {
      if (channel === this.#channels.get("/hueline/console")) this.#send("/hueline/console", this.state);
      if (channel === this.#channels.get("/hueline/events")) for (const event of this.#events) this.#send("/hueline/events", event);
      if (channel === this.#channels.get("/hueline/map")) this.#sendMap(this.#seconds);
    }, 0);
  }
  #bytes(topic, bytes) {
    const id = this.#channels.get(topic);
    if (id === undefined || !this.#subscribed.has(id)) return;
    this.#foxglove.sendMessage(id, BigInt(Date.now()) * 1000000n, bytes);
  }
  #send(topic, json) {
    this.#bytes(topic, Buffer.from(JSON.stringify(json)));
  }
  #proto(topic, type, message) {
    const codec = this.#schemas.type(type);
    this.#bytes(topic, codec.encode(codec.fromObject(message)).finish());
  }
  /// Sends bytes that are no message of the topic.
  damage(topic) {
    this.#bytes(topic, Buffer.from([0xff, 0xff, 0xff, 0xff, 0x07, 0x01]));
  }

  #event(kind, level, sensor, text, action = "") {
    const event = { time: new Date().toISOString(), drive_s: this.drive_s, kind, level, sensor, text, action };
    this.#events.push(event);
    if (this.#events.length > 500) this.#events.shift();
    this.#send("/hueline/events", event);
  }
  #sendMap(seconds) {
    this.#send("/hueline/map", { origin: kOrigin, first_s: seconds[0]?.[0] ?? 0, seconds });
  }
  #place() {
    const { east, north } = vehicleAt(this.drive_s);
    return {
      latitude_deg: kOrigin.latitude_deg + north / kNorth,
      longitude_deg: kOrigin.longitude_deg + east / kEast,
    };
  }
  #level(list) {
    return ["alarm", "warning", "waiting"].find((level) => list.some((one) => one.level === level)) ?? "ok";
  }
  #status() {
    const all = [...this.#troubles.values()].flat();
    const t = this.drive_s;
    return {
      mode: this.state.replay ? "replay" : "capture", ...(this.state.replay && { replay: { ...this.state.replay, position_s: t } }), rig: this.state.rig, drive: this.state.drive, since: this.state.since, drive_s: t, gps: new Date().toISOString(),
      level: this.#level(all), simulated: this.isSimulated,
      sensors: kSensors.map((sensor) => {
        const troubles = this.#troubles.get(sensor.name) ?? [];
        const worst = troubles.find((one) => one.level === "alarm") ?? troubles[0];
        const isGone = troubles.some((one) => one.trouble === "gone" || one.trouble === "silent");
        return {
          ...sensor, state: isGone ? "silent" : "running", level: this.#level(troubles), trouble: worst?.trouble ?? null, cause: worst?.cause ?? "",
          action: worst?.action ?? "", since_s: worst?.since_s ?? null, troubles, packets: Math.round(sensor.rate_hz * t), bytes: 1, bytes_per_s: sensor.rate_hz * 1206,
          rate_hz: isGone ? 0 : sensor.rate_hz, age_s: isGone ? t - worst.since_s : 1 / sensor.rate_hz / 2, lost: 0, shed: 0, refused: 0,
        };
      }),
      troubles: this.#troubles.get("drive") ?? [],
      clocks: [{ name: "pps", state: this.#holdover === null ? "Locked" : "Holdover", sigma_s: 2.1e-6 + (this.#holdover === null ? 0 : (t - this.#holdover) * 1e-7),
        residual_s: 4e-7 * Math.sin(t) + 2e-7 * Math.sin(7.3 * t), holdover_s: this.#holdover === null ? null : t - this.#holdover }],
      pos: { status: "INS_SOLUTION_GOOD", is_good: true, sigma_horizontal_m: 0.018, sigma_vertical_m: 0.031, ...this.#place(), height_m: 520,
        speed_m_s: 8, heading_deg: (vehicleAt(t).heading * 180) / Math.PI, fix: this.fix, satellites: 17 },
      disk: { free_bytes: 3.8e11, bytes_per_s: 2.6e7, left_s: 14615 },
      queues: [{ name: "record", packets: 3, share: 0.002 }, { name: "pipeline", packets: 80, share: 0.031 }],
      points: Math.round(t * 5 * this.pointsPerMessage), coloured_share: this.colouredShare, exposures: Math.floor(2 * t), path_m: 8 * t, marks: this.marks, listeners_lost: 0,
    };
  }
  #sendStatus() {
    if (["driving", "replaying", "paused", "stopping"].includes(this.state.state)) this.#send("/hueline/status", this.#status());
  }
  #tick() {
    if (this.state.state === "paused" && !this.isFrozen) this.#sendStatus(); // a paused replay still says where it is
    if (this.state.state !== "driving" && this.state.state !== "replaying") return;
    const before = Math.floor(this.drive_s);
    this.drive_s += 0.1 * this.speed;
    const t = this.drive_s, at = vehicleAt(t);
    if (!this.isFrozen) this.#sendStatus();
    this.#proto("/pose", "foxglove.PoseInFrame", {
      frameId: "enu",
      pose: { position: { x: at.east, y: at.north, z: 0 }, orientation: { x: 0, y: 0, z: Math.sin(-at.heading / 2), w: Math.cos(at.heading / 2) } },
    });
    if (Math.floor(t * 5) !== Math.floor((t - 0.1 * this.speed) * 5)) {
      const data = pointsAt(t, this.pointsPerMessage, this.colouredShare);
      this.#proto("/cloud", "foxglove.PointCloud", { frameId: "enu", pointStride: kStride, fields: kFields, data });
    }
    for (let second = before + 1; second <= Math.floor(t); ++second) {
      const { east, north } = vehicleAt(second);
      const points = this.hole ? 0 : 5 * this.pointsPerMessage;
      const entry = [second, east, north, points, Math.round(points * this.colouredShare), 0.02, this.fix];
      this.#seconds.push(entry);
      this.#sendMap([entry]);
      if (this.#image) this.#proto("/image/head", "foxglove.CompressedImage", { frameId: "head", format: "jpeg", data: this.#image });
    }
  }

  // ---- REST
  #isIn(request) {
    return this.#session.who !== null && (request.headers.cookie ?? "").includes(`hueline_session=${this.#session.cookie}`);
  }
  async #answer(request, response) {
    response.setHeader("Content-Security-Policy", kPolicy);
    response.setHeader("X-Content-Type-Options", "nosniff");
    const { pathname } = new URL(request.url, "http://localhost");
    if (!pathname.startsWith("/api/")) return this.#file(pathname, response);
    let text = "";
    for await (const part of request) text += part;
    const body = text ? JSON.parse(text) : {};
    const call = pathname.slice(5);
    this.calls.push({ method: request.method, path: call, body });
    const say = (status, json) => response.writeHead(status, { "Content-Type": "application/json" }).end(JSON.stringify(json));
    const deny = (status, error) => say(status, { error });
    if (call === "login") {
      const user = kUsers[body.name];
      if (!user || user.password !== body.password) return deny(401, "Name or password is wrong.");
      this.#session.who = { name: body.name, role: user.role, csrf: "token" };
      response.setHeader("Set-Cookie", `hueline_session=${this.#session.cookie}; HttpOnly; SameSite=Strict; Path=/`);
      return say(200, this.#session.who);
    }
    if (this.noUsers) return deny(503, "Nobody can log in yet. Make a user: hueline-console user add NAME --role operator");
    if (!this.#isIn(request)) return deny(401, "Log in first.");
    if (request.method === "POST" && request.headers["x-csrf"] !== "token") return deny(403, "The header X-Csrf is missing.");
    if (request.method === "POST" && call !== "logout" && this.#session.who.role !== "operator") return deny(403, "Only operators may do this.");
    return this.#call(`${request.method} ${call}`, body, say, deny, response);
  }
  #call(call, body, say, deny, response) {
    const summary = /^GET drives\/([A-Za-z0-9._-]+)\/(summary\.json|report\.html)$/.exec(call);
    if (summary) return this.#drive(summary[1], summary[2], say, deny, response);
    const tile = /^GET tiles\/(\d+)\/(\d+)\/(\d+)$/.exec(call);
    if (tile && this.tiles) return response.writeHead(200, { "Content-Type": "image/png" }).end(this.#tile(...tile.slice(1).map(Number)));
    switch (call) {
      case "GET tiles": return say(200, { tiles: this.tiles });
      case "GET session": return say(200, this.#session.who);
      case "POST logout": this.#session.who = null; return say(200, {});
      case "GET state": return say(200, this.state);
      case "GET rigs": return say(200, { rigs: [{ name: "street", from: "shipped" }, { name: "minimal", from: "shipped" }] });
      case "GET check": return say(200, this.check);
      case "POST check":
        if (this.check.state === "running" || this.state.state !== "idle") return deny(409, "the console is checking: wait, or stop the drive");
        this.check = { state: "running", rig: body.rig, at: null, ready: null, items: [], lenses: [], checklist: [], error: "", exit_status: null };
        setTimeout(() => {
          if (this.checkError) {
            this.check = { ...this.check, state: "failed", ...this.checkError };
            return;
          }
          const items = structuredClone(this.checkItems);
          this.check = { state: "done", rig: body.rig, at: new Date().toISOString(), ready: !items.some((one) => one.state === "missing"), items, lenses: this.checkLenses, checklist: this.checklist, error: "", exit_status: null };
        }, this.check_ms);
        return say(202, { state: "checking" });
      case "POST start":
        if (this.state.state !== "idle") return deny(409, "A drive is running already.");
        this.begin(body.name ?? "2026-11-23_0100", body.rig, Boolean(body.simulate));
        return say(202, { drive: this.state.drive });
      case "POST stop":
        if (this.state.state === "idle") return deny(409, "Nothing is running.");
        this.state.state = "stopping";
        this.#send("/hueline/console", this.state);
        setTimeout(() => this.end(), 800);
        return say(202, {});
      case "POST mark":
        this.mark(body.note);
        return say(200, {});
      case "POST acknowledge":
        this.acknowledge(body.alarm);
        return say(200, {});
      case "POST sound":
        return this.state.sound_trouble ? deny(409, this.state.sound_trouble) : say(202, {});
      case "GET drives": return say(200, { drives: this.drives, all: this.allDrives ?? this.drives.length });
      case "POST replay":
        if (this.state.state !== "idle") return deny(409, "A drive is running already.");
        this.beginReplay(body.drive, body);
        return say(202, { drive: body.drive });
      case "POST replay/pace":
        if (!this.state.replay) return deny(409, "no replay runs that could be paused or be given another speed");
        this.#pace(body);
        return say(200, {});
      case "POST replay/seek":
        if (!this.state.replay) return deny(409, "no replay runs that could go on from another second: start one");
        this.#seek(body.position_s);
        return say(202, {});
    }
    return deny(404, `There is no ${call}.`);
  }
  /// A tile of the map: houses, and the street that the vehicle drives along.
  #tile(zoom, x, y) {
    const px = 256, rows = Buffer.alloc(px * (1 + 3 * px));
    for (let row = 0; row < px; ++row) {
      const latitude_deg = (Math.atan(Math.sinh(Math.PI * (1 - (2 * (y + (row + 0.5) / px)) / 2 ** zoom))) * 180) / Math.PI;
      for (let column = 0; column < px; ++column) {
        const longitude_deg = ((x + (column + 0.5) / px) / 2 ** zoom) * 360 - 180;
        const colour = groundAt((longitude_deg - kOrigin.longitude_deg) * kEast, (latitude_deg - kOrigin.latitude_deg) * kNorth);
        rows.set(colour, row * (1 + 3 * px) + 1 + 3 * column);
      }
    }
    return png(px, rows);
  }
  #drive(name, file, say, deny, response) {
    const drive = this.drives.find((one) => one.name === name);
    if (!drive) return deny(404, `There is no drive ${name}.`);
    if (this.summaryText !== undefined && file === "summary.json") return response.writeHead(200, { "Content-Type": "application/json" }).end(this.summaryText);
    if (drive.grade === null) return deny(404, `the drive has no ${file} (yet)`);
    if (file === "report.html") {
      response.setHeader("Content-Security-Policy", "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'");
      return response.writeHead(200, { "Content-Type": kTypes[".html"] }).end(kReport);
    }
    if (file === "report.pdf") return response.writeHead(200, { "Content-Type": "application/pdf" }).end("%PDF-1.4\n");
    const remarks = drive.grade === "good" ? [] : [
      { grade: drive.grade, sensor: "head", text: "without images for 64.0 s, more than the rig's 5.0 s", begin_s: 311, end_s: 375, length_m: 498 },
      { grade: "usable with remarks", sensor: "pos", text: "pose sigma 0.084 m at worst, above the rig's 0.05 m", begin_s: 120, end_s: 131, length_m: 77 },
    ];
    return say(200, { verdict: { grade: drive.grade, remarks }, marks: [] });
  }
  #file(pathname, response) {
    const file = path.join(this.#page, path.normalize(pathname === "/" ? "/index.html" : pathname));
    if (!file.startsWith(this.#page) || !fs.existsSync(file)) return response.writeHead(404).end();
    return response.writeHead(200, { "Content-Type": kTypes[path.extname(file)] ?? "application/octet-stream" }).end(fs.readFileSync(file));
  }
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? "").href) {
  const [page, protos, port] = process.argv.slice(2);
  const mock = new Mock(path.resolve(page), path.resolve(protos));
  console.log(await mock.start(Number(port ?? 8766)), "users:", kUsers);
}

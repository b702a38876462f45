// A server of object storage and a gate before it, for server_test.sh.
// usage: node server.mjs FOLDER PORT
// The storage has one bucket, "drives", which FOLDER/drives keeps, and one key, S3RVER with the secret S3RVER; it checks
// signatures of version 4. The gate listens at PORT, passes on what it gets, and notes each answer in FOLDER/gate.log: method, path,
// status and bytes. FOLDER/gate.json may make it worse: {"slow_ms": 20} waits before each answer, {"fail": 2} answers the next two
// requests of objects with 503, {"cut": 2} ends the answers of the next two early, {"region": "eu-west-1"} says that the bucket is there.
import fs from "node:fs";
import http from "node:http";
import path from "node:path";
import { createRequire } from "node:module";

const [folder, port] = process.argv.slice(2);
const S3rver = createRequire(import.meta.url)("@20minutes/s3rver");
const storage = new S3rver({ port: 0, address: "127.0.0.1", silent: true, directory: folder, configureBuckets: [{ name: "drives" }] });
const behind = await storage.run();
const orders = path.join(folder, "gate.json");
const log = path.join(folder, "gate.log");

function order() {
  try {
    return JSON.parse(fs.readFileSync(orders, "utf8"));
  } catch {
    return {};
  }
}
// Returns whether one of the numbered orders is left, and takes it.
function takes(all, what) {
  if (!(all[what] > 0)) return false;
  all[what] -= 1;
  fs.writeFileSync(orders, JSON.stringify(all));
  return true;
}

const gate = http.createServer((request, answer) => {
  const all = order();
  const is_object = request.method === "GET" && !request.url.includes("list-type");
  let bytes = 0;
  const note = (status) => fs.appendFileSync(log, `${request.method} ${request.url} ${status} ${bytes}\n`);
  if (all.region) {
    answer.writeHead(301, { "x-amz-bucket-region": all.region });
    answer.end();
    return note(301);
  }
  if (is_object && takes(all, "fail")) {
    answer.writeHead(503);
    answer.end("<Error><Code>SlowDown</Code><Message>Reduce your request rate.</Message></Error>");
    return note(503);
  }
  const cuts = is_object && takes(all, "cut");
  const on = http.request({ ...behind, host: behind.address, port: behind.port, method: request.method, path: request.url, headers: request.headers }, (got) => {
    setTimeout(() => {
      answer.writeHead(got.statusCode, got.headers);
      got.on("data", (data) => {
        bytes += data.length;
        if (!cuts) return answer.write(data);
        answer.write(data.subarray(0, data.length / 2), () => answer.destroy());
      });
      got.on("end", () => {
        if (!cuts) answer.end();
        note(got.statusCode);
      });
    }, all.slow_ms ?? 0);
  });
  request.pipe(on);
});
gate.listen(Number(port), "127.0.0.1", () => console.log(`listening on ${gate.address().port}`));

// Independent clients at the port of --view: Foxglove's own library under the old name of the protocol,
// a bare WebSocket under the new one, ten at once of which one does not read. What they decode is what
// the run's files have, and the files are those of a run that nobody watched.
// Arguments: program, folder of node_modules, folder to work in, map.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createHash } from "node:crypto";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [, , program, modules, folder, map] = process.argv;
const require = createRequire(path.resolve(modules, "x.js"));
if (!fs.existsSync(path.join(modules, "@foxglove/ws-protocol"))) {
  console.log("@foxglove/ws-protocol is not there; ./dev test fetches it");
  process.exit(77);
}
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const SECONDS = 4;
const text = new TextDecoder();

function fly(out, flags) {
  const run = spawn(program, ["fly", map, "-o", out, "--seed", "3", "--duration", String(SECONDS), "--no-stay", ...flags]);
  let log = "";
  const ended = new Promise((resolve) => run.on("close", (code) => resolve({ code, log })));
  const address = new Promise((resolve, reject) => {
    run.stderr.on("data", (data) => {
      log += data;
      const found = log.match(/watch it: (http:\/\/[^\s]+)/);
      if (found) resolve(found[1]);
    });
    run.on("close", () => reject(new Error(`it ended before it said an address:\n${log}`)));
  });
  address.catch(() => {});
  return { run, address, ended };
}

// All that comes, by topic, decoded by others' libraries.
class Watcher {
  constructor() {
    this.messages = new Map();
    this.readers = new Map();
    this.channels = new Map();
    this.times = 0;
  }
  add(channel) {
    assert.ok(!this.channels.has(channel.id), `${channel.topic} is advertised once`);
    this.channels.set(channel.id, channel);
    if (channel.encoding === "cdr") {
      assert.equal(channel.schemaEncoding ?? "ros2msg", "ros2msg");
      this.readers.set(channel.id, new MessageReader(parse(channel.schema, { ros2: true })));
    }
  }
  take(id, time, data) {
    const channel = this.channels.get(id);
    const value = channel.encoding === "json" ? JSON.parse(text.decode(data)) : this.readers.get(id).readMessage(data);
    if (!this.messages.has(channel.topic)) this.messages.set(channel.topic, []);
    this.messages.get(channel.topic).push({ time, value });
  }
  of(topic) {
    return this.messages.get(topic) ?? [];
  }
}

function watchByLibrary(url) {
  const watcher = new Watcher();
  const client = new FoxgloveClient({ ws: new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
  const ids = new Map();
  client.on("serverInfo", (info) => (watcher.info = info));
  client.on("advertise", (channels) => {
    for (const channel of channels) {
      watcher.add(channel);
      ids.set(client.subscribe(channel.id), channel.id);
    }
  });
  client.on("time", () => ++watcher.times);
  client.on("message", ({ subscriptionId, timestamp, data }) => watcher.take(ids.get(subscriptionId), timestamp, new Uint8Array(data.buffer, data.byteOffset, data.byteLength)));
  watcher.closed = new Promise((resolve) => client.on("close", resolve));
  return watcher;
}

function watchBare(url, reads = true) {
  const watcher = new Watcher();
  const socket = new WebSocket(url, ["foxglove.sdk.v1"]);
  socket.binaryType = "nodebuffer";
  watcher.closed = new Promise((resolve) => socket.on("close", resolve));
  socket.on("error", () => {});
  socket.on("message", (data, isBinary) => {
    if (!isBinary) {
      const message = JSON.parse(data);
      if (message.op === "serverInfo") watcher.info = message;
      if (message.op !== "advertise") return;
      const fresh = message.channels.filter((c) => !watcher.channels.has(c.id));
      fresh.forEach((c) => watcher.add(c));
      socket.send(JSON.stringify({ op: "subscribe", subscriptions: fresh.map((c) => ({ id: 1000 + c.id, channelId: c.id })) }));
      if (!reads) socket._socket.pause();
      return;
    }
    if (data[0] === 2) ++watcher.times;
    if (data[0] === 1) watcher.take(data.readUInt32LE(1) - 1000, data.readBigUInt64LE(5), data.subarray(13));
  });
  watcher.socket = socket;
  return watcher;
}

const rows = (file) => fs.readFileSync(file, "utf8").trim().split("\n").filter((l) => !l.startsWith("#")).map((l) => l.split(","));

function filesOf(out) {
  const hash = createHash("sha256");
  for (const name of fs.readdirSync(out, { recursive: true }).sort()) {
    const file = path.join(out, name);
    if (fs.lstatSync(file).isFile() && !/timing.json|summary.json|overview.png/.test(name)) hash.update(name).update(fs.readFileSync(file));
  }
  return hash.digest("hex");
}

function compare(watcher, out) {
  assert.equal(watcher.info.capabilities.includes("time"), true);
  assert.ok(watcher.times > SECONDS, "the clock came");
  for (const channel of watcher.channels.values()) {
    const quiet = /collisions|obstacles|events|path|diagnostics/.test(channel.topic);
    assert.ok(quiet || watcher.of(channel.topic).length > 0, `nothing came on ${channel.topic}`);
  }
  // odometry is the truth at its stamps
  const table = rows(path.join(out, "trajectory.csv"));
  const head = table[0].map((w) => w.trim());
  const column = (name) => head.findIndex((w) => w === name || w.startsWith(`${name} `) || w.startsWith(`${name}(`));
  const truth = new Map(table.slice(1).map((r) => [Math.round(1e9 * Number(r[0])), r]));
  const px = head.findIndex((w) => /^(p_?x|x)\b/.test(w));
  let compared = 0;
  const run = watcher.of("/pointflight/run")[0].value;
  for (const { value } of watcher.of("/drone0/odom")) {
    const stamp = BigInt(value.header.stamp.sec) * 1000000000n + BigInt(value.header.stamp.nanosec ?? value.header.stamp.nsec) - BigInt(run.epoch);
    const row = truth.get(Number(stamp));
    if (!row) continue;
    const p = value.pose.pose.position;
    [p.x, p.y, p.z].forEach((v, i) => assert.ok(Math.abs(v - Number(row[px + i])) < 1e-5, `odometry ${v}, truth ${row[px + i]}`));
    ++compared;
  }
  assert.ok(compared > 100, `${compared} of ${watcher.of("/drone0/odom").length} odometries compared`);
  // clouds have the points of the run's files
  const scans = rows(path.join(out, "scans.csv")).slice(1);
  const clouds = watcher.of("/drone0/mid360/points");
  const sizes = scans.map((r) => {
    const pcd = fs.readFileSync(path.join(out, r[0]));
    return Number(pcd.subarray(0, 600).toString("latin1").match(/POINTS (\d+)/)[1]);
  });
  const last = sizes.slice(-clouds.length);
  assert.deepEqual(clouds.map((c) => c.value.width * c.value.height), last, "points per scan");
  assert.deepEqual(watcher.of("/pointflight/drone0/mid360").slice(-3).map((c) => c.value.width), sizes.slice(-3));
  const pcd = fs.readFileSync(path.join(out, scans.at(-1)[0]));
  const body = pcd.indexOf("DATA binary\n") + 12;
  const cloud = clouds.at(-1).value;
  const field = Object.fromEntries(cloud.fields.map((f) => [f.name, f.offset]));
  const data = Buffer.from(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  for (let i = 0; i < cloud.width; i += 97) {
    for (const [k, name] of ["x", "y", "z"].entries()) {
      assert.equal(data.readFloatLE(i * cloud.point_step + field[name]), pcd.readFloatLE(body + 28 * i + 4 * k));
    }
  }
}

const alone = fly(path.join(folder, "alone"), ["--rate", "1", "--no-scans"]);
const watched = fly(path.join(folder, "watched"), ["--view", "127.0.0.1:0", "--rate", "1"]);
const url = (await watched.address).replace("http", "ws");
const library = watchByLibrary(url);
const bare = watchBare(url);
const others = Array.from({ length: 7 }, () => watchBare(url));
const deaf = watchBare(url, false);
const { code, log } = await watched.ended;
assert.ok(code <= 1, log); // 1: its mission is longer
await Promise.all([library.closed, bare.closed, ...others.map((o) => o.closed)]);
deaf.socket.terminate();
await alone.ended;
for (const watcher of [library, bare]) compare(watcher, path.join(folder, "watched"));
for (const watcher of others) assert.ok(watcher.of("/pointflight/state").length > 10);
// the same bytes as without viewers
const plain = fly(path.join(folder, "plain"), ["--rate", "max"]);
assert.ok((await plain.ended).code <= 1);
assert.equal(filesOf(path.join(folder, "plain")), filesOf(path.join(folder, "watched")), "viewers changed the run");
console.log(`library: ${[...library.messages.values()].reduce((n, m) => n + m.length, 0)} messages on ${library.messages.size} channels`);

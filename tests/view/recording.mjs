// Recordings at the port of `view FILE.mcap`: what a bare WebSocket gets is byte for byte what @mcap/core
// reads from the file, from the start and after jumps; a file in others' ways (no chunks, ROS 1, JSON) as well.
// Arguments: program, folder of node_modules, folder to work in, map.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [, , program, modules, folder, map] = process.argv;
const require = createRequire(path.resolve(modules, "x.js"));
if (!fs.existsSync(path.join(modules, "@mcap/core")) || !fs.existsSync(path.join(modules, "ws"))) {
  console.log("@mcap/core and ws are not there; ./dev test fetches them");
  process.exit(77);
}
const WebSocket = require("ws");
const { McapStreamReader, McapWriter } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");
fs.mkdirSync(folder, { recursive: true });

async function messagesIn(file) {
  const reader = new McapStreamReader({ decompressHandlers: await loadDecompressHandlers() });
  reader.append(fs.readFileSync(file));
  const [messages, channels, schemas] = [[], new Map(), new Map()];
  for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Message") messages.push({ topic: channels.get(record.channelId).topic, time: record.logTime, data: Buffer.from(record.data) });
  }
  return { messages, channels: [...channels.values()], schemas };
}

const until = async (what, condition) => {
  for (const start = Date.now(); Date.now() - start < 300000; ) {
    if (condition()) return;
    await new Promise((r) => setTimeout(r, 20));
  }
  assert.fail(`${what}: not within five minutes`);
};

async function view(file) {
  const child = spawn(program, ["view", file, "--at", "127.0.0.1:0"]);
  let log = "";
  const address = await new Promise((resolve, reject) => {
    child.stderr.on("data", (data) => {
      log += data;
      const found = log.match(/watch it: (http:\/\/[^\s]+)/);
      if (found) resolve(found[1]);
    });
    child.on("close", () => reject(new Error(log)));
  });
  const client = { child, messages: [], channels: new Map(), states: [] };
  const socket = new WebSocket(address.replace("http", "ws"), ["foxglove.sdk.v1"]);
  socket.binaryType = "nodebuffer";
  socket.on("message", (data, isBinary) => {
    if (!isBinary) {
      const message = JSON.parse(data);
      if (message.op === "serverInfo") client.info = message;
      if (message.op === "advertise") for (const c of message.channels) client.channels.set(c.id, c);
    } else if (data[0] === 1) {
      client.messages.push({ topic: client.channels.get(data.readUInt32LE(1)).topic, time: data.readBigUInt64LE(5), data: data.subarray(13) });
    } else if (data[0] === 5) {
      client.states.push({ status: data[1], time: data.readBigUInt64LE(2), speed: data.readFloatLE(10), didSeek: data[14] === 1 });
    }
  });
  await until("channels", () => client.channels.size > 0);
  client.subscribe = () => socket.send(JSON.stringify({ op: "subscribe", subscriptions: [...client.channels.keys()].map((id) => ({ id, channelId: id })) }));
  client.control = (play, speed, seek) => {
    const frame = Buffer.alloc(19);
    frame[0] = 3;
    frame[1] = play ? 0 : 1;
    frame.writeFloatLE(speed, 2);
    frame[6] = seek === undefined ? 0 : 1;
    frame.writeBigInt64LE(seek ?? 0n, 7);
    socket.send(frame);
  };
  client.end = async () => {
    socket.terminate();
    child.kill("SIGINT");
    await new Promise((r) => child.on("close", r));
  };
  return client;
}

const same = (got, expected, what) => {
  assert.equal(got.length, expected.length, `${what}: ${got.length} messages, ${expected.length} in the file`);
  got.forEach((m, i) => {
    const e = expected[i];
    assert.ok(m.topic === e.topic && m.time === e.time && m.data.equals(e.data), `${what}: message ${i} is ${m.topic} at ${m.time}, in the file ${e.topic} at ${e.time}`);
  });
};
// of equal times, readers may give one or the other first
const sorted = (messages) => messages.map((m, i) => [m, i]).sort(([a, i], [b, j]) => (a.time < b.time ? -1 : a.time > b.time ? 1 : a.topic < b.topic ? -1 : a.topic > b.topic ? 1 : i - j)).map(([m]) => m);

async function compare(file, latched) {
  const truth = await messagesIn(file);
  const client = await view(file);
  for (const channel of truth.channels) {
    const shown = [...client.channels.values()].find((c) => c.topic === channel.topic);
    const schema = truth.schemas.get(channel.schemaId);
    assert.equal(shown.encoding, channel.messageEncoding);
    assert.equal(shown.schemaName, schema?.name ?? "");
    assert.equal(shown.schema, schema ? Buffer.from(schema.data).toString() : "");
  }
  const ns = (t) => BigInt(t.sec) * 1_000_000_000n + BigInt(t.nsec);
  const start = truth.messages[0].time;
  const end = truth.messages.at(-1).time;
  assert.equal(ns(client.info.dataStartTime), start);
  assert.equal(ns(client.info.dataEndTime), end);
  // all of it, as fast as it goes
  client.control(true, 1000);
  client.subscribe();
  await until("the end", () => client.states.some((s) => s.status === 3));
  same(sorted(client.messages), sorted(truth.messages), "from the start");
  assert.equal(client.states.at(-1).time, end);
  // to the middle and on; what latched topics held comes first
  const middle = start + (end - start) / 2n;
  client.messages.length = client.states.length = 0;
  client.control(false, 1000, middle);
  await until("the jump", () => client.states.some((s) => s.didSeek && s.time === middle));
  const runUp = middle - 250_000_000n;
  const held = latched.map((topic) => truth.messages.filter((m) => m.topic === topic && m.time < runUp).at(-1)).filter(Boolean);
  const before = truth.messages.filter((m) => m.time >= runUp && m.time <= middle);
  await until("what was then", () => client.messages.length >= held.length + before.length);
  await new Promise((r) => setTimeout(r, 200));
  same(sorted(client.messages.slice(0, held.length)), sorted(held), "latched");
  same(sorted(client.messages.slice(held.length)), sorted(before), "before the jump's time");
  client.messages.length = 0;
  client.control(true, 1000);
  await until("the end", () => client.states.some((s) => s.status === 3));
  same(sorted(client.messages), sorted(truth.messages.filter((m) => m.time > middle)), "after the jump");
  await client.end();
  return truth.messages.length;
}

// one of ours
const ours = path.join(folder, "ours.mcap");
const flight = spawn(program, ["fly", map, "-o", path.join(folder, "run"), "--force", "--record", ours, "--seed", "3", "--duration", "3"]);
await new Promise((r) => flight.on("close", r));
const flown = await compare(ours, ["/tf_static", "/map", "/drone0/mid360/camera_info"]);

// one of others: no chunks, three encodings
const theirs = path.join(folder, "theirs.mcap");
const file = fs.openSync(theirs, "w");
let size = 0n;
const writer = new McapWriter({ writable: { position: () => size, write: async (bytes) => ((size += BigInt(bytes.length)), void fs.writeSync(file, bytes)) }, useChunks: false });
await writer.start({ profile: "", library: "test" });
const json = await writer.registerSchema({ name: "a", encoding: "jsonschema", data: Buffer.from("{}") });
const ros1 = await writer.registerSchema({ name: "std_msgs/String", encoding: "ros1msg", data: Buffer.from("string data") });
const channels = [
  await writer.registerChannel({ topic: "/json", schemaId: json, messageEncoding: "json", metadata: new Map() }),
  await writer.registerChannel({ topic: "/text", schemaId: ros1, messageEncoding: "ros1", metadata: new Map() }),
  await writer.registerChannel({ topic: "/none", schemaId: 0, messageEncoding: "bytes", metadata: new Map() }),
];
for (let i = 0; i < 300; ++i) {
  const time = 1_700_000_000_000_000_000n + 10_000_000n * BigInt(i);
  await writer.addMessage({ channelId: channels[i % 3], sequence: i, logTime: time, publishTime: time, data: Buffer.from(`{"i": ${i}}`) });
}
await writer.end();
fs.closeSync(file);
const foreign = await compare(theirs, []);
console.log(`${flown} messages of our own recording, ${foreign} of a foreign one`);

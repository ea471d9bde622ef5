// Reads a recording with Foxglove's own libraries and prints every message as a line of JSON:
// an independent reader for the tests. node read_mcap.js NODE_FOLDER FILE
//
// It reads the file twice: as a stream, checksums and all, and through its indices; both must give
// the same messages. Exit code 1 with a reason if they do not.
const { createRequire } = require("node:module");
const fs = require("node:fs");

const [folder, path] = process.argv.slice(2);
const load = createRequire(folder + "/from-here.js");
const { McapStreamReader, McapIndexedReader } = load("@mcap/core");
const { loadDecompressHandlers } = load("@mcap/support");
const { parse } = load("@foxglove/rosmsg");
const { MessageReader } = load("@foxglove/rosmsg2-serialization");

/// A file as @mcap/core's indexed reader wants it.
class FileReadable {
  constructor(bytes) {
    this.bytes = bytes;
  }
  async size() {
    return BigInt(this.bytes.length);
  }
  async read(offset, size) {
    return new Uint8Array(this.bytes.buffer, this.bytes.byteOffset + Number(offset), Number(size));
  }
}

/// Messages as JSON: numbers as they are, long arrays by their length and first items.
function plain(value) {
  if (typeof value === "bigint") return Number(value);
  if (ArrayBuffer.isView(value)) value = Array.from(value, plain);
  if (Array.isArray(value)) {
    const items = value.slice(0, 64).map(plain);
    return value.length > 64 ? { length: value.length, first: items } : items;
  }
  if (value !== null && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, plain(v)]));
  }
  return value;
}

async function main() {
  const decompressHandlers = await loadDecompressHandlers();
  const bytes = fs.readFileSync(path);
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(bytes);
  const schemas = new Map();
  const channels = new Map();
  const attachments = [];
  let header;
  let streamed = [];
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Header") header = record;
    if (record.type === "Schema") {
      const text = new TextDecoder().decode(record.data);
      schemas.set(record.id, { ...record, reader: new MessageReader(parse(text, { ros2: true })) });
    }
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Attachment") attachments.push(record.name);
    if (record.type === "Message") streamed.push(record);
  }
  const cut = process.argv[4] === "cut";
  if (!cut) {
    if (!reader.done()) throw new Error("the stream does not end");
    const indexed = await McapIndexedReader.Initialize({
      readable: new FileReadable(bytes),
      decompressHandlers,
    });
    let count = 0;
    for await (const message of indexed.readMessages({ validateCrcs: true })) {
      count += message.data.length > 0 ? 1 : 0;
    }
    if (count !== streamed.length) throw new Error(`${count} by index, ${streamed.length} streamed`);
    if (Number(indexed.statistics.messageCount) !== count) throw new Error("statistics differ");
    if (indexed.chunkIndexes.length !== indexed.statistics.chunkCount) throw new Error("chunks");
  }
  const lines = [JSON.stringify({ profile: header.profile, attachments })];
  for (const record of streamed) {
    const channel = channels.get(record.channelId);
    const schema = schemas.get(channel.schemaId);
    lines.push(
      JSON.stringify({
        topic: channel.topic,
        type: schema.name,
        hash: channel.metadata.get("topic_type_hash"),
        time: record.logTime.toString(),
        message: plain(schema.reader.readMessage(record.data)),
      }),
    );
  }
  process.stdout.write(lines.join("\n") + "\n");
}

main().catch((error) => {
  process.stderr.write(`${error.message}\n`);
  process.exitCode = 1;
});

// A client of the WebSocket that Foxglove and Lichtblick use too.

const OPCODE = { message: 1, time: 2, service: 3, playback: 5 };
const text = new TextDecoder();

// Calls handlers by topic; connects again when the run ends and another begins.
export class Client {
  constructor(url, handlers) {
    this.url = url;
    this.handlers = handlers;
    this.connect();
  }

  connect() {
    this.channels = new Map(); // by id
    this.topics = new Map(); // subscription id -> topic
    this.wanted ??= new Map(); // topic -> handler
    this.next = 1;
    this.capabilities = [];
    this.orders = null;
    this.socket = new WebSocket(this.url, ["foxglove.sdk.v1", "foxglove.websocket.v1"]);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.handlers.open?.();
    this.socket.onclose = () => {
      this.handlers.close?.();
      setTimeout(() => this.connect(), 1000);
    };
    this.socket.onmessage = (event) =>
      typeof event.data === "string" ? this.take(JSON.parse(event.data)) : this.takeBinary(event.data);
  }

  want(topic, handler) {
    this.wanted.set(topic, handler);
    for (const channel of this.channels.values()) this.subscribe(channel);
  }

  subscribe(channel) {
    if (!this.wanted.has(channel.topic) || channel.subscription) return;
    channel.subscription = this.next++;
    this.topics.set(channel.subscription, channel.topic);
    this.send({ op: "subscribe", subscriptions: [{ id: channel.subscription, channelId: channel.id }] });
  }

  take(message) {
    if (message.op === "serverInfo") {
      if (this.session && this.session !== message.sessionId) this.handlers.session?.();
      this.session = message.sessionId;
      this.capabilities = message.capabilities;
      if (this.capabilities.includes("clientPublish") && this.orders === null) {
        this.orders = 1;
        this.send({
          op: "advertise",
          channels: [{ id: 1, topic: "/pointflight/order", encoding: "json", schemaName: "pointflight.Order" }],
        });
      }
      this.handlers.info?.(message);
    } else if (message.op === "advertise") {
      for (const channel of message.channels) {
        if (!this.channels.has(channel.id)) this.channels.set(channel.id, channel);
        this.subscribe(this.channels.get(channel.id));
      }
    } else if (message.op === "status") {
      this.handlers.status?.(message);
    }
  }

  takeBinary(buffer) {
    const view = new DataView(buffer);
    if (view.getUint8(0) !== OPCODE.message) return;
    const topic = this.topics.get(view.getUint32(1, true));
    if (topic) this.wanted.get(topic)(new Uint8Array(buffer, 13), view.getBigUint64(5, true));
  }

  send(value) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(value));
  }

  get mayCommand() {
    return this.orders !== null && this.socket.readyState === WebSocket.OPEN;
  }

  order(value) {
    if (!this.mayCommand) return;
    const body = new TextEncoder().encode(JSON.stringify(value));
    const frame = new Uint8Array(5 + body.length);
    frame[0] = OPCODE.message;
    new DataView(frame.buffer).setUint32(1, this.orders, true);
    frame.set(body, 5);
    this.socket.send(frame);
  }
}

export const json = (bytes) => JSON.parse(text.decode(bytes));

// sensor_msgs/PointCloud2 in CDR, little endian: its fields as typed arrays.
export function cloudOf(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = 4;
  const align = (size) => (at = 4 + Math.ceil((at - 4) / size) * size);
  const u32 = () => (align(4), (at += 4), view.getUint32(at - 4, true));
  const string = () => {
    const size = u32();
    const value = text.decode(bytes.subarray(at, at + size - 1));
    at += size;
    return value;
  };
  u32(); // stamp
  u32();
  string();
  const height = u32();
  const width = u32();
  const fields = new Map();
  for (let left = u32(); left > 0; --left) {
    const name = string();
    const offset = u32();
    const type = view.getUint8(at++);
    u32();
    fields.set(name, { offset, type });
  }
  at += 1;
  const step = u32();
  u32();
  const size = u32();
  const count = Math.min(width * height, Math.floor(size / step));
  const positions = new Float32Array(3 * count);
  const intensities = new Float32Array(count);
  const times = new Float32Array(count); // s after the first
  const t = fields.get("t");
  for (let i = 0; i < count; ++i) {
    const row = at + i * step;
    positions[3 * i] = view.getFloat32(row + fields.get("x").offset, true);
    positions[3 * i + 1] = view.getFloat32(row + fields.get("y").offset, true);
    positions[3 * i + 2] = view.getFloat32(row + fields.get("z").offset, true);
    intensities[i] = view.getFloat32(row + fields.get("intensity").offset, true);
    if (t) times[i] = 1e-9 * view.getUint32(row + t.offset, true);
  }
  return { count, positions, intensities, times };
}

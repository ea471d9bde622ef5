// A client of the WebSocket that Foxglove and Lichtblick use too.

const OPCODE = { message: 1, time: 2, service: 3, playback: 5 };
const text = new TextDecoder();

// Calls handlers by topic, with a message's bytes, its time (ns, a BigInt) and its channel; connects again when the run ends and another begins.
export class Client {
  constructor(url, handlers) {
    this.url = url;
    this.handlers = handlers;
    this.connect();
  }

  connect() {
    this.channels = new Map(); // by id
    this.subscribed = new Map(); // subscription id -> channel
    this.wanted ??= new Map(); // topic -> handler
    this.waiting = new Map(); // topic -> what is left to be done with its last message
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

  // With `latest`, of messages that come faster than frames only the last one counts: it waits for `deliver`.
  want(topic, handler, { latest = false } = {}) {
    const keep = (...message) => this.waiting.set(topic, () => handler(...message));
    this.wanted.set(topic, latest ? keep : handler);
    for (const channel of this.channels.values()) this.subscribe(channel);
  }

  // Once per frame: a machine that draws slowly does not fall behind the run.
  deliver() {
    const waiting = [...this.waiting.values()];
    this.waiting.clear();
    for (const handle of waiting) handle();
  }

  leave(topic) {
    this.wanted.delete(topic);
    this.waiting.delete(topic);
    for (const channel of this.channels.values()) {
      if (channel.topic !== topic || !channel.subscription) continue;
      this.send({ op: "unsubscribe", subscriptionIds: [channel.subscription] });
      this.subscribed.delete(channel.subscription);
      channel.subscription = null;
    }
  }

  subscribe(channel) {
    if (!this.wanted.has(channel.topic) || channel.subscription) return;
    channel.subscription = this.next++;
    this.subscribed.set(channel.subscription, channel);
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
      this.handlers.channels?.([...this.channels.values()]);
    } else if (message.op === "status") {
      this.handlers.status?.(message);
    }
  }

  takeBinary(buffer) {
    const view = new DataView(buffer);
    const opcode = view.getUint8(0);
    if (opcode === OPCODE.message) {
      const channel = this.subscribed.get(view.getUint32(1, true));
      this.wanted.get(channel?.topic)?.(new Uint8Array(buffer, 13), view.getBigUint64(5, true), channel);
    } else if (opcode === OPCODE.time) {
      this.handlers.time?.(view.getBigUint64(1, true));
    } else if (opcode === OPCODE.playback) {
      this.deliver(); // in order
      this.handlers.playback?.({
        isPlaying: view.getUint8(1) === 0,
        time: view.getBigUint64(2, true),
        speed: view.getFloat32(10, true),
        didSeek: view.getUint8(14) !== 0,
      });
    }
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

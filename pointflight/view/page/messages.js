// Messages of a recording by the definitions that lie in it: CDR of ROS 2, ROS 1's own format, JSON.
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const text = new TextDecoder();

// Reads bytes by a channel's schema; null if nobody here can.
export function decoderOf({ encoding, schema, schemaEncoding }) {
  try {
    if (encoding === "json") return (bytes) => JSON.parse(text.decode(bytes));
    if (encoding === "cdr" && schemaEncoding === "ros2msg") {
      const reader = new MessageReader(parse(schema, { ros2: true }));
      return (bytes) => reader.readMessage(bytes);
    }
    if (encoding === "ros1" && schemaEncoding === "ros1msg") return ros1Decoder(parse(schema));
  } catch {
    // a definition that is none
  }
  return null;
}

// "nav_msgs/msg/Odometry" and "nav_msgs/Odometry" are one.
export const plainName = (schemaName) => schemaName.replace("/msg/", "/");

const SIZES = { bool: 1, byte: 1, char: 1, int8: 1, uint8: 1, int16: 2, uint16: 2, int32: 4, uint32: 4, int64: 8, uint64: 8, float32: 4, float64: 8 };

// Little endian, one field after the other (wiki.ros.org/msg).
function ros1Decoder(definitions) {
  const byName = new Map(definitions.map((d) => [d.name, d.definitions]));
  const root = definitions.find((d) => d.name === undefined) ?? definitions[0];
  return (bytes) => {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let at = 0;
    const u32 = () => ((at += 4), view.getUint32(at - 4, true));
    const number = (type) => {
      at += SIZES[type];
      const from = at - SIZES[type];
      if (type === "bool") return view.getUint8(from) !== 0;
      if (type === "uint8" || type === "char") return view.getUint8(from);
      if (type === "int8" || type === "byte") return view.getInt8(from);
      if (type === "int16") return view.getInt16(from, true);
      if (type === "uint16") return view.getUint16(from, true);
      if (type === "int32") return view.getInt32(from, true);
      if (type === "uint32") return view.getUint32(from, true);
      if (type === "int64") return view.getBigInt64(from, true);
      if (type === "uint64") return view.getBigUint64(from, true);
      return type === "float32" ? view.getFloat32(from, true) : view.getFloat64(from, true);
    };
    const value = (field) => {
      if (field.isComplex) return message(byName.get(field.type));
      if (field.type === "string") {
        const size = u32();
        at += size;
        return text.decode(bytes.subarray(at - size, at));
      }
      if (field.type === "time" || field.type === "duration") return { sec: u32(), nsec: u32() };
      return number(field.type);
    };
    const message = (fields) => {
      const out = {};
      for (const field of fields) {
        if (field.isConstant) continue;
        if (!field.isArray) {
          out[field.name] = value(field);
          continue;
        }
        const count = field.arrayLength ?? u32();
        if (field.type === "uint8") {
          out[field.name] = bytes.subarray(at, (at += count));
          continue;
        }
        if (count > bytes.length) throw new Error("an array longer than its message");
        out[field.name] = Array.from({ length: count }, () => value(field));
      }
      return out;
    };
    return message(root.definitions);
  };
}

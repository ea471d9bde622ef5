// Points: from messages to what is drawn, the last scan or those of the last seconds.
import * as THREE from "three";
import { turbo } from "./colours.js";

// sensor_msgs/PointField
const READ = {
  1: (v, at) => v.getInt8(at),
  2: (v, at) => v.getUint8(at),
  3: (v, at) => v.getInt16(at, true),
  4: (v, at) => v.getUint16(at, true),
  5: (v, at) => v.getInt32(at, true),
  6: (v, at) => v.getUint32(at, true),
  7: (v, at) => v.getFloat32(at, true),
  8: (v, at) => v.getFloat64(at, true),
};
const TIMES = ["t", "time", "timestamp", "time_stamp", "offset_time"];

// fields: name -> { offset, type }; data: a DataView of the rows. Points that are none (NaN, zero) are left out.
export function cloudFrom(fields, data, count, step) {
  const at = ["x", "y", "z"].map((name) => fields.get(name));
  if (at.some((f) => !f || !READ[f.type])) return null;
  count = Math.max(0, Math.min(count, Math.floor(data.byteLength / step)));
  const positions = new Float32Array(3 * count);
  const times = new Float32Array(count); // of the first in the cloud's own unit
  const time = TIMES.map((name) => fields.get(name)).find((f) => f && READ[f.type]);
  const [x, y, z] = at;
  let kept = 0;
  let first = null;
  for (let i = 0; i < count; ++i) {
    const row = i * step;
    const px = READ[x.type](data, row + x.offset);
    const py = READ[y.type](data, row + y.offset);
    const pz = READ[z.type](data, row + z.offset);
    if (!Number.isFinite(px + py + pz) || (px === 0 && py === 0 && pz === 0)) continue;
    positions[3 * kept] = px;
    positions[3 * kept + 1] = py;
    positions[3 * kept + 2] = pz;
    if (time) {
      const t = READ[time.type](data, row + time.offset);
      first ??= t;
      times[kept] = t - first;
    }
    ++kept;
  }
  return { count: kept, positions: positions.subarray(0, 3 * kept), times: times.subarray(0, kept), hasTimes: Boolean(time) };
}

// sensor_msgs/PointCloud2, decoded; null if it cannot be read.
export function cloudOfMessage(message) {
  const fields = new Map(message.fields.map((f) => [f.name, { offset: f.offset, type: f.datatype }]));
  const { data } = message;
  if (message.is_bigendian) return null;
  return cloudFrom(fields, new DataView(data.buffer, data.byteOffset, data.byteLength), message.width * message.height, message.point_step);
}

// livox_ros_driver(2)/CustomMsg
export function cloudOfLivox(message) {
  const { points } = message;
  const positions = new Float32Array(3 * points.length);
  const times = new Float32Array(points.length);
  let kept = 0;
  for (const { x, y, z, offset_time } of points) {
    if (x === 0 && y === 0 && z === 0) continue;
    positions.set([x, y, z], 3 * kept);
    times[kept++] = offset_time;
  }
  return { count: kept, positions: positions.subarray(0, 3 * kept), times: times.subarray(0, kept), hasTimes: true };
}

const vertexOfScan = `
in float age;
uniform float size, older;
uniform bool byHeight;
uniform vec2 heights;
uniform vec3 tint;
out vec4 shade;
${turbo}
void main() {
  float fade = (1.0 - 0.7 * age) * (1.0 - 0.75 * older);
  vec4 world = modelMatrix * vec4(position, 1.0);
  // a little nearer on the same sight line: points lie on what they measured and would sink into it;
  // not by way of the world, where single precision may be coarse
  gl_Position = projectionMatrix * vec4(0.98 * (modelViewMatrix * vec4(position, 1.0)).xyz, 1.0);
  gl_PointSize = size;
  shade = byHeight ? vec4(linear(turboOfHeight(world.z, heights)), 1.0) : vec4(tint, fade);
}`;
const fragmentOfScan = `
precision highp float;
in vec4 shade;
out vec4 colour;
void main() {
  if (length(gl_PointCoord - 0.5) > 0.5) discard;
  colour = shade;
}`;

// Scans of one sensor: the last one, brighter the younger a point is, and those before it for `keep` seconds.
export class ScanTrail {
  static MOST = 2_000_000; // points of all that are kept

  constructor(scene, colour, heights) {
    this.scene = scene;
    this.colour = colour;
    this.heights = heights;
    this.scans = []; // { points, t }, the last one last
    this.keep = 0;
    this.visible = true;
    this.byHeight = false;
  }

  // cloud: in the world, or where `matrix` takes it to the world; t: seconds of the run
  add(cloud, t, matrix = null) {
    this.cloud = cloud;
    const geometry = new THREE.BufferGeometry();
    const last = cloud.times.reduce((a, b) => Math.max(a, b), 0) || 1;
    const ages = cloud.hasTimes ? Float32Array.from(cloud.times, (s) => 1 - s / last) : new Float32Array(cloud.count);
    geometry.setAttribute("position", new THREE.BufferAttribute(cloud.positions, 3));
    geometry.setAttribute("age", new THREE.BufferAttribute(ages, 1));
    const material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      transparent: !this.byHeight,
      depthWrite: this.byHeight,
      uniforms: {
        size: { value: 3 * Math.min(devicePixelRatio, 2) },
        older: { value: 0 },
        byHeight: { value: this.byHeight },
        heights: this.heights,
        tint: { value: this.colour },
      },
      vertexShader: vertexOfScan,
      fragmentShader: fragmentOfScan,
    });
    const points = new THREE.Points(geometry, material);
    points.frustumCulled = false;
    points.visible = this.visible;
    if (matrix) {
      points.matrixAutoUpdate = false;
      points.matrix.copy(matrix);
    }
    this.scene.add(points);
    if (this.scans.length > 0 && t < this.scans.at(-1).t) this.clear(); // it jumped back
    this.scans.push({ points, t });
    this.forgetOld(t);
  }

  forgetOld(t) {
    let total = this.scans.reduce((sum, s) => sum + s.points.geometry.getAttribute("position").count, 0);
    while (this.scans.length > 1 && (t - this.scans[0].t > this.keep || total > ScanTrail.MOST)) {
      const { points } = this.scans.shift();
      total -= points.geometry.getAttribute("position").count;
      this.drop(points);
    }
    for (const { points, t: then } of this.scans) {
      const isLast = points === this.scans.at(-1).points;
      points.material.uniforms.older.value = isLast ? 0 : Math.max(0.5, Math.min(1, (t - then) / Math.max(1, this.keep)));
      points.material.depthWrite = this.byHeight || !isLast;
    }
  }

  drop(points) {
    this.scene.remove(points);
    points.geometry.dispose();
    points.material.dispose();
  }

  clear() {
    for (const { points } of this.scans.splice(0)) this.drop(points);
  }

  show(visible) {
    this.visible = visible;
    for (const { points } of this.scans) points.visible = visible;
  }
}

// A recording: its topics as they lie there, those of the usual types drawn.
import * as THREE from "three";
import { ScanTrail, cloudOfLivox, cloudOfMessage } from "./clouds.js";
import { Frames, matrixOf, plainFrame, secondsOf } from "./frames.js";
import { Markers } from "./markers.js";
import { decoderOf, plainName } from "./messages.js";
import { Vehicle, append, colourOf, line } from "./vehicles.js";

const CLOUDS = { "sensor_msgs/PointCloud2": cloudOfMessage, "livox_ros_driver2/CustomMsg": cloudOfLivox, "livox_ros_driver/CustomMsg": cloudOfLivox };
const LARGE = 20_000; // bytes of a cloud that may be a place

// What is known of a vehicle that only its odometry tells of.
const bodyOf = (name) => ({
  name,
  parts: [{ shape: { kind: "box", half: [0.18, 0.18, 0.05] }, p: [0, 0, 0], q: [1, 0, 0, 0] }],
  propellers: [],
  mission: [],
  lidars: [],
});

export class Recording {
  // heights: the map's, of colours; say: lines for the person
  constructor(scene, tags, client, heights, say) {
    Object.assign(this, { scene, tags, client, heights, say });
    this.frames = new Frames();
    this.vehicles = [];
    this.topics = []; // { channel, isOn, isDrawn, count, ... }
    this.trails = [];
    this.warned = new Set();
    this.start = 0n;
    this.keep = 0;
  }

  // All channels that the server has told of so far.
  adopt(channels) {
    for (const channel of channels) {
      if (this.topics.some((t) => t.channel.topic === channel.topic)) continue;
      const kind = plainName(channel.schemaName);
      const decode = decoderOf(channel);
      const topic = { channel, kind, count: 0, isOn: true, isDrawn: false };
      this.topics.push(topic);
      const draw = decode && this.drawerOf(topic);
      if (!draw) continue;
      topic.isDrawn = true;
      topic.handler = (bytes, stamp) => {
        ++topic.count;
        try {
          draw(decode(bytes), Number(stamp - this.start) * 1e-9, bytes.length);
        } catch (error) {
          this.warn(`${channel.topic}: ${error.message}`);
        }
      };
    }
    this.topics.sort((a, b) => (a.channel.topic < b.channel.topic ? -1 : 1));
    // of points and their like in another frame (points, points_world) one is enough
    for (const topic of this.topics) {
      const isLike = (other) => other !== topic && CLOUDS[other.kind] && topic.channel.topic.startsWith(other.channel.topic);
      if (CLOUDS[topic.kind] && topic.isDrawn && this.topics.some(isLike)) topic.isOn = false;
      if (topic.isDrawn) this.show(topic, topic.isOn);
    }
  }

  show(topic, isOn) {
    topic.isOn = isOn;
    // poses are all taken: clouds lie where their sensors were then
    const latest = Boolean(CLOUDS[topic.kind]) || topic.kind === "nav_msgs/Path";
    if (isOn) this.client.want(topic.channel.topic, topic.handler, { latest });
    else this.client.leave(topic.channel.topic);
    topic.toggle?.(isOn);
  }

  warn(words) {
    if (this.warned.has(words)) return;
    this.warned.add(words);
    this.say(words, true);
  }

  // Takes what a topic's messages say into the scene; nothing if nobody knows how.
  drawerOf(topic) {
    const { kind } = topic;
    if (kind === "tf2_msgs/TFMessage" || kind === "tf/tfMessage") {
      const isStatic = topic.channel.topic.endsWith("tf_static");
      return (m) => this.takeTransforms(m.transforms, isStatic);
    }
    if (kind === "nav_msgs/Odometry") return this.poseDrawer(topic, (m) => m.pose.pose, (m) => m.child_frame_id, (m) => m.twist.twist);
    if (kind === "geometry_msgs/PoseStamped") return this.poseDrawer(topic, (m) => m.pose, () => "", () => null);
    if (kind === "nav_msgs/Path") return this.pathDrawer(topic);
    if (CLOUDS[kind]) return this.cloudDrawer(topic, CLOUDS[kind]);
    if (kind.startsWith("visualization_msgs/Marker")) return this.markerDrawer(topic);
    return null;
  }

  takeTransforms(transforms, isStatic) {
    for (const { header, child_frame_id, transform } of transforms) {
      this.frames.set(header.frame_id, child_frame_id, secondsOf(header.stamp), matrixOf(transform.translation, transform.rotation), true, isStatic);
    }
  }

  poseDrawer(topic, poseOf, childOf, twistOf) {
    let vehicle = null;
    topic.toggle = (isOn) => vehicle?.show(isOn);
    return (message, t) => {
      const child = plainFrame(childOf(message));
      if (!vehicle) {
        vehicle = new Vehicle(this.scene, this.tags, bodyOf(this.nameOf(topic, child)), this.vehicles.length);
        vehicle.frame = child;
        this.vehicles.push(vehicle);
        this.onVehicle?.(vehicle);
      }
      const { position, orientation } = poseOf(message);
      const stamp = secondsOf(message.header.stamp);
      this.frames.set(message.header.frame_id, child, stamp, matrixOf(position, orientation), false);
      const world = this.frames.toRoot(message.header.frame_id, stamp).multiply(matrixOf(position, orientation));
      const p = new THREE.Vector3();
      const q = new THREE.Quaternion();
      world.decompose(p, q, new THREE.Vector3());
      const twist = twistOf(message); // of the child's frame
      vehicle.update({ p: p.toArray(), q: [q.w, q.x, q.y, q.z], v: twist ? [twist.linear.x, twist.linear.y, twist.linear.z] : null }, t);
    };
  }

  nameOf(topic, child) {
    const parts = topic.channel.topic.split("/").filter(Boolean);
    return parts.length > 1 ? parts[0] : child || parts[0];
  }

  pathDrawer(topic) {
    let path = null;
    topic.toggle = (isOn) => path && (path.visible = isOn);
    return (message) => {
      if (path) {
        this.scene.remove(path);
        path.geometry.dispose();
      }
      path = line(new THREE.Color("#8a8f98"), Math.max(2, message.poses.length));
      const toRoot = this.frames.toRoot(message.header.frame_id, secondsOf(message.header.stamp));
      for (const { pose } of message.poses) {
        const { x, y, z } = pose.position;
        append(path, new THREE.Vector3(x, y, z).applyMatrix4(toRoot).toArray());
      }
      path.visible = topic.isOn;
      this.scene.add(path);
    };
  }

  cloudDrawer(topic, cloudOf) {
    const colour = new THREE.Color(colourOf(this.trails.length)).lerp(new THREE.Color("#ffd23f"), 0.7);
    const trail = new ScanTrail(this.scene, colour, this.heights.uniform);
    trail.topic = topic;
    trail.keep = this.keep;
    this.trails.push(trail);
    topic.toggle = (isOn) => trail.show(isOn);
    return (message, t, bytes) => {
      const cloud = cloudOf(message);
      if (!cloud) return this.warn(`${topic.channel.topic}: has no x, y, z that could be read`);
      const frame = message.header.frame_id;
      // a place rather than a scan: large, without times, in a frame that stays, and always the same one
      trail.first ??= t;
      trail.byHeight = !cloud.hasTimes && t === trail.first && bytes > LARGE && this.frames.stays(frame);
      if (trail.byHeight) this.heights.include(cloud.positions);
      trail.add(cloud, t, this.placeOf(topic, frame, secondsOf(message.header.stamp)));
      const vehicle = this.vehicles.find((v) => topic.channel.topic.startsWith(`/${v.description.name}/`)) ?? this.vehicles[0];
      if (vehicle && !trail.byHeight) this.onScan?.(vehicle, trail);
    };
  }

  // From a cloud's frame to the world; if nothing says how its sensor is mounted, at the vehicle.
  placeOf(topic, frame, stamp) {
    if (this.frames.has(frame) || this.vehicles.length !== 1) return this.frames.toRoot(frame, stamp);
    const [vehicle] = this.vehicles;
    const roots = this.vehicles.map((v) => this.frames.rootOf(v.frame));
    if (!vehicle.frame || roots.includes(plainFrame(frame))) return this.frames.toRoot(frame, stamp);
    this.warn(`${topic.channel.topic}: nothing says where ${frame} is mounted: drawn at ${vehicle.description.name}`);
    return this.frames.toRoot(vehicle.frame, stamp);
  }

  markerDrawer(topic) {
    const markers = new Markers(this.scene);
    topic.toggle = (isOn) => (markers.group.visible = isOn);
    return (message) => markers.take(message.markers ?? [message], this.frames);
  }

  setKeep(seconds) {
    this.keep = seconds;
    for (const trail of this.trails) trail.keep = seconds;
  }

  // It jumped.
  forget() {
    for (const vehicle of this.vehicles) vehicle.forget();
    for (const trail of this.trails) {
      if (!trail.byHeight) trail.clear();
    }
  }
}

// The page in the distribution's Chromium with software GL: a live flight, the same one finished, its recording,
// and one of ROS 1. Map, drone and scan are where the truth projects to, the drone moves, a double click flies it
// to a goal, keys pause and go on; nothing on the
// console. Arguments: program, folder of node_modules, folder to work in, and a picture to write, if any.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [, , program, modules, folder, picture] = process.argv;
const CHROMIUM = "/usr/bin/chromium";
const require = createRequire(path.resolve(modules, "x.js"));
let chromium;
try {
  ({ chromium } = require("playwright-core"));
} catch {
  console.log("playwright-core is not there; ./dev test fetches it");
  process.exit(77);
}
if (!fs.existsSync(CHROMIUM)) {
  console.log(`${CHROMIUM} is not there; ./dev view installs it`);
  process.exit(77);
}

// A floor of 12 x 12 m, a wall at x = 6, 3 m high, and a post.
const points = [];
for (let x = -6; x < 6; x += 0.04) for (let y = -6; y < 6; y += 0.04) points.push([x, y, 0]);
for (let y = -6; y < 6; y += 0.04) for (let z = 0; z < 3; z += 0.04) points.push([6, y, z]);
for (let a = 0; a < 6.28; a += 0.15) for (let z = 0; z < 2.5; z += 0.03) points.push([2 + 0.2 * Math.cos(a), -3 + 0.2 * Math.sin(a), z]);
const xyz = path.join(folder, "place.xyz");
const map = path.join(folder, "place.pfmap");
fs.writeFileSync(xyz, points.map((p) => p.map((v) => v.toFixed(4)).join(" ")).join("\n") + "\n");
const made = spawn(program, ["map", "import", xyz, "--resolution", "0.15", "-o", map, "--force"]);
assert.equal(await new Promise((r) => made.on("close", r)), 0);
fs.writeFileSync(
  path.join(folder, "s.yaml"),
  `map: place.pfmap\nvehicle: {start: [0, 0, 1.2]}\nlidars: [{model: os1_32}]\nobstacles:\n  - {motion: still, position: [3, 3, 0.5], shape: box, size: [1, 1, 1]}\n`,
);

// A program that serves: it, its address, and how it ends.
async function serve(...args) {
  const child = spawn(program, args);
  let log = "";
  const ended = new Promise((resolve) => child.on("close", (code) => resolve({ code, log })));
  const address = await new Promise((resolve, reject) => {
    child.stderr.on("data", (data) => {
      log += data;
      const found = log.match(/watch it: (http:\/\/[^\s]+)/);
      if (found) resolve(found[1]);
    });
    child.on("close", () => reject(new Error(log)));
  });
  return { child, address, ended };
}
const out = path.join(folder, "run");
const recording = path.join(folder, "run.mcap");
const flight = await serve("fly", path.join(folder, "s.yaml"), "-o", out, "--force", "--record", recording, "--view", "127.0.0.1:0");
const { child: run, address } = flight;
const flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const browser = await chromium.launch({ executablePath: CHROMIUM, args: ["--headless=new", ...flags] });
const wrong = []; // of all pages

// Another page of a program that serves.
async function open(at) {
  const page = await browser.newPage({ viewport: { width: 900, height: 600 } });
  page.on("pageerror", (e) => wrong.push(e.message));
  page.on("console", (m) => m.type() === "error" && wrong.push(m.text()));
  await page.goto(`${at}&budget=30000&pixels=1`);
  const wait = (what, condition, argument) => page.waitForFunction(condition, argument, { timeout: 300000, polling: 100 }).catch(() => assert.fail(`${what}: not within five minutes`));
  return { page, wait };
}

const trajectory = (run) => fs.readFileSync(path.join(run, "trajectory.csv"), "utf8").trim().split("\n").slice(1).map((l) => l.split(",").map(Number));

// Odometry of a vehicle that stands at (5, 0, 1) and looks along y, and clouds of two points in its LiDAR's
// frame, by others' libraries.
async function writeRos1(file) {
  const { McapWriter } = require("@mcap/core");
  const { MessageWriter } = require("@foxglove/rosmsg-serialization");
  const { parse } = require("@foxglove/rosmsg");
  const header = "================================================================================\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
  const vectors = ["Point", "Vector3"].map((n) => `================================================================================\nMSG: geometry_msgs/${n}\nfloat64 x\nfloat64 y\nfloat64 z\n`).join("");
  const rest = `${header}${vectors}================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
================================================================================
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
================================================================================
MSG: geometry_msgs/TwistWithCovariance
geometry_msgs/Twist twist
float64[36] covariance
`;
  const types = {
    "nav_msgs/Odometry": `Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n${rest}`,
    "sensor_msgs/PointCloud2": `Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n${header}================================================================================\nMSG: sensor_msgs/PointField\nuint8 INT8=1\nuint8 FLOAT32=7\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n`,
  };
  const out = fs.openSync(file, "w");
  let size = 0n;
  const writer = new McapWriter({ writable: { position: () => size, write: async (bytes) => ((size += BigInt(bytes.length)), void fs.writeSync(out, bytes)) } });
  await writer.start({ profile: "ros1", library: "test" });
  const channels = {};
  for (const [name, text] of Object.entries(types)) {
    const schemaId = await writer.registerSchema({ name, encoding: "ros1msg", data: Buffer.from(text) });
    const topic = name === "nav_msgs/Odometry" ? "/odom" : "/velodyne_points";
    channels[name] = { id: await writer.registerChannel({ topic, schemaId, messageEncoding: "ros1", metadata: new Map() }), writer: new MessageWriter(parse(text)) };
  }
  const data = Buffer.alloc(24);
  [2, 0, 0, 3, 1, 0].forEach((v, i) => data.writeFloatLE(v, 4 * i));
  for (let i = 0; i < 50; ++i) {
    const time = 1_700_000_000_000_000_000n + 100_000_000n * BigInt(i);
    const head = (frame_id) => ({ seq: i, stamp: { sec: Number(time / 1_000_000_000n), nsec: Number(time % 1_000_000_000n) }, frame_id });
    const pose = { position: { x: 5, y: 0, z: 1 }, orientation: { x: 0, y: 0, z: Math.SQRT1_2, w: Math.SQRT1_2 } };
    const twist = { linear: { x: 0, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } };
    const covariance = new Float64Array(36);
    const messages = {
      "nav_msgs/Odometry": { header: head("odom"), child_frame_id: "base_link", pose: { pose, covariance }, twist: { twist, covariance } },
      "sensor_msgs/PointCloud2": { header: head("lidar"), height: 1, width: 2, fields: ["x", "y", "z"].map((name, k) => ({ name, offset: 4 * k, datatype: 7, count: 1 })), is_bigendian: false, point_step: 12, row_step: 24, data, is_dense: true },
    };
    for (const [name, message] of Object.entries(messages)) {
      await writer.addMessage({ channelId: channels[name].id, sequence: i, logTime: time, publishTime: time, data: channels[name].writer.writeMessage(message) });
    }
  }
  await writer.end();
  fs.closeSync(out);
}

try {
  const opened = Date.now();
  const { page } = await open(address);
  const until = (what, condition) => page.waitForFunction(condition, null, { timeout: 300000, polling: 100 }).catch(() => assert.fail(`${what}: not within five minutes`));
  await until("the map", () => window.pointflight?.map.overviewReady);
  console.log(`first picture of the map after ${Date.now() - opened} ms`);
  await until("a state", () => window.pointflight.state.last?.vehicles[0]?.p);
  await until("a scan", () => [...window.pointflight.state.vehicles[0].scans.values()].some((s) => s.cloud?.count > 100));

  // a camera of our own: what is where it projects to
  const look = (from, to) =>
    page.evaluate(
      ([a, b]) => {
        const { camera, controls } = window.pointflight;
        document.getElementById("camera").value = "orbit";
        controls.enableDamping = false;
        camera.position.set(...a);
        controls.target.set(...b);
        controls.update();
      },
      [from, to],
    );
  // After two frames: colours where places project to, and whether each is in the picture.
  const colours = (places) =>
    page.evaluate(async (list) => {
      const { camera, THREE } = window.pointflight;
      const frames = window.pointflight.state.frames + 2;
      while (window.pointflight.state.frames < frames) await new Promise((r) => setTimeout(r, 20));
      const canvas = document.querySelector("#scene canvas");
      const copy = new OffscreenCanvas(canvas.width, canvas.height);
      const context = copy.getContext("2d");
      context.drawImage(canvas, 0, 0);
      camera.updateMatrixWorld();
      return list.map((p) => {
        const v = new THREE.Vector3(...p).project(camera);
        const x = Math.round((0.5 + 0.5 * v.x) * canvas.width);
        const y = Math.round((0.5 - 0.5 * v.y) * canvas.height);
        const seen = Math.abs(v.z) < 1 && x >= 0 && y >= 0 && x < canvas.width && y < canvas.height;
        return { x, y, seen, rgb: [...context.getImageData(x, y, 1, 1).data].slice(0, 3) };
      });
    }, places);
  const paper = [0x10, 0x12, 0x16];
  const isPaper = ({ rgb }) => rgb.every((v, i) => Math.abs(v - paper[i]) < 12);

  await look([-9, 0, 6], [2, 0, 0.5]);
  const hideScans = (hide) => page.evaluate((h) => { const box = document.getElementById("scans"); if (box.checked === h) box.click(); }, hide);
  await hideScans(true);
  const there = [];
  for (let y = -5; y <= 5; y += 1) for (let z = 0.4; z < 2.8; z += 0.6) there.push([6, y, z]);
  for (let x = -4; x <= 4; x += 1) for (let y = -5; y <= 5; y += 1) there.push([x, y, 0]);
  const nothing = [];
  for (let y = -5; y <= 5; y += 1) nothing.push([6, y, 3.8], [6, y, 4.5]);
  const onMap = (await colours(there)).filter((c) => c.seen);
  const beside = (await colours(nothing)).filter((c) => c.seen);
  assert.ok(onMap.length > 100 && beside.length > 10);
  const covered = onMap.filter((c) => !isPaper(c)).length / onMap.length;
  if (covered <= 0.97) { if (picture) await page.screenshot({ path: picture, timeout: 300000 }); console.log(JSON.stringify(onMap.filter(isPaper).slice(0, 12)), JSON.stringify(there.length)); }
  assert.ok(covered > 0.97, `${covered} of the map's places are drawn`);
  assert.ok(beside.every(isPaper), "nothing is drawn where nothing is");
  // heights have their colours: the wall is redder above than below
  const [low, high] = await colours([[6, 2, 0.3], [6, 2, 2.8]]);
  assert.ok(high.rgb[0] - high.rgb[2] > low.rgb[0] - low.rgb[2] + 60, `${low.rgb} below, ${high.rgb} above`);
  // the obstacle
  const [box] = await colours([[2.5, 3, 0.8]]);
  assert.ok(box.rgb[0] > 1.4 * box.rgb[1] && !isPaper(box), `the box is ${box.rgb}`);

  // the drone: its body is the vehicle's colour
  const p = await page.evaluate(() => window.pointflight.state.last.vehicles[0].p);
  await look([p[0] - 1.2, p[1] - 0.6, p[2] + 0.6], p);
  const [body] = await colours([[p[0], p[1], p[2]]]);
  assert.ok(body.rgb[0] > 1.5 * body.rgb[2] && body.rgb[0] > 80, `the drone is ${body.rgb}`);

  // the scan: its points are drawn where they are, in their colour
  await hideScans(false);
  await look([-9, 0, 6], [2, 0, 0.5]);
  await page.evaluate(() => window.pointflight.client.order({ pause: true }));
  await until("the pause", () => window.pointflight.state.last.doing === "paused");
  const cloud = await page.evaluate(() => {
    const { cloud: c } = [...window.pointflight.state.vehicles[0].scans.values()][0];
    const young = [];
    for (let i = Math.floor(0.7 * c.count); i < c.count; i += 3) young.push([...c.positions.subarray(3 * i, 3 * i + 3)]);
    return young;
  });
  const onScan = (await colours(cloud)).filter((c) => c.seen);
  const yellow = onScan.filter(({ rgb }) => rgb[0] > 150 && rgb[1] > 110 && rgb[2] < 0.75 * rgb[1]).length / onScan.length;
  assert.ok(onScan.length > 100 && yellow > 0.85, `${yellow} of ${onScan.length} points are drawn`);
  const on = cloud.filter((q) => Math.abs(q[2]) < 0.15 || Math.abs(q[0] - 6) < 0.15 || Math.hypot(q[0] - 2, q[1] + 3) < 0.4 || (Math.abs(q[0] - 3) < 0.65 && Math.abs(q[1] - 3) < 0.65));
  // noise, and mixed pixels between post and wall
  assert.ok(on.length > 0.95 * cloud.length, `${on.length} of ${cloud.length} points lie on what is there`);
  if (picture) await page.screenshot({ path: picture, timeout: 300000 });

  // a double click on the floor flies it there
  await page.evaluate(() => window.pointflight.client.order({ pause: false }));
  await hideScans(true);
  const goal = [-3, -3, 0];
  await look([-9, 0, 6], [2, 0, 0.5]);
  const [pixel] = await colours([goal]);
  await page.mouse.dblclick(pixel.x, pixel.y);
  await page
    .waitForFunction((g) => { const q = window.pointflight.state.last.vehicles[0].p; return Math.hypot(q[0] - g[0], q[1] - g[1]) < 0.4 && Math.abs(q[2] - 1.5) < 0.3; }, goal, { timeout: 300000, polling: 200 })
    .catch(async () => assert.fail(`it did not fly there: ${JSON.stringify(await page.evaluate(() => window.pointflight.state.last.vehicles[0].p))}`));
  // and an arrow key moves it, while it is held
  const before = await page.evaluate(() => window.pointflight.state.last.vehicles[0].p[2]);
  await page.keyboard.down("PageUp");
  await page.waitForFunction((z) => window.pointflight.state.last.vehicles[0].p[2] > z + 0.3, before, { timeout: 300000, polling: 100 });
  await page.keyboard.up("PageUp");
  const cost = await page.evaluate(() => window.pointflight.state.cost);
  console.log(`${onMap.length} places of the map, ${onScan.length} of a scan; ${cost.toFixed(0)} ms of script per frame`);
  assert.deepEqual(wrong, [], "errors on the console");
  await page.close();
  run.kill("SIGINT");
  const end = await flight.ended;
  assert.ok([0, 1, 130].includes(end.code), end.log);

  // the finished run: its time line goes to where it was
  const finished = await serve("view", out, "--at", "127.0.0.1:0");
  try {
    const { page: again, wait } = await open(finished.address);
    await wait("a state", () => window.pointflight?.state.last?.vehicles[0]?.p && window.pointflight.map.overviewReady);
    const table = trajectory(out);
    const length = table.at(-1)[0];
    assert.ok(Math.abs(Number(await again.locator("#line").getAttribute("max")) - length) < 1, "the time line is as long as the run");
    await again.evaluate(() => window.pointflight.client.order({ pause: true }));
    for (const share of [0.9, 0.3]) {
      const to = share * length;
      await again.evaluate((t) => window.pointflight.client.order({ seek: t }), to);
      await wait("where it was then", (t) => Math.abs(window.pointflight.state.last.t - t) < 0.05 && window.pointflight.state.last.doing === "paused", to);
      const { p: q } = await again.evaluate(() => window.pointflight.state.last.vehicles[0]);
      const row = table.reduce((best, r) => (Math.abs(r[0] - to) < Math.abs(best[0] - to) ? r : best));
      q.forEach((v, i) => assert.ok(Math.abs(v - row[1 + i]) < 0.1, `at ${to} s ${q}, it was at ${row.slice(1, 4)}`));
    }
    assert.deepEqual(wrong, [], "errors on the console");
    await again.close();
  } finally {
    finished.child.kill("SIGINT");
    await finished.ended;
  }

  // its recording: the place by /map, the vehicle by its odometry, at the same time of the time line
  const replayed = await serve("view", recording, "--at", "127.0.0.1:0");
  try {
    const { page: film, wait } = await open(replayed.address);
    await wait("a pose", () => window.pointflight?.state.vehicles[0]?.state?.p);
    await wait("the place", () => window.pointflight.state.recording.trails.some((t) => t.byHeight && t.cloud.count > 2000));
    const table = trajectory(out);
    // when it stands still and does not turn: points are each in the frame of their own time
    const moved = (i) => Math.hypot(...[1, 2, 3, 4, 5, 6, 7].map((k) => table[i][k] - table[i - 60][k]));
    const still = table.map((_, i) => i).filter((i) => i > 0.5 * table.length).reduce((best, i) => (moved(i) < moved(best) ? i : best));
    const to = table[still][0];
    await film.evaluate((t) => (window.pointflight.client.order({ pause: true }), window.pointflight.client.order({ seek: t })), to);
    await wait("where it was then", (t) => Math.abs(window.pointflight.state.last.t - t) < 0.02, to);
    const row = table.reduce((best, r) => (Math.abs(r[0] - to) < Math.abs(best[0] - to) ? r : best));
    await wait(`its place at ${to} s, ${row.slice(1, 4)}`,
      (place) => place.every((v, i) => Math.abs(window.pointflight.state.vehicles[0].state.p[i] - v) < 0.1), row.slice(1, 4));
    await wait("a scan of then", () => window.pointflight.state.recording.trails.some((t) => !t.byHeight && t.scans.length > 0));
    // scans lie in the world where the walls are
    const world = await film.evaluate(() => {
      const { THREE, state } = window.pointflight;
      const trail = state.recording.trails.find((t) => !t.byHeight && t.scans.length > 0);
      const { points } = trail.scans.at(-1);
      const list = [];
      for (let i = 0; i < trail.cloud.count; i += 7) list.push(new THREE.Vector3().fromArray(trail.cloud.positions, 3 * i).applyMatrix4(points.matrix).toArray());
      return list;
    });
    const on = world.filter((w) => Math.abs(w[2]) < 0.2 || Math.abs(w[0] - 6) < 0.2 || Math.hypot(w[0] - 2, w[1] + 3) < 0.45 || (Math.abs(w[0] - 3) < 0.7 && Math.abs(w[1] - 3) < 0.7));
    assert.ok(world.length > 100 && on.length > 0.97 * world.length, `${on.length} of ${world.length} points lie on what is there`);
    if (picture) await film.screenshot({ path: picture.replace(".png", "_recording.png"), timeout: 300000 });
    assert.deepEqual(wrong, [], "errors on the console");
    await film.close();
  } finally {
    replayed.child.kill("SIGINT");
    await replayed.ended;
  }

  // one of ROS 1 without a word of how its LiDAR is mounted: drawn at the odometry's pose
  const foreign = path.join(folder, "ros1.mcap");
  await writeRos1(foreign);
  const shown = await serve("view", foreign, "--at", "127.0.0.1:0");
  try {
    const { page: film, wait } = await open(shown.address);
    await wait("a cloud", () => window.pointflight?.state.recording?.trails[0]?.cloud);
    const middle = await film.evaluate(() => {
      const { THREE, state } = window.pointflight;
      const [trail] = state.recording.trails;
      return new THREE.Vector3().fromArray(trail.cloud.positions).applyMatrix4(trail.scans.at(-1).points.matrix).toArray();
    });
    // ahead by 2, of a vehicle at (5, 0, 1) that looks along y
    assert.ok(Math.hypot(middle[0] - 5, middle[1] - 2, middle[2] - 1) < 1e-5, `the first point is at ${middle}`);
    await wait("what is assumed is said", () => document.getElementById("log").textContent.includes("nothing says where lidar is mounted"));
    assert.deepEqual(wrong, [], "errors on the console");
    await film.close();
  } finally {
    shown.child.kill("SIGINT");
    await shown.ended;
  }
} finally {
  await browser.close();
  run.kill("SIGINT");
}

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { FrameBudget } from "./budget.js";
import { ScanTrail, cloudOfMessage } from "./clouds.js";
import { showLegend } from "./legend.js";
import { SurfelMap } from "./map.js";
import { decoderOf } from "./messages.js";
import { Client, json } from "./protocol.js";
import { drawRange } from "./range_image.js";
import { Recording } from "./recording.js";
import { EyeDome } from "./shading.js";
import { showTopics } from "./topics.js";
import { Obstacles, Vehicle, append, line } from "./vehicles.js";

const $ = (id) => document.getElementById(id);
const query = new URLSearchParams(location.search);
THREE.Object3D.DEFAULT_UP.set(0, 0, 1); // the world's z is up

// ---- what is drawn with ----

const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
const hardware = renderer.getContext().getExtension("WEBGL_debug_renderer_info");
const isSoftware = /swiftshader|llvmpipe|software/i.test(hardware ? renderer.getContext().getParameter(hardware.UNMASKED_RENDERER_WEBGL) : "");
renderer.setPixelRatio(Math.min(devicePixelRatio, Number(query.get("pixels") ?? (isSoftware ? 1 : 2))));
const dome = new EyeDome(renderer, isSoftware ? 0 : 4);
$("scene").append(renderer.domElement);
const scene = new THREE.Scene();
scene.add(new THREE.HemisphereLight("#ffffff", "#888888", 2.2));
const sun = new THREE.DirectionalLight("#ffffff", 1.2);
sun.position.set(3, 2, 8);
scene.add(sun);
const camera = new THREE.PerspectiveCamera(60, 1, 0.05, 3000);
camera.up.set(0, 0, 1);
camera.position.set(-12, -12, 10);
const controls = new OrbitControls(camera, renderer.domElement);
controls.enableDamping = true;
const map = new SurfelMap(scene);
const obstacles = new Obstacles(scene);
const measured = line(new THREE.Color("#00b894"), 2);
scene.add(measured);

// without a GPU a few frames per second are what there is
const budget = isSoftware ? new FrameBudget(100_000, 300, 150) : new FrameBudget(2_000_000, 45, 24);

const state = { vehicles: [], chosen: 0, run: null, last: null, recording: null, ruler: false, marks: [], keys: new Set(), frames: 0, cost: 0 };

function resize() {
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
}
addEventListener("resize", resize);

function setTheme(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  $("theme").checked = !dark;
  scene.background = new THREE.Color(dark ? "#101216" : "#f4f4f2");
}
setTheme(query.get("theme") !== "light");

// ---- the run ----

const address = `ws://${location.host}/?token=${encodeURIComponent(query.get("token") ?? "")}`;
const client = new Client(address, {
  open: () => say("connected"),
  close: () => ($("title").textContent = "the run has ended, or the connection is gone"),
  session: () => state.vehicles.forEach((v) => v.forget()),
  info: (info) => {
    $("line").style.display = info.dataEndTime ? "" : "none";
    setPermission();
    if (!info.dataEndTime) return;
    const ns = (t) => BigInt(t.sec) * 1_000_000_000n + BigInt(t.nsec);
    state.start = ns(info.dataStartTime);
    $("line").max = 1e-9 * Number(ns(info.dataEndTime) - state.start);
  },
  channels: (channels) => {
    // a server that begins has no channels yet, a run says at once that it is one
    const isRun = channels.some((c) => c.topic === "/pointflight/run");
    show(channels.length === 0 ? "map" : isRun || !state.start ? "run" : "recording");
    if (state.kind === "recording") playRecording(channels);
  },
  time: (time) => state.recording && showTime(1e-9 * Number(time - state.start)),
  playback: (playback) => {
    if (!state.recording) return;
    if (playback.didSeek) state.recording.forget();
    state.doing = playback.isPlaying ? "running" : "paused";
    state.rate = playback.speed;
    showTime(1e-9 * Number(playback.time - state.start));
  },
  status: (message) => say(message.message),
});

// "map": nothing flies there, and what tells of flights is put away (index.html); "run", "recording". Another
// program may serve at the address of one that has ended.
function show(kind) {
  if (state.kind !== kind && [state.kind, kind].includes("recording") && state.kind) return location.reload();
  state.kind = kind;
  document.documentElement.dataset.shows = kind;
  if (kind === "map") $("title").textContent = "map";
  setPermission();
}

// ---- a recording: topics as they lie in a file ----

const heights = {
  uniform: map.uniforms.heights,
  // of a cloud that is a place, where no map gives them
  include(positions) {
    if (map.surfels) return;
    const stride = Math.max(1, Math.floor(positions.length / 3 / 20000));
    map.setHeights(Float32Array.from({ length: Math.floor(positions.length / 3 / stride) }, (_, i) => positions[3 * i * stride + 2]));
    setLegend();
  },
};

function playRecording(channels) {
  if (!state.recording) {
    state.recording = new Recording(scene, $("tags"), client, heights, say);
    state.recording.start = state.start;
    state.recording.keep = Number($("keep").value);
    state.vehicles = state.recording.vehicles;
    state.recording.onScan = (vehicle, trail) => vehicle === chosen() && drawRange($("image"), trail.cloud, null);
    state.recording.onVehicle = () => {
      listVehicles();
      if (!state.placed) $("camera").value = "follow";
    };
    $("title").textContent = "recording";
    $("step").title = "to the next scan";
  }
  state.recording.adopt(channels);
  showTopics($("topics"), state.recording);
}

function showTime(t) {
  state.last = { t, doing: state.doing ?? "running", rate: state.rate ?? 1 };
  const first = state.vehicles[0];
  if (first?.state?.p && !state.placed) {
    state.placed = true;
    controls.target.copy(first.group.position);
    camera.position.copy(first.group.position).add(new THREE.Vector3(-8, -6, 6));
  }
  showClock();
  showFigures();
}

function showClock() {
  if (document.activeElement !== $("line")) $("line").value = state.last.t;
  $("time").textContent = `${state.last.t.toFixed(1)} s`;
  $("pause").textContent = state.last.doing === "paused" ? "resume" : "pause";
}

function listVehicles() {
  $("vehicle").replaceChildren(...state.vehicles.map((v, i) => new Option(v.description.name, i)));
}

function setPermission() {
  for (const id of ["pause", "step", "reset", "rate", "line"]) $(id).disabled = !client.mayCommand;
  const isLive = $("line").style.display === "none";
  const hint = !client.mayCommand ? "watching only; " : isLive ? "double click: fly there; " : "space, time line; ";
  $("hint").textContent = `${state.kind === "map" ? "" : hint}? for keys`;
}

client.want("/pointflight/run", (bytes) => {
  const run = json(bytes);
  if (state.run && JSON.stringify(run.map) !== JSON.stringify(state.run.map)) return location.reload(); // elsewhere
  state.vehicles.forEach((v) => v.remove(scene));
  state.run = run;
  state.vehicles = run.vehicles.map((v, i) => new Vehicle(scene, $("tags"), v, i));
  $("title").textContent = run.vehicles.length > 1 ? `${run.vehicles.length} vehicles` : run.vehicles[0]?.name ?? "map";
  listVehicles();
  const origin = new THREE.Vector3(...run.cloud_origin);
  const place = new THREE.Matrix4().makeTranslation(origin);
  for (const vehicle of state.vehicles) {
    for (const lidar of vehicle.description.lidars) {
      const trail = new ScanTrail(scene, vehicle.colour.clone().lerp(new THREE.Color("#ffd23f"), 0.7), map.uniforms.heights);
      trail.keep = Number($("keep").value);
      vehicle.scans.set(lidar.topic, trail);
      let decode = null;
      client.want(lidar.topic, (data, stamp, channel) => {
        if (!$("scans").checked) return;
        decode ??= decoderOf(channel);
        trail.add(cloudOfMessage(decode(data)), 1e-9 * Number(stamp - BigInt(run.epoch)), place);
        if (vehicle === chosen()) drawRange($("image"), trail.cloud, vehicle, origin);
      }, { latest: true });
    }
  }
  lookAtStart();
});

function showState(bytes) {
  const now = json(bytes);
  if (state.last && now.t < state.last.t - 0.5) state.vehicles.forEach((v) => v.forget());
  state.last = now;
  now.vehicles.forEach((v, i) => state.vehicles[i]?.update(v, now.t));
  obstacles.update(now.obstacles);
  showClock();
  showFigures();
}
client.want("/pointflight/state", showState, { latest: true });

client.want("/pointflight/events", (bytes) => {
  const event = json(bytes);
  say(`${event.t.toFixed(2)} s ${event.vehicle}: ${event.words}`, true);
});

const chosen = () => state.vehicles[state.chosen];

function lookAtStart() {
  const first = state.run?.vehicles[0];
  if (!first || state.placed) return;
  state.placed = true;
  const p = new THREE.Vector3(...first.start);
  controls.target.copy(p);
  camera.position.copy(p).add(new THREE.Vector3(-5, -4, 3));
  $("camera").value = "follow";
}

const lines = [];
function say(words, hot = false) {
  lines.push([words, hot]);
  if (lines.length > 5) lines.shift();
  $("log").style.display = "block";
  $("log").replaceChildren(
    ...lines.map(([text, isHot]) => Object.assign(document.createElement("div"), { textContent: text, className: isHot ? "hit" : "" })),
  );
}

const large = (n) => (n < 1e6 ? `${(n / 1e3).toFixed(n < 1e4 ? 1 : 0)} k` : `${(n / 1e6).toFixed(2)} M`);

function showFigures() {
  const v = chosen()?.state ?? {};
  const now = state.last;
  const rows = [];
  if (now) rows.push(["time", `${now.t.toFixed(2)} s`]);
  if (now && now.doing !== "paused") rows.push([state.recording ? "speed of replay" : "real-time factor", now.rate.toFixed(2)]);
  if (v.p) rows.push(["position", `${v.p.map((x) => x.toFixed(2)).join(", ")} m`]);
  if (v.v) rows.push(["speed", `${Math.hypot(...v.v).toFixed(2)} m/s`]);
  // of another process' vehicle only the pose is told
  if (v.p && !state.recording && v.command !== undefined) {
    rows.push(
      ["clearance", v.nearest ? `${v.nearest.distance.toFixed(2)} m` : "over 10 m"],
      ...["command", "scans", "collisions"].filter((name) => v[name] !== undefined).map((name) => [name, v[name]]),
    );
  }
  if (map.surfels) rows.push(["surfels drawn", `${large(map.drawn)} of ${large(map.surfels)}`]);
  if (query.has("debug")) rows.push(["frame, script", `${budget.interval.toFixed(0)}, ${state.cost.toFixed(0)} ms`]);
  $("figures").replaceChildren(
    ...rows.map(([name, value]) => {
      const row = document.createElement("tr");
      for (const words of [name, value]) row.append(Object.assign(document.createElement("td"), { textContent: words }));
      return row;
    }),
  );
}

// ---- cameras ----

function moveCamera() {
  const vehicle = chosen();
  const mode = $("camera").value;
  controls.enabled = mode === "orbit" || mode === "follow" || mode === "top";
  if (!vehicle?.state?.p) return;
  const p = vehicle.group.position;
  if (mode === "follow" || mode === "top") {
    const moved = p.clone().sub(state.followed ?? p);
    camera.position.add(moved);
    controls.target.copy(p);
    state.followed = p.clone();
  } else {
    state.followed = null;
  }
  if (mode === "board") {
    const q = vehicle.group.quaternion;
    camera.position.copy(p).add(new THREE.Vector3(0.15, 0, 0.12).applyQuaternion(q));
    camera.up.copy(new THREE.Vector3(0, 0, 1).applyQuaternion(q));
    camera.lookAt(camera.position.clone().add(new THREE.Vector3(1, 0, 0).applyQuaternion(q)));
  } else {
    camera.up.set(0, 0, 1);
  }
}

function setCamera(mode) {
  $("camera").value = mode;
  const p = chosen()?.group.position;
  if (!p) return;
  if (mode === "top") camera.position.copy(p).add(new THREE.Vector3(0, -0.01, 25));
  if (mode === "follow") camera.position.copy(p).add(new THREE.Vector3(-4, -3, 2.5));
  if (mode !== "board") controls.target.copy(p);
}
$("camera").onchange = () => setCamera($("camera").value);
$("vehicle").onchange = () => (state.chosen = Number($("vehicle").value));

// ---- picking, ordering ----

const caster = new THREE.Raycaster();
function rayAt(event) {
  const pointer = new THREE.Vector2((2 * event.clientX) / innerWidth - 1, 1 - (2 * event.clientY) / innerHeight);
  caster.setFromCamera(pointer, camera);
  return caster.ray;
}
let pressed = null;
renderer.domElement.addEventListener("pointerdown", (event) => (pressed = [event.clientX, event.clientY]));
renderer.domElement.addEventListener("click", (event) => {
  if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
  const met = map.pick(rayAt(event));
  if (!met) return;
  const words = met.place.toArray().map((x) => x.toFixed(2)).join(", ");
  if (!state.ruler) return say(`surfel at ${words}`);
  state.marks = state.marks.length === 1 ? [state.marks[0], met.place] : [met.place];
  measured.userData.count = 0;
  state.marks.forEach((mark) => append(measured, mark.toArray()));
  say(state.marks.length === 2 ? `${state.marks[0].distanceTo(state.marks[1]).toFixed(3)} m apart` : `from ${words}`);
});
renderer.domElement.addEventListener("dblclick", (event) => {
  const met = map.pick(rayAt(event));
  if (!met || !client.mayCommand) return;
  flyTo(met.place.x, met.place.y, met.place.z + 1.5);
});
function flyTo(x, y, z) {
  client.order({ vehicle: state.chosen, goal: [x, y, z] });
  say(`fly to ${[x, y, z].map((v) => v.toFixed(1)).join(", ")}`);
}

$("pause").onclick = () => client.order({ pause: state.last?.doing !== "paused" });
$("step").onclick = () => client.order({ step: true });
$("rate").onchange = () => client.order({ rate: Number($("rate").value) });
$("line").oninput = () => client.order({ seek: Number($("line").value) });
$("line").onchange = () => $("line").blur();
$("reset").onclick = () => client.order({ reset: true });
$("shot").onclick = () => {
  draw(0);
  const link = document.createElement("a");
  link.download = "pointflight.png";
  link.href = renderer.domElement.toDataURL("image/png");
  link.click();
};
$("ruler").onclick = () => {
  state.ruler = !state.ruler;
  state.marks = [];
  measured.geometry.setDrawRange(0, 0);
  say(state.ruler ? "ruler: click on two surfels" : "ruler off");
};
$("keys").onclick = () => ($("help").style.display = $("help").style.display === "block" ? "none" : "block");
$("theme").onchange = () => setTheme(!$("theme").checked);
$("colour").onchange = () => {
  map.uniforms.colouring.value = ["height", "intensity", "planar"].indexOf($("colour").value);
  setLegend();
};
$("budget").onchange = () => setBudget($("budget").value);
$("dome").onchange = () => (dome.isOn = $("dome").checked);
$("keep").onchange = () => {
  const seconds = Number($("keep").value);
  state.recording?.setKeep(seconds);
  for (const vehicle of state.vehicles) vehicle.scans.forEach((trail) => (trail.keep = seconds));
};
$("scans").onchange = () => {
  for (const vehicle of state.vehicles) vehicle.scans.forEach((trail) => trail.show($("scans").checked));
  state.recording?.trails.forEach((trail) => trail.byHeight || trail.show($("scans").checked && trail.topic.isOn));
};
$("path").onchange = () => state.vehicles.forEach((v) => (v.path.visible = $("path").checked));
$("ceiling").oninput = () => {
  if (!map.bounds) return;
  const { min, max } = map.bounds;
  const share = Number($("ceiling").value);
  map.uniforms.clipHigh.value.z = share >= 1 ? 1e9 : min.z + share * (max.z - min.z);
};

// "auto", or a number of surfels.
function setBudget(value) {
  budget.isAutomatic = value === "auto";
  if (!budget.isAutomatic) budget.surfels = Number(value);
  map.budget = budget.surfels;
}

function setLegend() {
  if (map.surfels || state.recording?.trails.some((trail) => trail.byHeight)) showLegend($("legend"), $("colour").value, map);
}

// A box around the chosen vehicle, 2 m to the map's size.
function cutAround() {
  const { clipLow, clipHigh } = map.uniforms;
  const share = Number($("around").value);
  const p = chosen()?.group.position ?? controls.target;
  const size = map.bounds ? map.bounds.getSize(new THREE.Vector3()).length() : 1e3;
  const reach = share >= 1 ? 1e9 : 2 * (size / 2) ** share;
  clipLow.value.set(p.x - reach, p.y - reach, -1e9);
  clipHigh.value.x = p.x + reach;
  clipHigh.value.y = p.y + reach;
}

const ARROWS = { ArrowUp: [1, 0, 0, 0], ArrowDown: [-1, 0, 0, 0], ArrowLeft: [0, 0, 0, 1], ArrowRight: [0, 0, 0, -1], PageUp: [0, 0, 1, 0], PageDown: [0, 0, -1, 0] };
addEventListener("keydown", (event) => {
  if (event.target.tagName === "SELECT") return;
  if (ARROWS[event.key]) {
    event.preventDefault();
    state.keys.add(event.key);
    return;
  }
  const cut = (by) => {
    $("ceiling").value = Number($("ceiling").value) + by;
    $("ceiling").oninput();
  };
  const actions = {
    1: () => setCamera("orbit"),
    2: () => setCamera("follow"),
    3: () => setCamera("board"),
    4: () => setCamera("top"),
    " ": () => $("pause").onclick(),
    ".": () => $("step").onclick(),
    r: () => $("reset").onclick(),
    v: () => ($("vehicle").value = state.chosen = (state.chosen + 1) % Math.max(1, state.vehicles.length)),
    t: () => setTheme(document.documentElement.dataset.theme !== "dark"),
    p: () => $("shot").onclick(),
    m: () => $("ruler").onclick(),
    "?": () => $("keys").onclick(),
    "[": () => cut(-0.02),
    "]": () => cut(0.02),
  };
  if (!actions[event.key]) return;
  event.preventDefault();
  actions[event.key]();
});
addEventListener("keyup", (event) => {
  if (!state.keys.delete(event.key) || state.keys.size > 0) return;
  client.order({ vehicle: state.chosen, hover: true });
});
setInterval(() => {
  if (state.keys.size === 0) return;
  const sum = [0, 0, 0, 0];
  for (const key of state.keys) ARROWS[key].forEach((x, i) => (sum[i] += x));
  client.order({ vehicle: state.chosen, velocity: [2 * sum[0], 2 * sum[1], 1 * sum[2]], yaw_rate: sum[3] });
}, 50);

// ---- frames ----

function draw(dt) {
  client.deliver();
  moveCamera();
  if (controls.enabled) controls.update();
  for (const vehicle of state.vehicles) vehicle.animate(dt);
  cutAround();
  map.update(camera);
  dome.render(scene, camera);
  const place = new THREE.Vector3();
  for (const vehicle of state.vehicles) {
    place.copy(vehicle.group.position).project(camera);
    const isSeen = vehicle.group.visible && Math.abs(place.z) < 1 && $("camera").value !== "board";
    vehicle.tag.style.display = isSeen ? "block" : "none";
    vehicle.tag.style.left = `${(0.5 + 0.5 * place.x) * innerWidth}px`;
    vehicle.tag.style.top = `${(0.5 - 0.5 * place.y) * innerHeight}px`;
  }
}

let before = performance.now();
function frame(now) {
  const start = performance.now();
  draw(Math.min(0.1, 1e-3 * (now - before)));
  before = now;
  ++state.frames;
  if (budget.frame(now, map)) map.budget = budget.surfels;
  if (!state.last && state.frames % 20 === 0) showFigures();
  state.cost = 0.9 * state.cost + 0.1 * (performance.now() - start);
  requestAnimationFrame(frame);
}

resize();
setBudget(query.get("budget") ?? "auto");
map
  .load()
  .then((isThere) => {
    if (!isThere) return;
    setLegend();
    if (!map.hasIntensity) $("colour").querySelector("[value=intensity]").disabled = true;
    if (!state.run && !state.placed) {
      const middle = map.bounds.getCenter(new THREE.Vector3());
      controls.target.copy(middle);
      camera.position.copy(middle).add(new THREE.Vector3(-15, -15, 12));
    }
  })
  .catch((error) => say(`the map: ${error.message}`, true));
requestAnimationFrame(frame);

// For tests and for those who script it.
window.pointflight = { state, map, budget, dome, camera, controls, scene, client, flyTo, setCamera, THREE };

// The map: surfels as oriented discs, unpacked in the shader from the words that the simulator traces.
import * as THREE from "three";
import { FLAT_LEVEL, FLAT_STEEP, ROUGH, glsl, turbo } from "./colours.js";

const ROW = 16; // bytes of a surfel, MapBlocks
const WIDTH = 512; // of the textures that surfels lie in

const vertex = `
precision highp float;
precision highp int;
const int WIDTH = ${WIDTH};
precision highp usampler2D;
precision highp sampler2D;
uniform usampler2D words;
uniform sampler2D leaves;  // origin of its leaf from the map's, m; intensity code
uniform float resolution;
uniform float grow;      // thinned surfels stand for their neighbours
uniform vec3 clipLow, clipHigh;
uniform int colouring;
uniform vec2 heights;
out vec2 place;
out vec3 shade;
${turbo}
void main() {
  // four vertices for each surfel, which is fetched: instances of four cost several times as much
  int surfel = gl_VertexID >> 2;
  ivec2 texel = ivec2(surfel % WIDTH, surfel / WIDTH);
  uvec2 word = texelFetch(words, texel, 0).xy;
  vec4 leaf = texelFetch(leaves, texel, 0);
  vec2 corner = vec2((gl_VertexID + 1 & 2) - 1, (gl_VertexID & 2) - 1);
  // SurfelWord: see pointflight/map/surfel.hpp
  uint lo = word.x, hi = word.y;
  vec3 centre = (vec3(float(lo & 1023u), float((lo >> 10) & 1023u), float((lo >> 20) & 1023u)) + 0.5) / 64.0;
  int thickness = int((lo >> 30) & 3u);
  vec3 q = vec3(float(int(hi << 24) >> 24), float(int(hi << 16) >> 24), float(int(hi << 8) >> 24)) * (0.70711 / 127.0);
  float w = sqrt(max(0.0, 1.0 - dot(q, q)));
  float s2 = sqrt(uintBitsToFloat(0x3b6bedfau + (hi >> 27) * 0x288000u));
  float s1 = s2 * pow(0.75, float((hi >> 24) & 7u));
  vec3 ax1 = vec3(2.0 * (q.x * q.y - w * q.z), 1.0 - 2.0 * (q.x * q.x + q.z * q.z), 2.0 * (q.y * q.z + w * q.x));
  vec3 ax2 = vec3(2.0 * (q.x * q.z + w * q.y), 2.0 * (q.y * q.z - w * q.x), 1.0 - 2.0 * (q.x * q.x + q.y * q.y));
  vec3 normal = cross(ax1, ax2);
  vec3 middle = leaf.xyz + resolution * centre;
  vec3 world = (modelMatrix * vec4(middle, 1.0)).xyz;
  place = corner;
  float reach = 2.5 * resolution * grow;  // discs of full cells close the gaps between their corners
  vec3 local = middle + reach * (corner.x * s1 * ax1 + corner.y * s2 * ax2);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(local, 1.0);
  if (any(lessThan(world, clipLow)) || any(greaterThan(world, clipHigh))) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  vec3 sight = normalize(cameraPosition - world);
  float light = 0.55 + 0.45 * abs(dot(normal, normalize(sight + vec3(0.3, 0.2, 0.9))));
  vec3 colour;
  if (colouring == 0) colour = turboOfHeight(world.z, heights);
  else if (colouring == 1) colour = vec3(0.15 + 0.85 * leaf.w / 255.0);
  else colour = thickness == 0 ? mix(${glsl(FLAT_STEEP)}, ${glsl(FLAT_LEVEL)}, abs(normal.z)) : ${glsl(ROUGH)};
  shade = linear(colour * light);
}`;

const fragment = `
precision highp float;
in vec2 place;
in vec3 shade;
out vec4 colour;
void main() {
  if (dot(place, place) > 1.0) discard;
  colour = vec4(shade, 1.0);
}`;

// For so many surfels, in whole rows of their textures.
function room(count) {
  const texels = WIDTH * Math.max(1, Math.ceil(count / WIDTH));
  return { words: new Uint32Array(2 * texels), leaves: new Float32Array(4 * texels) };
}

export class SurfelMap {
  constructor(scene) {
    this.group = new THREE.Group();
    scene.add(this.group);
    this.budget = 2e6;
    this.blocks = [];
    this.loading = 0;
    this.bytes = 0;
    this.uniforms = {
      resolution: { value: 0.1 },
      clipLow: { value: new THREE.Vector3(-1e9, -1e9, -1e9) },
      clipHigh: { value: new THREE.Vector3(1e9, 1e9, 1e9) },
      colouring: { value: 0 },
      heights: { value: new THREE.Vector2(0, 1) },
    };
  }

  // Two triangles for each of `count` surfels; one buffer for all meshes, as long as the longest.
  faces(count) {
    if (!this.index || this.index.count < 6 * count) {
      const faces = new Uint32Array(6 * Math.max(16384, count));
      for (let i = 0; i < faces.length / 6; ++i) faces.set([4 * i, 4 * i + 1, 4 * i + 2, 4 * i, 4 * i + 2, 4 * i + 3], 6 * i);
      this.index = new THREE.BufferAttribute(faces, 1);
    }
    return this.index;
  }

  // False if there is no map.
  async load() {
    const index = await this.fetch("/map/index");
    if (index.byteLength === 0) return false;
    const view = new DataView(index);
    const count = view.getUint32(4, true);
    this.surfels = view.getUint32(8, true);
    this.hasIntensity = view.getUint32(12, true) === 1;
    this.intensity = { zero: view.getFloat32(48, true), step: view.getFloat32(52, true) };
    const origin = new THREE.Vector3(...[16, 24, 32].map((at) => view.getFloat64(at, true)));
    this.origin = origin;
    const resolution = view.getFloat64(40, true);
    this.resolution = resolution;
    this.uniforms.resolution.value = resolution;
    this.group.position.copy(origin);
    this.bounds = new THREE.Box3();
    this.blocks = [];
    for (let i = 0, at = 56; i < count; ++i, at += 28) {
      const f = (k) => view.getFloat32(at + 4 * k, true);
      const box = new THREE.Box3(
        new THREE.Vector3(f(0), f(1), f(2)).add(origin),
        new THREE.Vector3(f(3), f(4), f(5)).add(origin),
      );
      this.bounds.union(box);
      this.blocks.push({ number: i, box, sphere: box.getBoundingSphere(new THREE.Sphere()), surfels: view.getUint32(at + 24, true), level: -1, wanted: -1, mesh: null });
    }
    await this.loadOverview();
    return true;
  }

  // Colours are of what nearly all heights lie between: some are far off.
  setHeights(z) {
    z.sort();
    this.uniforms.heights.value.set(z[Math.floor(0.01 * z.length)] ?? 0, z[Math.floor(0.99 * z.length)] ?? 1);
  }

  async fetch(path) {
    const response = await fetch(path);
    if (!response.ok) throw new Error(`${path}: ${response.status}`);
    const buffer = await response.arrayBuffer();
    this.bytes += buffer.byteLength;
    return buffer;
  }

  // Rows of one block from `at` on: a geometry, and where the next one begins.
  decode(view, at) {
    const count = view.getUint32(at, true);
    const low = [4, 8, 12].map((k) => view.getUint32(at + k, true));
    at += 16;
    const { words, leaves } = room(count);
    for (let i = 0; i < count; ++i, at += ROW) {
      words[2 * i] = view.getUint32(at, true);
      words[2 * i + 1] = view.getUint32(at + 4, true);
      for (let k = 0; k < 3; ++k) leaves[4 * i + k] = this.resolution * (low[k] + view.getUint16(at + 8 + 2 * k, true));
      leaves[4 * i + 3] = view.getUint16(at + 14, true);
    }
    return { count, words, leaves, end: at };
  }

  mesh(words, leaves, count, grow) {
    const geometry = new THREE.BufferGeometry();
    geometry.setIndex(this.faces(count));
    geometry.setDrawRange(0, 6 * count);
    const height = leaves.length / 4 / WIDTH;
    const textures = {
      words: new THREE.DataTexture(words, WIDTH, height, THREE.RGIntegerFormat, THREE.UnsignedIntType),
      leaves: new THREE.DataTexture(leaves, WIDTH, height, THREE.RGBAFormat, THREE.FloatType),
    };
    textures.words.internalFormat = "RG32UI";
    for (const texture of Object.values(textures)) texture.needsUpdate = true;
    const material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader: vertex,
      fragmentShader: fragment,
      side: THREE.DoubleSide,
      uniforms: { ...this.uniforms, grow: { value: grow }, words: { value: textures.words }, leaves: { value: textures.leaves } },
    });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    mesh.userData = { count, words, leaves };
    this.group.add(mesh);
    return mesh;
  }

  remove(mesh) {
    this.group.remove(mesh);
    mesh.material.uniforms.words.value.dispose();
    mesh.material.uniforms.leaves.value.dispose();
    mesh.material.dispose();
    mesh.geometry.setIndex(null); // which others use
    mesh.geometry.dispose();
  }

  // World, m.
  centre({ words, leaves }, i) {
    const lo = words[2 * i];
    const at = (origin, k) => origin + leaves[4 * i + k] + (this.resolution * (((lo >>> (10 * k)) & 1023) + 0.5)) / 64;
    return [at(this.origin.x, 0), at(this.origin.y, 1), at(this.origin.z, 2)];
  }

  async loadOverview() {
    // half of the budget at most is for what is far; first of all, what index.html has asked for already
    const most = this.overviewReady ? 200000 : 50000;
    this.overviewMost = Math.round(Math.min(this.budget / 2, most));
    const view = new DataView(await this.fetch(`/map/overview/${this.overviewMost}`));
    const stride = view.getUint32(0, true);
    const grow = Math.min(6, Math.sqrt(stride));
    for (let at = 4, i = 0; at < view.byteLength && i < this.blocks.length; ++i) {
      const { count, words, leaves, end } = this.decode(view, at);
      at = end;
      const block = this.blocks[i];
      block.coarse = { words, leaves, count };
    }
    this.overviewGrow = grow;
    this.rebuildOverview();
    if (!this.overviewReady) {
      const { userData } = this.overview;
      this.setHeights(Float32Array.from({ length: userData.count }, (_, i) => this.centre(userData, i)[2]));
    }
    this.overviewReady = true;
    for (const block of this.blocks) block.isWhole = stride === 1;
  }

  // What is not there in detail, in one mesh.
  rebuildOverview() {
    const coarse = this.blocks.filter((b) => b.coarse && !b.mesh);
    const count = coarse.reduce((sum, b) => sum + b.coarse.count, 0);
    const { words, leaves } = room(count);
    let at = 0;
    for (const block of coarse) {
      words.set(block.coarse.words.subarray(0, 2 * block.coarse.count), 2 * at);
      leaves.set(block.coarse.leaves.subarray(0, 4 * block.coarse.count), 4 * at);
      at += block.coarse.count;
    }
    if (this.overview) this.remove(this.overview);
    this.overview = this.mesh(words, leaves, count, this.overviewGrow);
    this.stale = false;
  }

  // Which blocks in which detail, near and large ones first, within the budget.
  update(camera) {
    if (!this.overviewReady || performance.now() - (this.lastUpdate ?? 0) < 250) return;
    this.lastUpdate = performance.now();
    const doesNotFit = this.overviewMost > this.budget || (this.overviewMost < 100000 && this.overviewMost < this.budget / 8);
    if (doesNotFit && this.surfels > this.overviewMost && !this.reloading) {
      this.reloading = this.loadOverview().finally(() => (this.reloading = null));
    }
    const frustum = new THREE.Frustum().setFromProjectionMatrix(
      new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse),
    );
    const ranked = this.blocks
      .map((block) => {
        const distance = Math.max(0.5, block.box.distanceToPoint(camera.position));
        const size = block.sphere.radius / distance;
        return { block, size: frustum.intersectsBox(block.box) ? size : 0.05 * size };
      })
      .sort((a, b) => b.size - a.size);
    // near ones first: they hide what lies behind them
    ranked.forEach(({ block }, i) => block.mesh && (block.mesh.renderOrder = i));
    this.overview.renderOrder = ranked.length;
    let left = this.budget - this.blocks.reduce((sum, b) => sum + (b.coarse?.count ?? 0), 0);
    for (const { block, size } of ranked) {
      const level = size > 0.35 ? 0 : size > 0.12 ? 1 : size > 0.04 ? 2 : -1;
      const cost = level < 0 ? 0 : block.surfels / 4 ** level;
      if (level >= 0 && cost <= left && !block.isWhole) {
        block.wanted = level;
        left -= cost;
      } else {
        block.wanted = -1;
      }
    }
    for (const { block } of ranked) {
      if (block.wanted < 0 && block.mesh) this.drop(block);
    }
    for (const { block } of ranked) {
      if (this.loading >= 6) break;
      if (block.wanted >= 0 && block.level !== block.wanted && !block.busy) this.loadBlock(block, block.wanted);
    }
    if (this.stale) this.rebuildOverview();
  }

  drop(block) {
    this.remove(block.mesh);
    block.mesh = null;
    block.level = -1;
    this.stale = true;
  }

  async loadBlock(block, level) {
    block.busy = true;
    ++this.loading;
    try {
      const view = new DataView(await this.fetch(`/map/block/${block.number}/${level}`));
      const { count, words, leaves } = this.decode(view, 0);
      if (block.mesh) this.drop(block);
      block.mesh = this.mesh(words, leaves, count, 2 ** level);
      block.level = level;
      this.stale = true;
    } catch {
      // the run has ended: what is there stays, and is not asked for all the time
      this.lastUpdate = performance.now() + 2000;
    }
    block.busy = false;
    --this.loading;
  }

  get drawn() {
    return this.group.children.reduce((sum, mesh) => sum + mesh.userData.count, 0);
  }

  // The nearest surfel to a ray, by its centre: { place, distance } or null.
  pick(ray) {
    let best = null;
    const place = new THREE.Vector3();
    const from = new THREE.Vector3();
    for (const mesh of this.group.children) {
      for (let i = 0; i < mesh.userData.count; ++i) {
        place.fromArray(this.centre(mesh.userData, i));
        if (place.z > this.uniforms.clipHigh.value.z) continue;
        const along = from.subVectors(place, ray.origin).dot(ray.direction);
        if (along < 0.1) continue;
        const off = ray.distanceToPoint(place);
        // within a disc, or a hundredth of a radian
        if (off > Math.max(this.resolution, 0.006 * along)) continue;
        if (!best || along < best.distance) best = { place: place.clone(), distance: along };
      }
    }
    return best;
  }
}

// Vehicles, obstacles and paths as the run's messages say.
import * as THREE from "three";

export const COLOURS = ["#e4572e", "#2e86ab", "#6a994e", "#b07bac", "#f2a541", "#3d5a80", "#bc4749", "#52796f"];
export const colourOf = (i) => COLOURS[i % COLOURS.length];

// A solid as the run describes it; cylinders and capsules stand along z.
export function solid(shape, material) {
  const [x, y, z] = shape.half;
  const make = {
    sphere: () => new THREE.SphereGeometry(x, 24, 16),
    cylinder: () => new THREE.CylinderGeometry(x, x, 2 * z, 24).rotateX(Math.PI / 2),
    capsule: () => new THREE.CapsuleGeometry(x, 2 * (z - x), 6, 12).rotateX(Math.PI / 2),
  }[shape.kind];
  return new THREE.Mesh(make ? make() : new THREE.BoxGeometry(2 * x, 2 * y, 2 * z), material);
}

const setPose = (object, p, q) => {
  object.position.set(...p);
  object.quaternion.set(q[1], q[2], q[3], q[0]);
};

export class Vehicle {
  constructor(scene, tags, description, number) {
    this.description = description;
    this.colour = new THREE.Color(colourOf(number));
    this.group = new THREE.Group();
    this.group.visible = false;
    scene.add(this.group);
    const material = new THREE.MeshStandardMaterial({ color: this.colour, roughness: 0.6 });
    this.material = material;
    for (const part of description.parts) {
      const mesh = solid(part.shape, material);
      setPose(mesh, part.p, part.q);
      this.group.add(mesh);
    }
    this.rotors = description.propellers.map((p) => {
      const rotor = new THREE.Group();
      rotor.position.set(...p.p);
      const blade = new THREE.BoxGeometry(p.radius, p.chord, 0.002);
      const dark = new THREE.MeshStandardMaterial({ color: "#333", side: THREE.DoubleSide });
      for (let k = 0; k < p.blades; ++k) {
        const mesh = new THREE.Mesh(blade.clone().translate(p.radius / 2, 0, 0).rotateX(Math.sign(p.speed) * p.pitch), dark);
        mesh.rotation.z = (2 * Math.PI * k) / p.blades;
        rotor.add(mesh);
      }
      this.group.add(rotor);
      return { rotor, sign: Math.sign(p.speed) };
    });
    this.group.add(new THREE.AxesHelper(0.6));
    this.path = line(this.colour, 20000);
    this.mission = line(this.colour, 2 + description.mission.length, true);
    this.goal = new THREE.Mesh(new THREE.SphereGeometry(0.08, 12, 8), new THREE.MeshBasicMaterial({ color: this.colour }));
    this.clearance = line(new THREE.Color("#d00"), 2);
    scene.add(this.path, this.mission, this.clearance, this.goal);
    if (description.start) append(this.mission, description.start);
    for (const waypoint of description.mission) append(this.mission, waypoint);
    this.mission.computeLineDistances();
    this.tag = document.createElement("div");
    this.tag.className = "tag";
    this.tag.textContent = description.name;
    this.tag.style.background = colourOf(number);
    tags.append(this.tag);
    this.scans = new Map();
    this.spin = 0;
  }

  update(state, time) {
    this.state = state;
    this.group.visible = Boolean(state.p); // another process' vehicle may not be there
    if (!state.p) return;
    setPose(this.group, state.p, state.q);
    if (!this.lastPath || Math.hypot(...state.p.map((v, i) => v - this.lastPath[i])) > 0.05) {
      append(this.path, state.p);
      this.lastPath = state.p;
    }
    this.goal.visible = Boolean(state.goal);
    if (state.goal) this.goal.position.set(...state.goal);
    this.clearance.visible = Boolean(state.nearest);
    if (state.nearest) {
      this.clearance.geometry.setDrawRange(0, 0);
      this.clearance.userData.count = 0;
      append(this.clearance, state.p);
      append(this.clearance, state.nearest.place);
    }
    const flash = state.touches && Math.floor(8 * time) % 2 === 0;
    this.material.emissive.set(flash ? "#f00" : "#000");
  }

  animate(dt) {
    const speeds = this.state?.rotors ?? [];
    this.rotors.forEach(({ rotor, sign }, i) => {
      // slower than in truth: what a screen can show
      rotor.rotation.z += sign * Math.min(20, (speeds[i] ?? 0) / 40) * dt;
    });
  }

  show(isVisible) {
    for (const object of [this.group, this.path, this.mission, this.goal, this.clearance]) object.visible = isVisible;
  }

  forget() {
    this.path.geometry.setDrawRange(0, 0);
    this.path.userData.count = 0;
    this.lastPath = null;
  }

  remove(scene) {
    scene.remove(this.group, this.path, this.mission, this.clearance, this.goal);
    for (const trail of this.scans.values()) trail.clear();
    this.tag.remove();
  }
}

export function line(colour, most, dashed = false) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * most), 3));
  geometry.setDrawRange(0, 0);
  const material = dashed
    ? new THREE.LineDashedMaterial({ color: colour, dashSize: 0.3, gapSize: 0.2, transparent: true, opacity: 0.6 })
    : new THREE.LineBasicMaterial({ color: colour });
  const object = new THREE.Line(geometry, material);
  object.frustumCulled = false;
  object.userData = { count: 0, most };
  return object;
}

// Points lie around the first one: single precision is coarse far from zero.
export function append(object, p) {
  const { count, most } = object.userData;
  if (count === 0) object.position.set(...p);
  const attribute = object.geometry.getAttribute("position");
  if (count === most) {
    attribute.array.copyWithin(0, 3 * Math.floor(most / 2));
    object.userData.count = most - Math.floor(most / 2);
  }
  const { x, y, z } = object.position;
  attribute.setXYZ(object.userData.count++, p[0] - x, p[1] - y, p[2] - z);
  attribute.needsUpdate = true;
  object.geometry.setDrawRange(0, object.userData.count);
}

export class Obstacles {
  constructor(scene) {
    this.scene = scene;
    this.meshes = new Map();
    this.material = new THREE.MeshStandardMaterial({ color: "#c94f4f", roughness: 0.7, transparent: true, opacity: 0.85 });
  }

  update(list) {
    const seen = new Set();
    for (const o of list) {
      const key = `${o.label} ${JSON.stringify(o.shape)}`;
      seen.add(key);
      if (!this.meshes.has(key)) {
        const mesh = solid(o.shape, this.material);
        this.meshes.set(key, mesh);
        this.scene.add(mesh);
      }
      setPose(this.meshes.get(key), o.p, o.q);
    }
    for (const [key, mesh] of this.meshes) {
      if (seen.has(key)) continue;
      this.scene.remove(mesh);
      mesh.geometry.dispose();
      this.meshes.delete(key);
    }
  }
}

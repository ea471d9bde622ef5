// Coordinate frames of a recording: which lies where in which (TF, and odometry for those who have none).
import * as THREE from "three";

export const plainFrame = (name) => name.replace(/^\//, "");

export const matrixOf = (p, q) =>
  new THREE.Matrix4().compose(new THREE.Vector3(p.x, p.y, p.z), new THREE.Quaternion(q.x, q.y, q.z, q.w), new THREE.Vector3(1, 1, 1));

export class Frames {
  constructor() {
    this.edges = new Map(); // child -> { parent, matrix, isTf }
  }

  // Odometry gives way to TF, which says the same more exactly.
  set(parent, child, matrix, isTf) {
    parent = plainFrame(parent);
    child = plainFrame(child);
    if (!child || parent === child) return;
    const known = this.edges.get(child);
    if (known?.isTf && !isTf) return;
    this.edges.set(child, { parent, matrix, isTf });
  }

  has(frame) {
    return this.edges.has(plainFrame(frame));
  }

  rootOf(frame) {
    frame = plainFrame(frame);
    for (let left = 50; left > 0 && this.edges.has(frame); --left) frame = this.edges.get(frame).parent;
    return frame;
  }

  // Takes points of a frame to its root.
  toRoot(frame) {
    const matrix = new THREE.Matrix4();
    frame = plainFrame(frame);
    for (let left = 50; left > 0 && this.edges.has(frame); --left) {
      const edge = this.edges.get(frame);
      matrix.premultiply(edge.matrix);
      frame = edge.parent;
    }
    return matrix;
  }
}

// Coordinate frames of a recording: which lies where in which (TF, and odometry for those who have none).
import * as THREE from "three";

export const plainFrame = (name) => name.replace(/^\//, "");

export const matrixOf = (p, q) =>
  new THREE.Matrix4().compose(new THREE.Vector3(p.x, p.y, p.z), new THREE.Quaternion(q.x, q.y, q.z, q.w), new THREE.Vector3(1, 1, 1));

const KEPT = 2; // s of poses: clouds come a little later than what they are stamped with

export class Frames {
  constructor() {
    this.edges = new Map(); // child -> { parent, isTf, isStatic, poses: [{ t, matrix }] }
  }

  // t: s, of the header's stamp. Odometry gives way to TF, which says the same more exactly.
  set(parent, child, t, matrix, isTf, isStatic = false) {
    parent = plainFrame(parent);
    child = plainFrame(child);
    if (!child || parent === child) return;
    const known = this.edges.get(child);
    if (known?.isTf && !isTf) return;
    const goesOn = known?.parent === parent && known.isTf === isTf && t >= known.poses.at(-1).t;
    const edge = goesOn ? known : { parent, isTf, isStatic, poses: [] };
    edge.poses.push({ t, matrix });
    while (edge.poses[0].t < t - KEPT) edge.poses.shift();
    this.edges.set(child, edge);
  }

  has(frame) {
    return this.edges.has(plainFrame(frame));
  }

  // True for a frame that nothing is known to move.
  stays(frame) {
    frame = plainFrame(frame);
    for (let left = 50; left > 0 && this.edges.has(frame); --left) {
      if (!this.edges.get(frame).isStatic) return false;
      frame = this.edges.get(frame).parent;
    }
    return true;
  }

  rootOf(frame) {
    frame = plainFrame(frame);
    for (let left = 50; left > 0 && this.edges.has(frame); --left) frame = this.edges.get(frame).parent;
    return frame;
  }

  // Takes points of a frame to its root, as it was at t or nearest to it.
  toRoot(frame, t) {
    const matrix = new THREE.Matrix4();
    frame = plainFrame(frame);
    for (let left = 50; left > 0 && this.edges.has(frame); --left) {
      const { parent, poses } = this.edges.get(frame);
      const nearest = poses.reduce((best, pose) => (Math.abs(pose.t - t) <= Math.abs(best.t - t) ? pose : best));
      matrix.premultiply(nearest.matrix);
      frame = parent;
    }
    return matrix;
  }
}

// s
export const secondsOf = ({ sec, nsec, nanosec }) => sec + 1e-9 * (nanosec ?? nsec);

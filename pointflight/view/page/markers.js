// visualization_msgs/Marker: what recordings draw with.
import * as THREE from "three";
import { matrixOf, secondsOf } from "./frames.js";

const KIND = { ARROW: 0, CUBE: 1, SPHERE: 2, CYLINDER: 3, LINE_STRIP: 4, LINE_LIST: 5, CUBE_LIST: 6, SPHERE_LIST: 7, POINTS: 8, TRIANGLE_LIST: 11 };
const ACTION = { DELETE: 2, DELETE_ALL: 3 };
const MOST = 5000; // that are drawn at once

const colourOf = ({ r, g, b }) => new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace);
const solidMaterial = (c) =>
  new THREE.MeshStandardMaterial({ color: colourOf(c), roughness: 0.7, transparent: c.a < 1, opacity: c.a, side: THREE.DoubleSide });

// Points lie around the first one: single precision is coarse far from zero.
const middleOf = (points) => points?.[0] ?? { x: 0, y: 0, z: 0 };
const around = (p, middle) => [p.x - middle.x, p.y - middle.y, p.z - middle.z];

function positionsOf(points) {
  const positions = new Float32Array(3 * points.length);
  points.forEach((p, i) => positions.set(around(p, middleOf(points)), 3 * i));
  return new THREE.BufferAttribute(positions, 3);
}

function geometryOf(marker) {
  const { x, y, z } = marker.scale;
  switch (marker.type) {
    case KIND.ARROW:
      return new THREE.ConeGeometry(y / 2, x, 16).rotateZ(-Math.PI / 2).translate(x / 2, 0, 0);
    case KIND.CUBE:
    case KIND.CUBE_LIST:
      return new THREE.BoxGeometry(x, y, z);
    case KIND.SPHERE:
    case KIND.SPHERE_LIST:
      return new THREE.SphereGeometry(0.5, 20, 14).scale(x, y, z);
    case KIND.CYLINDER:
      return new THREE.CylinderGeometry(0.5, 0.5, 1, 24).rotateX(Math.PI / 2).scale(x, y, z);
    default:
      return new THREE.BufferGeometry().setAttribute("position", positionsOf(marker.points));
  }
}

function objectOf(marker) {
  const geometry = geometryOf(marker);
  const { type } = marker;
  if (type === KIND.LINE_STRIP) return new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: colourOf(marker.color) }));
  if (type === KIND.LINE_LIST) return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: colourOf(marker.color) }));
  if (type === KIND.POINTS) return new THREE.Points(geometry, new THREE.PointsMaterial({ color: colourOf(marker.color), size: marker.scale.x }));
  if (type === KIND.TRIANGLE_LIST) geometry.computeVertexNormals();
  else if (type === KIND.CUBE_LIST || type === KIND.SPHERE_LIST) {
    const many = new THREE.InstancedMesh(geometry, solidMaterial(marker.color), marker.points.length);
    const middle = middleOf(marker.points);
    marker.points.forEach((p, i) => many.setMatrixAt(i, new THREE.Matrix4().makeTranslation(...around(p, middle))));
    return many;
  } else if (type > KIND.CYLINDER) return null; // texts and meshes
  return new THREE.Mesh(geometry, solidMaterial(marker.color));
}

export class Markers {
  constructor(scene) {
    this.group = new THREE.Group();
    scene.add(this.group);
    this.known = new Map(); // "namespace id" -> object
  }

  take(list, frames) {
    for (const marker of list) {
      const key = `${marker.ns} ${marker.id}`;
      if (marker.action === ACTION.DELETE_ALL) this.clear();
      this.forget(key);
      if (marker.action === ACTION.DELETE || marker.action === ACTION.DELETE_ALL || this.known.size >= MOST) continue;
      const object = objectOf(marker);
      if (!object) continue;
      object.frustumCulled = false;
      object.matrixAutoUpdate = false;
      object.matrix.multiplyMatrices(frames.toRoot(marker.header.frame_id, secondsOf(marker.header.stamp)), matrixOf(marker.pose.position, marker.pose.orientation));
      const hasOwnShape = marker.type <= KIND.CYLINDER;
      const { x, y, z } = middleOf(hasOwnShape ? [] : marker.points);
      object.matrix.multiply(new THREE.Matrix4().makeTranslation(x, y, z));
      this.known.set(key, object);
      this.group.add(object);
    }
  }

  forget(key) {
    const object = this.known.get(key);
    if (!object) return;
    this.group.remove(object);
    object.geometry.dispose();
    object.material.dispose();
    this.known.delete(key);
  }

  clear() {
    for (const key of [...this.known.keys()]) this.forget(key);
  }
}

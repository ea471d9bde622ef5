import * as THREE from "three";

// The scan as a picture over azimuth and elevation, as its sensor sees it; of points in the world, from `origin` on,
// around a vehicle.
export function drawRange(canvas, cloud, vehicle, origin = new THREE.Vector3()) {
  if (!cloud || (vehicle && !vehicle.state?.p)) return;
  const context = canvas.getContext("2d");
  const image = context.createImageData(canvas.width, canvas.height);
  const inverse = vehicle?.group.quaternion.clone().invert();
  const middle = vehicle?.group.position.clone().sub(origin);
  const p = new THREE.Vector3();
  for (let i = 0; i < cloud.count; ++i) {
    p.fromArray(cloud.positions, 3 * i);
    if (vehicle) p.sub(middle).applyQuaternion(inverse);
    const range = p.length();
    const u = Math.floor((0.5 - Math.atan2(p.y, p.x) / (2 * Math.PI)) * canvas.width);
    const v = Math.floor((0.5 - Math.asin(p.z / range) / (Math.PI * 0.7)) * canvas.height);
    if (u < 0 || v < 0 || u >= canvas.width || v >= canvas.height) continue;
    const near = Math.exp(-range / 12);
    image.data.set([255 * near, 200 * (1 - Math.abs(near - 0.5)), 255 * (1 - near), 255], 4 * (v * canvas.width + u));
  }
  context.putImageData(image, 0, 0);
}

// A frame with eye-dome lighting: what lies behind its neighbours in the picture is darker, which shows
// the shape of points without normals (Boucheny 2009). One more pass over the depths of the frame.
import * as THREE from "three";

const fragment = `
precision highp float;
uniform sampler2D picture, depths;
uniform vec2 pixel;      // of the texture
uniform vec2 planes;     // near and far, m
uniform float strength;  // 0: none
in vec2 place;
out vec4 colour;
float logDepth(vec2 at) {
  float d = texture(depths, at).r;
  return d >= 1.0 ? -1.0 : log2(planes.x * planes.y / (planes.y - d * (planes.y - planes.x)));
}
void main() {
  vec3 c = texture(picture, place).rgb;
  float centre = strength > 0.0 ? logDepth(place) : -1.0;
  if (centre > -1.0) {
    float behind = 0.0;
    for (int i = 0; i < 8; ++i) {
      float a = 0.785398 * float(i);
      float there = logDepth(place + pixel * vec2(cos(a), sin(a)));
      if (there > -1.0) behind += clamp(centre - there, 0.0, 0.2);
    }
    c *= max(0.3, exp(-strength * behind / 8.0));
  }
  colour = vec4(mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)), 1.0);
}`;
const vertex = `
out vec2 place;
void main() {
  place = position.xy * 0.5 + 0.5;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}`;

export class EyeDome {
  constructor(renderer, samples) {
    this.renderer = renderer;
    this.isOn = true;
    this.target = new THREE.WebGLRenderTarget(1, 1, { samples, colorSpace: THREE.SRGBColorSpace });
    this.target.depthTexture = new THREE.DepthTexture(1, 1, THREE.UnsignedIntType);
    this.material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      depthTest: false,
      depthWrite: false,
      uniforms: {
        picture: { value: this.target.texture },
        depths: { value: this.target.depthTexture },
        pixel: { value: new THREE.Vector2() },
        planes: { value: new THREE.Vector2() },
        strength: { value: 0 },
      },
      vertexShader: vertex,
      fragmentShader: fragment,
    });
    const triangle = new THREE.BufferGeometry();
    triangle.setAttribute("position", new THREE.BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    const mesh = new THREE.Mesh(triangle, this.material);
    mesh.frustumCulled = false;
    this.scene = new THREE.Scene();
    this.scene.add(mesh);
    this.camera = new THREE.Camera();
  }

  render(scene, camera) {
    const size = this.renderer.getDrawingBufferSize(new THREE.Vector2());
    if (size.x !== this.target.width || size.y !== this.target.height) this.target.setSize(size.x, size.y);
    const { uniforms } = this.material;
    const reach = 1.4 * Math.min(devicePixelRatio, 2);
    uniforms.pixel.value.set(reach / size.x, reach / size.y);
    uniforms.planes.value.set(camera.near, camera.far);
    uniforms.strength.value = this.isOn ? 25 : 0;
    this.renderer.setRenderTarget(this.target);
    this.renderer.render(scene, camera);
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.scene, this.camera);
  }
}

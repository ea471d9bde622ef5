// Colours that shaders and legends share. Frames are drawn in linear light: `linear` is for colours as screens have them.

// Turbo (Mikhailov, Google 2019), its polynomial of degree five.
const R = [0.13572138, 4.6153926, -42.66032258, 132.13108234, -152.94239396, 59.28637943];
const G = [0.09140261, 2.19418839, 4.84296658, -14.18503333, 4.27729857, 2.82956604];
const B = [0.1066733, 12.64194608, -60.58204836, 110.36276771, -89.90310912, 27.34824973];
const polynomial = (c) => c.reduceRight((sum, k) => `(${k.toFixed(8)} + x * ${sum})`, "0.0");

export const turbo = `
vec3 turbo(float x) {
  x = clamp(x, 0.0, 1.0);
  return clamp(vec3(${polynomial(R)}, ${polynomial(G)}, ${polynomial(B)}), 0.0, 1.0);
}
// without its darkest ends
vec3 turboOfHeight(float z, vec2 heights) {
  return turbo(0.08 + 0.84 * clamp((z - heights.x) / max(0.1, heights.y - heights.x), 0.0, 1.0));
}
vec3 linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
`;

const at = (c, x) => Math.max(0, Math.min(1, c.reduceRight((sum, k) => k + x * sum, 0)));
export const turboCss = (x) => `rgb(${[R, G, B].map((c) => Math.round(255 * at(c, x))).join(" ")})`;

// CSS stops of the height's colours, low to high.
export const heightStops = () => Array.from({ length: 13 }, (_, i) => turboCss(0.08 + (0.84 * i) / 12)).join(", ");

// How planar a surfel is: SurfelWord's thickness is 0 if it is flat.
export const FLAT_LEVEL = [0.55, 0.75, 0.85];
export const FLAT_STEEP = [0.3, 0.55, 0.75];
export const ROUGH = [0.85, 0.55, 0.25];
export const css = (c) => `rgb(${c.map((v) => Math.round(255 * v)).join(" ")})`;
export const glsl = (c) => `vec3(${c.map((v) => v.toFixed(3)).join(", ")})`;

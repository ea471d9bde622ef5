// What the map's colours mean: a bar with the ends' values, or names.
import { FLAT_LEVEL, FLAT_STEEP, ROUGH, css, heightStops } from "./colours.js";

const element = (tag, words, style = {}) => {
  const made = document.createElement(tag);
  made.textContent = words;
  Object.assign(made.style, style);
  return made;
};

// As a person would round it: two digits of the span.
function rounded(value, span) {
  const digits = Math.max(0, 1 - Math.floor(Math.log10(Math.max(1e-6, span))));
  const words = value.toFixed(Math.min(3, digits));
  return Number(words) === 0 ? "0" : words;
}

function bar(place, title, stops, [low, high], unit) {
  const middle = 0.5 * (low + high);
  const labels = element("div", "", { display: "flex", justifyContent: "space-between" });
  for (const v of [low, middle, high]) labels.append(element("span", rounded(v, high - low)));
  place.replaceChildren(
    element("div", unit ? `${title}, ${unit}` : title),
    element("div", "", { height: "8px", borderRadius: "3px", background: `linear-gradient(to right, ${stops})` }),
    labels,
  );
}

export function showLegend(place, colouring, map) {
  place.style.display = "block";
  if (colouring === "height") {
    const { x, y } = map.uniforms.heights.value;
    bar(place, "height", heightStops(), [x, y], "m");
  } else if (colouring === "intensity") {
    const { zero, step } = map.intensity;
    bar(place, "intensity", "rgb(38 38 38), white", [zero, zero + 255 * step], "");
  } else {
    const names = [["flat, level", FLAT_LEVEL], ["flat, steep", FLAT_STEEP], ["rough", ROUGH]];
    const rows = names.map(([name, colour]) => {
      const row = element("div", "", { display: "flex", gap: "6px", alignItems: "center" });
      row.append(element("span", "", { width: "10px", height: "10px", borderRadius: "2px", background: css(colour) }), element("span", name));
      return row;
    });
    place.replaceChildren(...rows);
  }
}

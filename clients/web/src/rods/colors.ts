import { el, number } from "../controls/dom";

/** From dark blue over green to yellow (an approximation of viridis), readable without seeing red and green apart. */
const STOPS: [number, number, number][] = [
  [0.267, 0.005, 0.329],
  [0.229, 0.322, 0.546],
  [0.128, 0.567, 0.551],
  [0.369, 0.789, 0.383],
  [0.993, 0.906, 0.144],
];

/** GLSL: colour of a value in 0 .. 1; below 0: grey, not known. */
export const COLOR_MAP = `
vec3 colorOf(float value) {
  if (value < -0.5) return vec3(0.6);
  float x = clamp(value, 0.0, 1.0) * 4.0;
  vec3 c[5] = vec3[5](${STOPS.map((rgb) => `vec3(${rgb.map((part) => part.toFixed(3)).join(",")})`).join(",")});
  int i = min(int(x), 3);
  vec3 mixed = mix(c[i], c[i + 1], x - float(i));
  return pow(mixed, vec3(2.2));
}
`;

function cssColor(share: number): string {
  const x = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
  const i = Math.min(Math.floor(x), STOPS.length - 2);
  const parts = [0, 1, 2].map((c) => {
    const a = STOPS[i]?.[c] ?? 0;
    return Math.round(255 * (a + ((STOPS[i + 1]?.[c] ?? a) - a) * (x - i)));
  });
  return `rgb(${parts.join()})`;
}

/** Meaning of colours, with the ends of their range. */
export class Legend {
  readonly element = el("div", { class: "legend", hidden: true });

  /** title "": none. */
  show(title: string, low = 0, high = 0, unit = ""): void {
    this.element.hidden = title === "";
    if (title === "") return;
    const canvas = el("canvas", { width: 180, height: 12, "aria-hidden": "true" });
    const context = canvas.getContext("2d");
    for (let x = 0; context && x < 180; x++) {
      context.fillStyle = cssColor(x / 179);
      context.fillRect(x, 0, 1, 12);
    }
    this.element.replaceChildren(
      title,
      canvas,
      el("div", { class: "ends" }, el("span", {}, `${number(low)} ${unit}`), el("span", {}, `${number(high)} ${unit}`)),
    );
  }
}

/**
 * Values as shares of their range; not a number: -1, not known. `floor`: smaller values are 0 but for rounding, and no
 * range is narrower, so that nothing is coloured by rounding.
 */
export function normalize(given: Float32Array, floor: number): { shares: Float32Array; low: number; high: number } {
  const values = given.map((value) => (Math.abs(value) < floor ? 0 : value));
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return { shares: new Float32Array(values.length).fill(-1), low: 0, high: 0 };
  const range = Math.max(high - low, floor, 1e-30);
  return { shares: values.map((value) => (Number.isFinite(value) ? (value - low) / range : -1)), low, high };
}

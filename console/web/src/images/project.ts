import type { Rigid } from "./frames";

/// A lens in the reduced image of its camera, as foxglove.CameraCalibration says.
export interface LensModel {
  frame: string;
  width: number;
  height: number;
  isFisheye: boolean; // kannala_brandt: k1 k2 k3 k4; otherwise plumb_bob: k1 k2 p1 p2 k3
  D: readonly number[];
  fx: number;
  fy: number;
  cx: number;
  cy: number;
}

const kWidestFisheye = (100 / 180) * Math.PI;

/// Returns the pixel of a place in the lens's frame (x right, y down, z along the axis), or nothing if the lens cannot see
/// it. Beyond the angle at which its polynomial turns back, a lens sees nothing.
export function project(lens: LensModel, x: number, y: number, z: number): [number, number] | undefined {
  const k = (i: number): number => lens.D[i] ?? 0;
  const across = Math.hypot(x, y);
  if (lens.isFisheye) {
    const a = Math.atan2(across, z);
    if (a > kWidestFisheye) return undefined;
    const a2 = a * a;
    const slope = 1 + a2 * (3 * k(0) + a2 * (5 * k(1) + a2 * (7 * k(2) + a2 * 9 * k(3))));
    if (slope <= 0) return undefined;
    const bent = a * (1 + a2 * (k(0) + a2 * (k(1) + a2 * (k(2) + a2 * k(3)))));
    const scale = across > 1e-9 ? bent / across : 0;
    return [lens.fx * x * scale + lens.cx, lens.fy * y * scale + lens.cy];
  }
  if (z < 0.1 * across || z <= 0) return undefined;
  const a = x / z, b = y / z, r2 = a * a + b * b;
  const slope = 1 + r2 * (3 * k(0) + r2 * (5 * k(1) + r2 * 7 * k(4)));
  if (slope <= 0) return undefined;
  const radial = 1 + r2 * (k(0) + r2 * (k(1) + r2 * k(4)));
  return [
    lens.fx * (a * radial + 2 * k(2) * a * b + k(3) * (r2 + 2 * a * a)) + lens.cx,
    lens.fy * (b * radial + k(2) * (r2 + 2 * b * b) + 2 * k(3) * a * b) + lens.cy,
  ];
}

/// Laser points in an image: three values each, column and row in px and distance in m.
export type Seen = Float32Array;

const kCell = 12; // px; in a cell only what is near the nearest point is seen
const kFarthest = 80; // m

/// Projects places (east, north, up) into an image by the lenses that share it, at most `most` of what they see. A pixel belongs to the lens whose
/// centre is the nearest, because lenses that share an image have parts of equal size. Of points behind one another the nearest are kept.
export function overlay(places: Float32Array, lenses: readonly { model: LensModel; T_lens_enu: Rigid }[], most: number): Seen {
  const width = Math.max(0, ...lenses.map(({ model }) => model.width)), height = Math.max(0, ...lenses.map(({ model }) => model.height));
  const columns = Math.ceil(width / kCell);
  const nearest = new Float32Array(columns * Math.ceil(height / kCell)).fill(Infinity);
  const cell = (u: number, v: number): number => Math.floor(v / kCell) * columns + Math.floor(u / kCell);
  const found: number[] = [];
  for (const { model, T_lens_enu } of lenses) {
    const { R, t } = T_lens_enu;
    const others = lenses.filter((one) => one.model !== model);
    for (let i = 0; i + 2 < places.length; i += 3) {
      const e = places[i]!, n = places[i + 1]!, h = places[i + 2]!;
      const x = R[0]! * e + R[1]! * n + R[2]! * h + t[0];
      const y = R[3]! * e + R[4]! * n + R[5]! * h + t[1];
      const z = R[6]! * e + R[7]! * n + R[8]! * h + t[2];
      const distance = Math.sqrt(x * x + y * y + z * z);
      if (distance > kFarthest || distance < 0.5) continue;
      const pixel = project(model, x, y, z);
      if (!pixel) continue;
      const [u, v] = pixel;
      if (u < 0 || v < 0 || u >= model.width || v >= model.height) continue;
      const own = (u - model.cx) ** 2 + (v - model.cy) ** 2;
      if (others.some(({ model: other }) => (u - other.cx) ** 2 + (v - other.cy) ** 2 < own)) continue;
      found.push(u, v, distance);
      const at = cell(u, v);
      if (distance < nearest[at]!) nearest[at] = distance;
    }
  }
  const isInSight = (i: number): boolean => found[i + 2]! <= 1.1 * nearest[cell(found[i]!, found[i + 1]!)]! + 0.3;
  let count = 0;
  for (let i = 0; i < found.length; i += 3) if (isInSight(i)) ++count;
  // Of too many, points all over the image: the k-th is kept where k * most / count steps to a new whole number.
  const share = Math.min(1, most / Math.max(1, count));
  const seen = new Float32Array(3 * Math.floor(share * count + 1e-6));
  for (let i = 0, k = 0, kept = 0; i < found.length; i += 3) {
    if (!isInSight(i) || ++k * share + 1e-6 < kept + 1) continue;
    for (let j = 0; j < 3; ++j) seen[3 * kept + j] = found[i + j]!;
    ++kept;
  }
  return seen;
}

/// Colours of distances as pixels (RGBA in memory): red at 2 m, blue from 16 m on.
const kColours = 64;
const palette = new Uint32Array(kColours).map((_, i) => {
  const hue = (240 * i) / (kColours - 1);
  const part = (shift: number): number => {
    const k = (shift + hue / 30) % 12;
    return Math.round(255 * (0.55 - 0.45 * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  };
  return new Uint32Array(new Uint8Array([part(0), part(8), part(4), 255]).buffer)[0]!;
});

/// Draws points as squares into the pixels of an image, which are RGBA.
export function drawSeen(seen: Seen, pixels: Uint32Array, width: number, height: number): void {
  const side = Math.max(2, Math.round(width / 500));
  for (let i = 0; i < seen.length; i += 3) {
    const left = Math.round(seen[i]! - side / 2), top = Math.round(seen[i + 1]! - side / 2);
    const place = Math.min(1, Math.log2(Math.max(seen[i + 2]!, 2) / 2) / 3);
    const colour = palette[Math.round(place * (kColours - 1))]!;
    for (let v = Math.max(0, top); v < Math.min(height, top + side); ++v)
      for (let u = Math.max(0, left); u < Math.min(width, left + side); ++u) pixels[v * width + u] = colour;
  }
}

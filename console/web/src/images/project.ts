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

/// A laser point in an image: column, row, distance in m.
export type Seen = [u: number, v: number, distance: number];

const kCell = 12; // px; in a cell only what is near the nearest point is seen
const kFarthest = 80; // m

/// Projects places (east, north, up) into an image by the lenses that share it. A pixel belongs to the lens whose centre is
/// the nearest, because lenses that share an image have parts of equal size. Of points behind one another the nearest are kept.
export function overlay(places: Float32Array, lenses: readonly { model: LensModel; T_lens_enu: Rigid }[]): Seen[] {
  const found: Seen[] = [];
  for (const { model, T_lens_enu } of lenses) {
    const { R, t } = T_lens_enu;
    for (let i = 0; i + 2 < places.length; i += 3) {
      const e = places[i]!, n = places[i + 1]!, h = places[i + 2]!;
      const x = R[0]! * e + R[1]! * n + R[2]! * h + t[0];
      const y = R[3]! * e + R[4]! * n + R[5]! * h + t[1];
      const z = R[6]! * e + R[7]! * n + R[8]! * h + t[2];
      const distance = Math.hypot(x, y, z);
      if (distance > kFarthest || distance < 0.5) continue;
      const pixel = project(model, x, y, z);
      if (!pixel) continue;
      const [u, v] = pixel;
      if (u < 0 || v < 0 || u >= model.width || v >= model.height) continue;
      const own = (u - model.cx) ** 2 + (v - model.cy) ** 2;
      if (lenses.some(({ model: other }) => (u - other.cx) ** 2 + (v - other.cy) ** 2 < own)) continue;
      found.push([u, v, distance]);
    }
  }
  const nearest = new Map<number, number>();
  const cell = ([u, v]: Seen): number => Math.floor(v / kCell) * 65536 + Math.floor(u / kCell);
  for (const one of found) {
    const key = cell(one), least = nearest.get(key);
    if (least === undefined || one[2] < least) nearest.set(key, one[2]);
  }
  return found.filter((one) => one[2] <= 1.1 * nearest.get(cell(one))! + 0.3);
}

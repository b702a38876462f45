/// Points taken from a foxglove.PointCloud, in the form in which the graphics processor gets them.
export interface Points {
  count: number;
  place: Float32Array; // east, north, up in m, 3 a point
  colour: Uint8Array; // red, green, blue, quality, 4 a point; quality 0: without a colour
  extra: Uint8Array; // intensity, moving, sigma in steps of 2 mm (255: more, or unknown), code of the exposure, 4 a point
}

interface Field {
  name: string;
  offset: number;
  type: number;
}
export interface PointCloudMessage {
  frameId: string;
  pointStride: number;
  fields: Field[];
  data: Uint8Array;
}

const kUint8 = 1;
const kUint32 = 5;
const kFloat32 = 7;
const kSigmaStep = 0.002;

/// The fields beyond place and colour that clouds of this feed can have.
export type ExtraField = "intensity" | "moving" | "sigma" | "exposure";

/// Takes the points out of a message. Points whose place is not finite are left out. Throws an Error with the reason if
/// the message contradicts itself.
export function readPoints(message: PointCloudMessage): Points & { has: Set<ExtraField> } {
  const { data, pointStride: stride } = message;
  const field = (name: string, type: number): number => {
    const found = message.fields.find((one) => one.name === name);
    if (!found) return -1;
    if (found.type !== type) throw new Error(`cloud: field ${name} has type ${found.type} instead of ${type}`);
    const size = type === kUint8 ? 1 : 4;
    if (found.offset + size > stride) throw new Error(`cloud: field ${name} ends behind the point's ${stride} bytes`);
    return found.offset;
  };
  if (stride < 12) throw new Error(`cloud: a point has ${stride} bytes`);
  const x = field("x", kFloat32), y = field("y", kFloat32), z = field("z", kFloat32);
  if (x < 0 || y < 0 || z < 0) throw new Error("cloud: a field of x, y, z is missing");
  if (data.byteLength % stride !== 0) throw new Error(`cloud: ${data.byteLength} bytes are no whole points of ${stride}`);
  const bytes = ["red", "green", "blue", "quality", "intensity", "moving"].map((name) => field(name, kUint8));
  const [red, green, blue, quality, intensity, moving] = bytes as [number, number, number, number, number, number];
  const sigma = field("sigma", kFloat32), exposure = field("exposure", kUint32);

  const most = data.byteLength / stride;
  const place = new Float32Array(3 * most), colour = new Uint8Array(4 * most), extra = new Uint8Array(4 * most);
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  let count = 0;
  for (let at = 0; at < data.byteLength; at += stride) {
    const east = view.getFloat32(at + x, true), north = view.getFloat32(at + y, true), up = view.getFloat32(at + z, true);
    if (!Number.isFinite(east + north + up)) continue;
    place[3 * count] = east;
    place[3 * count + 1] = north;
    place[3 * count + 2] = up;
    const c = 4 * count;
    if (red >= 0 && green >= 0 && blue >= 0) {
      colour[c] = data[at + red]!;
      colour[c + 1] = data[at + green]!;
      colour[c + 2] = data[at + blue]!;
    }
    colour[c + 3] = quality < 0 ? 255 : data[at + quality]!;
    if (intensity >= 0) extra[c] = data[at + intensity]!;
    if (moving >= 0) extra[c + 1] = data[at + moving]!;
    const metres = sigma < 0 ? NaN : view.getFloat32(at + sigma, true);
    extra[c + 2] = metres >= 0 ? Math.min(255, Math.round(metres / kSigmaStep)) : 255;
    if (exposure >= 0) {
      const index = view.getUint32(at + exposure, true);
      extra[c + 3] = index === 0xffffffff ? 0 : 1 + (index % 255);
    }
    ++count;
  }
  const has = new Set<ExtraField>();
  if (intensity >= 0) has.add("intensity");
  if (moving >= 0) has.add("moving");
  if (sigma >= 0) has.add("sigma");
  if (exposure >= 0) has.add("exposure");
  return {
    count,
    place: place.subarray(0, 3 * count),
    colour: colour.subarray(0, 4 * count),
    extra: extra.subarray(0, 4 * count),
    has,
  };
}

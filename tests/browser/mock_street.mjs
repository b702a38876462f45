// A made street for the tests of the page: a vehicle that drives around a block between houses, and what its scanner would see.
// It says nothing about the program; it only gives the page something to draw.

const kSpeed = 8; // m/s
const kSide = 120; // m, of the block

/// Where the vehicle is after `t` seconds: east, north, and heading clockwise from north, rad.
export function vehicleAt(t) {
  const way = (kSpeed * t) % (4 * kSide);
  const side = Math.floor(way / kSide), along = way - side * kSide;
  const corners = [[0, 0], [0, kSide], [kSide, kSide], [kSide, 0]];
  const heading = (side * Math.PI) / 2;
  const [east, north] = corners[side];
  return { east: east + Math.sin(heading) * along, north: north + Math.cos(heading) * along, heading, speed: kSpeed };
}

/// The colour of a map there: the street, houses beside it, and grass.
export function groundAt(east, north) {
  const d = Math.max(Math.abs(east - kSide / 2), Math.abs(north - kSide / 2)) - kSide / 2; // from the middle of the road, outward
  if (Math.abs(d) < 6) return [190, 60, 190];
  if (Math.abs(d) < 22 && (((east + north) % 24) + 24) % 24 < 16) return [205, 190, 175];
  return [200, 222, 190];
}

let seed = 7;
const random = () => (seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0) / 4294967296;

/// `count` points around the vehicle, packed as the feed packs them: x y z float32, red green blue alpha intensity quality moving
/// uint8, sigma float32, exposure uint32. `coloured` is the share that has a colour.
export const kStride = 27;
export const kFields = [
  ["x", 0, 7], ["y", 4, 7], ["z", 8, 7], ["red", 12, 1], ["green", 13, 1], ["blue", 14, 1], ["alpha", 15, 1], ["intensity", 16, 1],
  ["quality", 17, 1], ["moving", 18, 1], ["sigma", 19, 7], ["exposure", 23, 5],
].map(([name, offset, type]) => ({ name, offset, type }));

export function pointsAt(t, count, coloured = 0.95) {
  const { east, north, heading } = vehicleAt(t);
  const bytes = Buffer.alloc(count * kStride);
  for (let i = 0; i < count; ++i) {
    const ahead = (random() - 0.5) * 16;
    const kind = random();
    let across, up, colour, moving = 0;
    if (kind < 0.4) { // road and pavement
      across = (random() - 0.5) * 18;
      up = Math.abs(across) > 5 ? 0.12 : 0;
      colour = Math.abs(across) > 5 ? [150, 146, 140] : Math.abs(Math.abs(across) - 0.1) < 0.1 ? [235, 235, 230] : [82, 84, 88];
    } else if (kind < 0.9) { // houses
      across = Math.sign(random() - 0.5) * (9 + random() * 0.1);
      up = random() * 9;
      const place = Math.floor((east + north + ahead + 500) / 12) + (across > 0 ? 3 : 0);
      const isWindow = (((east + north + ahead) % 3) + 3) % 3 < 1.2 && up % 3 > 1;
      colour = isWindow ? [70, 90, 110] : [[196, 120, 92], [222, 205, 160], [168, 178, 190], [205, 170, 130]][((place % 4) + 4) % 4];
    } else if (kind < 0.97) { // trees
      const angle = random() * 6.28, r = 1.6 * Math.sqrt(random());
      across = 6.4 + r * Math.cos(angle);
      up = 2.5 + r * Math.sin(angle) + 1.2;
      colour = [60, 110 + random() * 50, 50];
    } else { // a car in the other lane
      across = -3 + random() * 1.8;
      up = random() * 1.5;
      colour = [30, 60, 160];
      moving = 230;
    }
    const x = east + Math.sin(heading) * ahead + Math.cos(heading) * across;
    const y = north + Math.cos(heading) * ahead - Math.sin(heading) * across;
    const at = i * kStride;
    bytes.writeFloatLE(x, at);
    bytes.writeFloatLE(y, at + 4);
    bytes.writeFloatLE(up - 2 + (random() - 0.5) * 0.03, at + 8);
    const has = random() < coloured;
    const light = 0.9 + 0.2 * random();
    if (has) for (let k = 0; k < 3; ++k) bytes[at + 12 + k] = Math.min(255, colour[k] * light);
    bytes[at + 15] = 255;
    bytes[at + 16] = (colour[0] + colour[1]) / 2;
    bytes[at + 17] = has ? 120 + 120 * random() : 0;
    bytes[at + 18] = moving;
    bytes.writeFloatLE(0.01 + Math.abs(across) * 0.004, at + 19);
    bytes.writeUInt32LE(has ? Math.floor(t) : 0xffffffff, at + 23);
  }
  return bytes;
}

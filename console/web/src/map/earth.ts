/// A place on the WGS 84 ellipsoid, degrees.
export interface Place {
  latitude_deg: number;
  longitude_deg: number;
}

const kA = 6378137; // semi-major axis, m
const kE2 = 0.00669437999014; // first eccentricity squared
const kRad = Math.PI / 180;

/// The plane that touches the earth at a drive's origin, with metres east and north, as the program's frame enu has them. Both ways are exact for
/// places at the origin's height; 10 km away from it, 100 m more height move a place by 16 cm.
export class LocalPlane {
  readonly origin: Place & { height_m: number };
  #at: [number, number, number];
  #sinLat: number;
  #cosLat: number;
  #sinLon: number;
  #cosLon: number;

  constructor(origin: Place & { height_m: number }) {
    this.origin = origin;
    [this.#sinLat, this.#cosLat] = [Math.sin(origin.latitude_deg * kRad), Math.cos(origin.latitude_deg * kRad)];
    [this.#sinLon, this.#cosLon] = [Math.sin(origin.longitude_deg * kRad), Math.cos(origin.longitude_deg * kRad)];
    this.#at = this.#ecef(origin);
  }

  /// Metres east and north of the origin.
  local(place: Place): { east: number; north: number } {
    const [px, py, pz] = this.#ecef(place), [ox, oy, oz] = this.#at;
    const [x, y, z] = [px - ox, py - oy, pz - oz];
    const outward = this.#cosLon * x + this.#sinLon * y; // from the earth's axis
    return { east: -this.#sinLon * x + this.#cosLon * y, north: -this.#sinLat * outward + this.#cosLat * z };
  }

  place(east: number, north: number): Place {
    // The surface falls away from the plane; what that moves sideways is found in a few steps.
    const { latitude_deg, longitude_deg } = this.origin;
    const w = Math.sqrt(1 - kE2 * this.#sinLat ** 2);
    const perLatitude = (kA * (1 - kE2)) / w ** 3 * kRad, perLongitude = Math.max(1, (kA / w) * this.#cosLat * kRad);
    const found = { latitude_deg, longitude_deg };
    for (let i = 0; i < 4; ++i) {
      const at = this.local(found);
      found.latitude_deg += (north - at.north) / perLatitude;
      found.longitude_deg += (east - at.east) / perLongitude;
    }
    return found;
  }

  #ecef({ latitude_deg, longitude_deg }: Place): [number, number, number] {
    const s = Math.sin(latitude_deg * kRad), c = Math.cos(latitude_deg * kRad);
    const n = kA / Math.sqrt(1 - kE2 * s * s), h = this.origin.height_m;
    return [(n + h) * c * Math.cos(longitude_deg * kRad), (n + h) * c * Math.sin(longitude_deg * kRad), (n * (1 - kE2) + h) * s];
  }
}

/// Web maps' square of the world (EPSG:3857), 0 to 1 eastward from the antimeridian and southward from 85.05 degrees.
export const kMostLatitude = 85.0511287798;
export function toWebMercator({ latitude_deg, longitude_deg }: Place): { x: number; y: number } {
  const s = Math.sin(Math.min(kMostLatitude, Math.max(-kMostLatitude, latitude_deg)) * kRad);
  return { x: longitude_deg / 360 + 0.5, y: 0.5 - Math.atanh(s) / (2 * Math.PI) };
}
export function fromWebMercator(x: number, y: number): Place {
  return { latitude_deg: Math.asin(Math.tanh((0.5 - y) * 2 * Math.PI)) / kRad, longitude_deg: (x - 0.5) * 360 };
}

/// Where frames are: rotation (a matrix, row by row) and translation of p_parent = R p_child + t.
export interface Rigid {
  R: readonly number[]; // 9
  t: readonly [number, number, number];
}
interface Vector {
  x: number;
  y: number;
  z: number;
}
interface Quaternion extends Vector {
  w: number;
}

export function rigid(q: Quaternion, t: Vector): Rigid {
  const n = Math.hypot(q.x, q.y, q.z, q.w) || 1;
  const x = q.x / n, y = q.y / n, z = q.z / n, w = q.w / n;
  return {
    R: [
      1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
      2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
      2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ],
    t: [t.x, t.y, t.z],
  };
}

export function compose(a: Rigid, b: Rigid): Rigid {
  const R: number[] = [];
  for (let i = 0; i < 3; ++i)
    for (let j = 0; j < 3; ++j) R.push(a.R[3 * i]! * b.R[j]! + a.R[3 * i + 1]! * b.R[3 + j]! + a.R[3 * i + 2]! * b.R[6 + j]!);
  const at = (i: number): number => a.R[3 * i]! * b.t[0] + a.R[3 * i + 1]! * b.t[1] + a.R[3 * i + 2]! * b.t[2] + a.t[i]!;
  return { R, t: [at(0), at(1), at(2)] };
}

export function inverse({ R, t }: Rigid): Rigid {
  const Rt = [R[0]!, R[3]!, R[6]!, R[1]!, R[4]!, R[7]!, R[2]!, R[5]!, R[8]!];
  const at = (i: number): number => -(Rt[3 * i]! * t[0] + Rt[3 * i + 1]! * t[1] + Rt[3 * i + 2]! * t[2]);
  return { R: Rt, t: [at(0), at(1), at(2)] };
}

const kIdentity: Rigid = { R: [1, 0, 0, 0, 1, 0, 0, 0, 1], t: [0, 0, 0] };
const kMostPoses = 200; // 20 s at 10 Hz
const kLongestGapNs = 500_000_000n;
const kDeepest = 8; // frames above one another; a ring of frames ends here

/// What the feed says of frames: what is mounted on the vehicle, and where the vehicle was.
export class Frames {
  #mounted = new Map<string, { parent: string; T: Rigid }>();
  #poses: { ns: bigint; q: Quaternion; t: Vector }[] = [];

  mount(parent: string, child: string, T: Rigid): void {
    this.#mounted.set(child, { parent, T });
  }
  /// Takes the vehicle's pose, T_enu_body. Poses come in the order of their times; one that goes back begins anew.
  pose(ns: bigint, q: Quaternion, t: Vector): void {
    if (this.#poses.length > 0 && ns <= this.#poses.at(-1)!.ns) this.#poses = [];
    this.#poses.push({ ns, q, t });
    if (this.#poses.length > kMostPoses) this.#poses.shift();
  }

  /// T_body_frame, or nothing if the frame is not mounted on the body.
  onBody(frame: string): Rigid | undefined {
    let T = kIdentity;
    for (let name = frame, deep = 0; deep < kDeepest; ++deep) {
      if (name === "body") return T;
      const mounted = this.#mounted.get(name);
      if (!mounted) return undefined;
      T = compose(mounted.T, T);
      name = mounted.parent;
    }
    return undefined;
  }

  /// T_enu_body at a time between two poses that are near enough to each other.
  bodyAt(ns: bigint): Rigid | undefined {
    const after = this.#poses.findIndex((one) => one.ns >= ns);
    if (after < 0) return undefined;
    const b = this.#poses[after]!, a = this.#poses[after - 1];
    if (b.ns === ns) return rigid(b.q, b.t);
    if (!a || b.ns - a.ns > kLongestGapNs) return undefined;
    const part = Number(ns - a.ns) / Number(b.ns - a.ns);
    const sign = a.q.x * b.q.x + a.q.y * b.q.y + a.q.z * b.q.z + a.q.w * b.q.w < 0 ? -1 : 1;
    const mix = (from: number, to: number): number => from + part * (to - from);
    return rigid(
      { x: mix(a.q.x, sign * b.q.x), y: mix(a.q.y, sign * b.q.y), z: mix(a.q.z, sign * b.q.z), w: mix(a.q.w, sign * b.q.w) },
      { x: mix(a.t.x, b.t.x), y: mix(a.t.y, b.t.y), z: mix(a.t.z, b.t.z) },
    );
  }
}

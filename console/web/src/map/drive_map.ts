import type { DriveSecond, Mark } from "../link/messages";

/// What is wrong with a second of the drive, for the map.
export type Kind = "coloured" | "pale" | "hole";

const kColouredShare = 0.5; // of the points
const kLongestStep = 60; // m between two seconds; beyond, the line is broken

export function kindOf([, , , points, coloured]: DriveSecond): Kind {
  if (points <= 0) return "hole";
  return coloured / points < kColouredShare ? "pale" : "coloured";
}
const weakFixes = new Set(["None", "Single", "Dgnss", "RtkFloat"]);
export const isWeak = (second: DriveSecond): boolean => second[6] !== null && weakFixes.has(second[6]);

/// The driven path by what it gave, m.
export function lengths(seconds: readonly DriveSecond[]): Record<Kind | "weak" | "all", number> {
  const sum = { coloured: 0, pale: 0, hole: 0, weak: 0, all: 0 };
  for (let i = 1; i < seconds.length; ++i) {
    const step = stepTo(seconds, i);
    if (step > kLongestStep) continue;
    sum.all += step;
    sum[kindOf(seconds[i]!)] += step;
    if (isWeak(seconds[i]!)) sum.weak += step;
  }
  return sum;
}
function stepTo(seconds: readonly DriveSecond[], i: number): number {
  const a = seconds[i - 1]!, b = seconds[i]!;
  return Math.hypot(b[1] - a[1], b[2] - a[2]);
}

export interface Sight {
  east: number; // of the middle, m
  north: number;
  scale: number; // px a m
}
export interface Ink {
  paper: string;
  grid: string;
  text: string;
  coloured: string;
  pale: string;
  hole: string;
  weak: string;
  vehicle: string;
  background: number; // how much of a map below the drive is seen, 0 to 1
}

/// The sight that shows all of it, with a border of `margin` px above and below.
export function whole(seconds: readonly DriveSecond[], width: number, height: number, margin = 0): Sight {
  let w = Infinity, e = -Infinity, s = Infinity, n = -Infinity;
  for (const [, east, north] of seconds) {
    w = Math.min(w, east); e = Math.max(e, east); s = Math.min(s, north); n = Math.max(n, north);
  }
  if (!Number.isFinite(w)) return { east: 0, north: 0, scale: 1 };
  const scale = 0.85 * Math.min(width / Math.max(e - w, 40), Math.max(50, height - 2 * margin) / Math.max(n - s, 40));
  return { east: (w + e) / 2, north: (s + n) / 2, scale };
}

/// 1, 2 or 5 times a power of ten, at most `most`.
export function roundStep(most: number): number {
  const power = 10 ** Math.floor(Math.log10(most));
  return [5, 2, 1].map((n) => n * power).find((step) => step <= most) ?? power;
}

// Kinds differ by colour and by dashes.
const dashes: Record<Kind, number[]> = { coloured: [], pale: [8, 4], hole: [2, 6] };

/// Draws the drive. `heading` is that of the vehicle, clockwise from north, rad. `background` draws what lies below it; without one there is a grid.
export function drawMap(
  canvas: CanvasRenderingContext2D,
  size: { width: number; height: number; ratio: number },
  sight: Sight,
  seconds: readonly DriveSecond[],
  marks: readonly (Mark & { east: number; north: number })[],
  heading: number | null,
  ink: Ink,
  background?: () => void,
): void {
  const { width, height } = size;
  const x = (east: number): number => width / 2 + (east - sight.east) * sight.scale;
  const y = (north: number): number => height / 2 - (north - sight.north) * sight.scale;
  canvas.setTransform(size.ratio, 0, 0, size.ratio, 0, 0);
  canvas.setLineDash([]);
  canvas.fillStyle = ink.paper;
  canvas.fillRect(0, 0, width, height);
  if (background) {
    canvas.save();
    background();
    canvas.restore();
    canvas.globalAlpha = 1 - ink.background;
    canvas.fillRect(0, 0, width, height);
    canvas.globalAlpha = 1;
  } else {
    const step = roundStep(160 / sight.scale);
    canvas.strokeStyle = ink.grid;
    canvas.lineWidth = 1;
    canvas.beginPath();
    for (let e = Math.ceil((sight.east - width / 2 / sight.scale) / step) * step; x(e) < width; e += step) canvas.moveTo(x(e), 0), canvas.lineTo(x(e), height);
    for (let n = Math.ceil((sight.north - height / 2 / sight.scale) / step) * step; y(n) > 0; n += step) canvas.moveTo(0, y(n)), canvas.lineTo(width, y(n));
    canvas.stroke();
  }

  // Lines of one kind are drawn in one go; the dashes then run on across seconds.
  const line = (choose: (second: DriveSecond) => boolean): void => {
    canvas.beginPath();
    let drawing = false;
    for (let i = 1; i < seconds.length; ++i) {
      const a = seconds[i - 1]!, b = seconds[i]!;
      if (!choose(b) || stepTo(seconds, i) > kLongestStep) {
        drawing = false;
        continue;
      }
      if (!drawing) canvas.moveTo(x(a[1]), y(a[2]));
      canvas.lineTo(x(b[1]), y(b[2]));
      drawing = true;
    }
    canvas.stroke();
  };
  canvas.lineJoin = "round";
  canvas.lineCap = "butt";
  canvas.strokeStyle = ink.weak;
  canvas.lineWidth = 16;
  canvas.setLineDash([3, 3]);
  line(isWeak);
  if (background) {
    canvas.strokeStyle = ink.paper;
    canvas.lineWidth = 12;
    canvas.setLineDash([]);
    line(() => true);
  }
  canvas.lineWidth = 6;
  for (const kind of ["coloured", "pale", "hole"] as const) {
    canvas.strokeStyle = ink[kind];
    canvas.setLineDash(dashes[kind]);
    line((second) => kindOf(second) === kind);
  }
  canvas.setLineDash([]);

  canvas.font = "bold 14px system-ui";
  canvas.textBaseline = "middle";
  for (const mark of marks) {
    const px = x(mark.east), py = y(mark.north);
    if (background) {
      canvas.strokeStyle = ink.paper;
      canvas.lineWidth = 5;
      canvas.strokeText(String(mark.number), px + 17, py - 20);
    }
    canvas.strokeStyle = canvas.fillStyle = ink.text;
    canvas.lineWidth = 2;
    canvas.beginPath();
    canvas.moveTo(px, py);
    canvas.lineTo(px, py - 26);
    canvas.stroke();
    canvas.beginPath();
    canvas.moveTo(px, py - 26);
    canvas.lineTo(px + 14, py - 20);
    canvas.lineTo(px, py - 14);
    canvas.fill();
    canvas.fillText(String(mark.number), px + 17, py - 20);
  }

  const last = seconds.at(-1);
  if (last) {
    canvas.save();
    canvas.translate(x(last[1]), y(last[2]));
    canvas.rotate(heading ?? 0);
    canvas.beginPath();
    canvas.moveTo(0, -16);
    canvas.lineTo(10, 12);
    canvas.lineTo(0, 6);
    canvas.lineTo(-10, 12);
    canvas.closePath();
    canvas.fillStyle = ink.vehicle;
    canvas.fill();
    canvas.strokeStyle = ink.paper;
    canvas.lineWidth = 2;
    canvas.stroke();
    canvas.restore();
  }

  // At the upper right, which nothing covers: the scale, and north.
  const bar = roundStep(130 / sight.scale), right = width - 16, left = right - bar * sight.scale;
  if (background) {
    canvas.globalAlpha = 0.85;
    canvas.fillStyle = ink.paper;
    canvas.fillRect(Math.min(left, width - 44) - 8, 8, width, 102);
    canvas.globalAlpha = 1;
  }
  canvas.fillStyle = canvas.strokeStyle = ink.text;
  canvas.lineWidth = 3;
  canvas.beginPath();
  canvas.moveTo(left, 92);
  canvas.lineTo(left, 102);
  canvas.lineTo(right, 102);
  canvas.lineTo(right, 92);
  canvas.stroke();
  canvas.fillText(bar >= 1000 ? `${bar / 1000} km` : `${bar} m`, left + 8, 84);
  canvas.textAlign = "center";
  canvas.fillText("N", width - 28, 24);
  canvas.textAlign = "start";
  canvas.beginPath();
  canvas.moveTo(width - 28, 34);
  canvas.lineTo(width - 36, 56);
  canvas.lineTo(width - 28, 50);
  canvas.lineTo(width - 20, 56);
  canvas.fill();
}

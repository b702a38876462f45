import type { Block } from "./point_ring";

/// Returns how many points of a block are drawn. `distance` is that of the camera from the block's box, m. Within `near`
/// all are; beyond, the number falls with the square of the distance, as the area on the screen does. A block that is
/// not full yet is drawn whole, because its first points are no sample of it.
export function pointsDrawn(block: Block, distance: number, near: number): number {
  if (!block.isShuffled || distance <= near) return block.count;
  return Math.max(Math.min(block.count, kFewest), Math.floor(block.count * (near / distance) ** 2));
}
const kFewest = 256;
const kLeastNear = 2, kMostNear = 4000; // m

/// Returns the largest `near` with which not more than `budget` points are drawn, so that what is far is thinned first.
export function nearFor(budget: number, blocks: readonly { block: Block; distance: number }[]): number {
  const sum = (near: number): number => blocks.reduce((n, { block, distance }) => n + pointsDrawn(block, distance, near), 0);
  if (sum(kMostNear) <= budget) return kMostNear;
  let low = kLeastNear, high = kMostNear;
  for (let i = 0; i < 16; ++i) {
    const middle = Math.sqrt(low * high);
    if (sum(middle) <= budget) low = middle;
    else high = middle;
  }
  return low;
}

/// Returns the distance of a place from a block's box, m; 0 inside.
export function distanceTo(block: Block, place: readonly [number, number, number]): number {
  let sum = 0;
  for (let k = 0; k < 3; ++k) {
    const beyond = Math.max(block.least[k]! - place[k]!, place[k]! - block.most[k]!, 0);
    sum += beyond * beyond;
  }
  return Math.sqrt(sum);
}

/// Adapts the number of points of a frame to the time that frames take: fewer when they take longer than wanted, more
/// when there is time left.
export class Budget {
  points = 500_000;
  #mean = 0;
  constructor(readonly wantedMs: number) {}
  frame(ms: number): void {
    const taken = Math.min(ms, 1000); // a page that comes back from the background says nothing of the computer
    this.#mean = this.#mean === 0 ? taken : 0.7 * this.#mean + 0.3 * taken;
    if (this.#mean > 1.3 * this.wantedMs) this.points = Math.max(kFewestPoints, this.points * Math.max(0.7, this.wantedMs / this.#mean));
    else if (this.#mean < 0.8 * this.wantedMs) this.points = Math.min(kMostPoints, this.points * 1.05);
  }
}
const kFewestPoints = 100_000, kMostPoints = 20_000_000;

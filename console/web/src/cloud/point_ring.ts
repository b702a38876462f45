import type { Points } from "../link/point_message";

/// A block of points, as large as one upload and one draw call. Its arrays are what the graphics processor holds.
export interface Block {
  place: Float32Array; // 3 a point
  colour: Uint8Array; // 4 a point
  extra: Uint8Array; // 4 a point
  count: number;
  dirtyFrom: number; // points from here on are not on the graphics processor yet
  isShuffled: boolean; // its points stand in random order, so its first n are a sample of it
  least: [number, number, number];
  most: [number, number, number];
}

export const kBlockPoints = 65536;

const newBlock = (): Block => ({
  place: new Float32Array(3 * kBlockPoints),
  colour: new Uint8Array(4 * kBlockPoints),
  extra: new Uint8Array(4 * kBlockPoints),
  count: 0,
  dirtyFrom: 0,
  isShuffled: false,
  least: [Infinity, Infinity, Infinity],
  most: [-Infinity, -Infinity, -Infinity],
});

/// A bounded store of points: blocks that are filled one after the other; when all are full, the oldest is emptied and
/// filled again. Memory is allocated a block at a time, up to the capacity, and never more.
export class PointRing {
  readonly blocks: Block[] = [];
  dropped = 0; // points that had to go
  #current = -1;
  #mostBlocks: number;
  #random = 1;

  constructor(capacity: number) {
    this.#mostBlocks = Math.max(2, Math.floor(capacity / kBlockPoints));
  }

  get capacity(): number {
    return this.#mostBlocks * kBlockPoints;
  }
  get count(): number {
    return this.blocks.reduce((sum, block) => sum + block.count, 0);
  }

  append(points: Points): void {
    for (let from = 0; from < points.count; ) {
      const block = this.#room();
      const n = Math.min(points.count - from, kBlockPoints - block.count);
      block.place.set(points.place.subarray(3 * from, 3 * (from + n)), 3 * block.count);
      block.colour.set(points.colour.subarray(4 * from, 4 * (from + n)), 4 * block.count);
      block.extra.set(points.extra.subarray(4 * from, 4 * (from + n)), 4 * block.count);
      for (let i = 3 * from; i < 3 * (from + n); ++i) {
        const value = points.place[i]!, axis = i % 3;
        if (value < block.least[axis]!) block.least[axis] = value;
        if (value > block.most[axis]!) block.most[axis] = value;
      }
      block.count += n;
      from += n;
      if (block.count === kBlockPoints) this.#shuffle(block);
    }
  }

  clear(): void {
    for (const block of this.blocks) this.#empty(block);
    this.#current = this.blocks.length > 0 ? 0 : -1;
    this.dropped = 0;
  }

  /// Changes how many points are kept. Too many are dropped at once, the oldest first.
  resize(capacity: number): void {
    const most = Math.max(2, Math.floor(capacity / kBlockPoints));
    if (most < this.blocks.length) {
      // In order of age, the block that is being filled last.
      const ordered = [...this.blocks.slice(this.#current + 1), ...this.blocks.slice(0, this.#current + 1)];
      for (const block of ordered.slice(0, ordered.length - most)) this.dropped += block.count;
      this.blocks.splice(0, this.blocks.length, ...ordered.slice(ordered.length - most));
      this.#current = this.blocks.length - 1;
    }
    this.#mostBlocks = most;
  }

  #empty(block: Block): void {
    block.count = 0;
    block.dirtyFrom = 0;
    block.isShuffled = false;
    block.least = [Infinity, Infinity, Infinity];
    block.most = [-Infinity, -Infinity, -Infinity];
  }

  #room(): Block {
    const current = this.blocks[this.#current];
    if (current && current.count < kBlockPoints) return current;
    if (this.blocks.length < this.#mostBlocks && this.#current === this.blocks.length - 1) {
      this.#current = this.blocks.push(newBlock()) - 1;
    } else {
      this.#current = (this.#current + 1) % this.blocks.length;
      const oldest = this.blocks[this.#current]!;
      this.dropped += oldest.count;
      this.#empty(oldest);
    }
    return this.blocks[this.#current]!;
  }

  /// Puts the points of a full block in random order, once, so that far blocks can be drawn by a part of their points.
  #shuffle(block: Block): void {
    const colour = new Uint32Array(block.colour.buffer), extra = new Uint32Array(block.extra.buffer);
    const place = block.place;
    for (let i = block.count - 1; i > 0; --i) {
      this.#random = (Math.imul(this.#random, 1664525) + 1013904223) >>> 0;
      const j = Math.floor((this.#random / 4294967296) * (i + 1));
      [colour[i], colour[j]] = [colour[j]!, colour[i]!];
      [extra[i], extra[j]] = [extra[j]!, extra[i]!];
      for (let k = 0; k < 3; ++k) {
        const kept = place[3 * i + k]!;
        place[3 * i + k] = place[3 * j + k]!;
        place[3 * j + k] = kept;
      }
    }
    block.isShuffled = true;
    block.dirtyFrom = 0;
  }
}

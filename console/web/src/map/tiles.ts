import { fromWebMercator, toWebMercator, type LocalPlane } from "./earth";
import type { Sight } from "./drive_map";

/// What the console says of its folder of map tiles.
export interface TileSet {
  least_zoom: number;
  most_zoom: number;
  attribution: string; // may have HTML's tags
}

export interface Tile {
  zoom: number;
  x: number;
  y: number; // from the north
}

const kTilePx = 256;
const kMostDrawn = 160;
const kMostKept = 400; // images
const kRetryMs = 30_000;
const kAncestors = 6; // levels above a tile that may stand in for it

/// The tiles that cover a sight of `width` x `height` px, of the zoom whose pixels are as large as the screen's; none if they were too many, as below
/// the least zoom.
export function tilesOf(plane: LocalPlane, sight: Sight, width: number, height: number, ratio: number, set: TileSet): Tile[] {
  const w = width / 2 / sight.scale, h = height / 2 / sight.scale;
  const corners = [[-w, -h], [w, -h], [w, h], [-w, h]].map(([east, north]) => toWebMercator(plane.place(sight.east + east!, sight.north + north!)));
  const xs = corners.map((one) => one.x), ys = corners.map((one) => one.y);
  const [left, right, top, bottom] = [Math.min(...xs), Math.max(...xs), Math.max(0, Math.min(...ys)), Math.min(1, Math.max(...ys))];
  const wanted = Math.log2((width * ratio) / kTilePx / Math.max(1e-12, right - left));
  const zoom = Math.min(set.most_zoom, Math.max(set.least_zoom, Math.round(wanted)));
  const n = 2 ** zoom;
  const [x0, x1, y0, y1] = [Math.floor(left * n), Math.floor(right * n), Math.floor(top * n), Math.min(n - 1, Math.floor(bottom * n))];
  const tiles: Tile[] = [];
  if ((x1 - x0 + 1) * (y1 - y0 + 1) > kMostDrawn) return tiles;
  for (let y = y0; y <= y1; ++y)
    for (let x = x0; x <= x1; ++x) tiles.push({ zoom, x: ((x % n) + n) % n, y });
  return tiles;
}

/// The tiles below the map, as one picture, which is made again only when the sight has moved or another tile has come. Tiles are loaded as they are
/// wanted, and the newest are kept.
export class TileLayer {
  /// Called when a tile has come.
  onLoad = (): void => {};
  #images = new Map<string, HTMLImageElement>(); // the least recently wanted first
  #loads = 0;
  #picture = document.createElement("canvas");
  #drawn: unknown[] = []; // what #picture shows

  draw(canvas: CanvasRenderingContext2D, size: { width: number; height: number; ratio: number }, sight: Sight, plane: LocalPlane, set: TileSet): void {
    const wanted = [size.width, size.height, size.ratio, sight.east, sight.north, sight.scale, plane, set, this.#loads];
    if (wanted.some((value, i) => value !== this.#drawn[i])) {
      this.#drawn = wanted;
      [this.#picture.width, this.#picture.height] = [Math.round(size.width * size.ratio), Math.round(size.height * size.ratio)]; // and empty
      const context = this.#picture.getContext("2d");
      if (context) this.#make(context, size, sight, plane, set);
    }
    canvas.drawImage(this.#picture, 0, 0, size.width, size.height);
  }

  /// What is not there yet, or at all, is drawn from a coarser tile that is.
  #make(canvas: CanvasRenderingContext2D, { width, height, ratio }: { width: number; height: number; ratio: number }, sight: Sight, plane: LocalPlane, set: TileSet): void {
    // Over one tile the map's projection is straight to a thousandth of a pixel, so three of its corners say where it lies.
    const corner = (zoom: number, x: number, y: number): [number, number] => {
      const { east, north } = plane.local(fromWebMercator(x / 2 ** zoom, y / 2 ** zoom));
      return [width / 2 + (east - sight.east) * sight.scale, height / 2 - (north - sight.north) * sight.scale];
    };
    for (const { zoom, x, y } of tilesOf(plane, sight, width, height, ratio, set)) {
      let image = this.#find(zoom, x, y, true), up = 0;
      while (!image && up < kAncestors && zoom - up > set.least_zoom) {
        ++up;
        image = this.#find(zoom - up, x >> up, y >> up, up === 1);
      }
      if (!image) continue;
      const [ox, oy] = corner(zoom, x, y), [rx, ry] = corner(zoom, x + 1, y), [dx, dy] = corner(zoom, x, y + 1);
      const part = image.naturalWidth / 2 ** up, rows = image.naturalHeight / 2 ** up;
      canvas.setTransform(ratio * (rx - ox), ratio * (ry - oy), ratio * (dx - ox), ratio * (dy - oy), ratio * ox, ratio * oy);
      // A hair more than a tile, so that no paper shows between two.
      canvas.drawImage(image, (x - ((x >> up) << up)) * part, (y - ((y >> up) << up)) * rows, part, rows, 0, 0, 1.002, 1.002);
    }
  }

  /// Returns the image, or nothing while it is not there.
  #find(zoom: number, x: number, y: number, load: boolean): HTMLImageElement | undefined {
    const key = `${zoom}/${x}/${y}`;
    let image = this.#images.get(key);
    if (!image && !load) return undefined;
    if (image) {
      this.#images.delete(key);
    } else {
      image = new Image();
      image.onload = () => {
        ++this.#loads;
        this.onLoad();
      };
      // It may be lacking for ever, or for as long as the link is cut.
      image.onerror = () => void setTimeout(() => this.#images.get(key) === image && this.#images.delete(key), kRetryMs);
      image.src = `/api/tiles/${key}`;
    }
    this.#images.set(key, image);
    if (this.#images.size > kMostKept) this.#images.delete(this.#images.keys().next().value!);
    return image.complete && image.naturalWidth > 0 ? image : undefined;
  }
}

import { signal, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { drawMap, lengths, whole, type Ink, type Sight } from "../map/drive_map";
import { LocalPlane } from "../map/earth";
import { TileLayer, type TileSet } from "../map/tiles";
import { get } from "../link/rest";
import type { Mark } from "../link/messages";
import { isDriving, mapOrigin, seconds, secondsVersion, status } from "../state/live";
import { background, theme } from "../state/settings";
import { formatLength, t } from "../words/words";

const inks: Record<"day" | "night", Ink> = {
  day: { paper: "#ffffff", grid: "#e2e6ea", text: "#16191d", coloured: "#0a6b2e", pale: "#a35200", hole: "#c00021", weak: "#9b7fd4", vehicle: "#0b57d0", background: 0.7 },
  night: { paper: "#0b0e12", grid: "#232a32", text: "#e6e6e6", coloured: "#4cd07d", pale: "#ffb347", hole: "#ff6b6b", weak: "#6d55a8", vehicle: "#7fb2ff", background: 0.4 },
};

const kLegendPx = 100, kTallLegendPx = 160; // at the lower edge; buttons take less at the upper one

/// What the drive is drawn on, if the console has it.
const tileSet = signal<TileSet | null>(null);
const tiles = new TileLayer();

async function findTiles(): Promise<void> {
  try {
    tileSet.value = (await get<{ tiles: TileSet | null }>("tiles")).tiles;
  } catch {
    tileSet.value = null; // a map on a grid is as true
  }
}

/// Whom the map is from, as its maker wrote it, without HTML's tags.
const attribution = (set: TileSet): string => new DOMParser().parseFromString(set.attribution, "text/html").body.textContent ?? "";

const placed = (marks: readonly Mark[], plane: LocalPlane | null): (Mark & { east: number; north: number })[] =>
  marks.flatMap((mark) =>
    !plane || mark.latitude_deg === undefined || mark.longitude_deg === undefined
      ? []
      : [{ ...mark, ...plane.local({ latitude_deg: mark.latitude_deg, longitude_deg: mark.longitude_deg }) }]);

/// The map of the drive, drawn by the page itself, so it needs no network.
export function MapView() {
  const host = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const how = useSignal<"whole" | "vehicle" | "free">("whole");
  const sight = useRef<Sight>({ east: 0, north: 0, scale: 2 });
  const size = useSignal({ width: 0, height: 0 });
  const redraw = useSignal(0);
  const marks = status.value?.marks ?? [];
  const heading = status.value?.pos?.heading_deg ?? null;
  const degrees = heading === null ? null : Math.round(heading);
  const origin = mapOrigin.value;
  const plane = useMemo(() => origin && new LocalPlane(origin), [origin?.latitude_deg, origin?.longitude_deg, origin?.height_m]);
  const set = background.value === "on" ? tileSet.value : null;

  useEffect(() => {
    tiles.onLoad = () => redraw.value++;
    void findTiles();
    return () => (tiles.onLoad = () => {});
  }, []);
  useEffect(() => {
    const observer = new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = host.current!;
      size.value = { width, height };
    });
    observer.observe(host.current!);
    return () => observer.disconnect();
  }, []);

  const { width, height } = size.value;
  const draw = (): void => {
    const element = canvas.current!;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    const w = Math.round(width * ratio), h = Math.round(height * ratio);
    if (element.width !== w || element.height !== h) [element.width, element.height] = [w, h];
    const last = seconds.at(-1);
    if (how.value === "whole") sight.current = whole(seconds, width, height, width < 700 ? kTallLegendPx : kLegendPx);
    else if (how.value === "vehicle" && last) sight.current = { ...sight.current, east: last[1], north: last[2] };
    const context = element.getContext("2d");
    if (!context) return;
    const screen = { width, height, ratio };
    const below = set && plane ? () => tiles.draw(context, screen, sight.current, plane, set) : undefined;
    drawMap(context, screen, sight.current, seconds, placed(marks, plane), degrees === null ? null : (degrees * Math.PI) / 180, inks[theme.value], below);
  };
  // What changes comes in bursts: seconds of a fast replay, tiles, fingers. It is drawn once a frame.
  const deps = [width, height, secondsVersion.value, marks.length, how.value, redraw.value, theme.value, degrees, set, plane];
  useEffect(() => {
    const handle = requestAnimationFrame(draw);
    return () => cancelAnimationFrame(handle);
  }, deps);

  const zoom = (factor: number): void => {
    const scale = Math.min(200, Math.max(0.005, sight.current.scale * factor));
    sight.current = { ...sight.current, scale };
    if (how.value === "whole") how.value = "free";
    redraw.value++;
  };
  const fingers = useRef(new Map<number, { x: number; y: number }>());
  const onMove = (event: PointerEvent): void => {
    const before = fingers.current.get(event.pointerId);
    if (!before) return;
    const others = [...fingers.current].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
    const now = { x: event.clientX, y: event.clientY };
    fingers.current.set(event.pointerId, now);
    const other = others[0];
    if (other) {
      zoom(Math.hypot(now.x - other.x, now.y - other.y) / Math.max(1, Math.hypot(before.x - other.x, before.y - other.y)));
    } else {
      const { east, north, scale } = sight.current;
      sight.current = { scale, east: east - (now.x - before.x) / scale, north: north + (now.y - before.y) / scale };
      how.value = "free";
      redraw.value++;
    }
  };
  const sum = lengths(seconds);
  return (
    <div class="map-view">
      <div
        ref={host}
        class="canvas"
        onWheel={(event) => { event.preventDefault(); zoom(event.deltaY < 0 ? 1.2 : 1 / 1.2); }}
        onPointerDown={(event) => { event.currentTarget.setPointerCapture(event.pointerId); fingers.current.set(event.pointerId, { x: event.clientX, y: event.clientY }); }}
        onPointerMove={onMove}
        onPointerUp={(event) => fingers.current.delete(event.pointerId)}
        onPointerCancel={(event) => fingers.current.delete(event.pointerId)}
      >
        <canvas ref={canvas} role="img" aria-label={t("map.label")} />
        {seconds.length === 0 && <p class="empty">{t(isDriving.value ? "map.none" : "drive.none")}</p>}
      </div>
      <div class="controls">
        <button type="button" aria-pressed={how.value === "whole"} onClick={() => (how.value = "whole")}>{t("map.fit")}</button>
        <button type="button" aria-pressed={how.value === "vehicle"} onClick={() => { if (sight.current.scale < 2) sight.current.scale = 4; how.value = "vehicle"; redraw.value++; }}>{t("map.follow")}</button>
        <button type="button" aria-label={t("map.in")} onClick={() => zoom(1.5)}>+</button>
        <button type="button" aria-label={t("map.out")} onClick={() => zoom(1 / 1.5)}>−</button>
        {tileSet.value && (
          <button type="button" aria-pressed={set !== null} onClick={() => (background.value = set ? "off" : "on")}>{t("map.background")}</button>
        )}
      </div>
      <div class="legend">
        {set?.attribution && <p class="attribution">{attribution(set)}</p>}
        <ul>
          {(["coloured", "pale", "hole", "weak"] as const).map((kind) => <li key={kind} class={kind}><i aria-hidden="true" /> {t(`map.${kind}`)}</li>)}
          <li>⚑ {t("map.mark")}</li>
        </ul>
        <p>{t("map.summary", { path: formatLength(sum.all), hole: formatLength(sum.hole), weak: formatLength(sum.weak), marks: marks.length })}</p>
      </div>
    </div>
  );
}

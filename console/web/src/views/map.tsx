import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { drawMap, lengths, whole, type Ink, type Sight } from "../map/drive_map";
import type { MapPart, Mark } from "../link/messages";
import { mapOrigin, seconds, secondsVersion, status } from "../state/live";
import { theme } from "../state/settings";
import { formatLength, t } from "../words/words";

const inks: Record<"day" | "night", Ink> = {
  day: { paper: "#ffffff", grid: "#e2e6ea", text: "#16191d", coloured: "#0a6b2e", pale: "#a35200", hole: "#c00021", weak: "#9b7fd4", vehicle: "#0b57d0" },
  night: { paper: "#0b0e12", grid: "#232a32", text: "#e6e6e6", coloured: "#4cd07d", pale: "#ffb347", hole: "#ff6b6b", weak: "#6d55a8", vehicle: "#7fb2ff" },
};

const kLegendPx = 100, kTallLegendPx = 160; // at the lower edge; buttons take less at the upper one

/// Places of the marks on the map. Over a drive's extent the earth's curvature is far below a pixel.
function placed(marks: readonly Mark[], origin: MapPart["origin"]): (Mark & { east: number; north: number })[] {
  if (!origin) return [];
  const metres = 111320;
  return marks.flatMap((mark) =>
    mark.latitude_deg === undefined || mark.longitude_deg === undefined ? [] : [{
      ...mark,
      east: (mark.longitude_deg - origin.longitude_deg) * metres * Math.cos((origin.latitude_deg * Math.PI) / 180),
      north: (mark.latitude_deg - origin.latitude_deg) * metres,
    }]);
}

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

  useEffect(() => {
    const observer = new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = host.current!;
      size.value = { width, height };
    });
    observer.observe(host.current!);
    return () => observer.disconnect();
  }, []);

  const { width, height } = size.value;
  const deps = [width, height, secondsVersion.value, marks.length, how.value, redraw.value, theme.value, degrees];
  useEffect(() => {
    const element = canvas.current!;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    const w = Math.round(width * ratio), h = Math.round(height * ratio);
    if (element.width !== w || element.height !== h) [element.width, element.height] = [w, h];
    const last = seconds.at(-1);
    if (how.value === "whole") sight.current = whole(seconds, width, height, width < 700 ? kTallLegendPx : kLegendPx);
    else if (how.value === "vehicle" && last) sight.current = { ...sight.current, east: last[1], north: last[2] };
    const context = element.getContext("2d");
    if (context)
      drawMap(context, { width, height, ratio }, sight.current, seconds, placed(marks, mapOrigin.value), degrees === null ? null : (degrees * Math.PI) / 180, inks[theme.value]);
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
        {seconds.length === 0 && <p class="empty">{t("map.none")}</p>}
      </div>
      <div class="controls">
        <button type="button" aria-pressed={how.value === "whole"} onClick={() => (how.value = "whole")}>{t("map.fit")}</button>
        <button type="button" aria-pressed={how.value === "vehicle"} onClick={() => { if (sight.current.scale < 2) sight.current.scale = 4; how.value = "vehicle"; redraw.value++; }}>{t("map.follow")}</button>
        <button type="button" aria-label={t("map.in")} onClick={() => zoom(1.5)}>+</button>
        <button type="button" aria-label={t("map.out")} onClick={() => zoom(1 / 1.5)}>−</button>
      </div>
      <div class="legend">
        <ul>
          {(["coloured", "pale", "hole", "weak"] as const).map((kind) => <li key={kind} class={kind}><i aria-hidden="true" /> {t(`map.${kind}`)}</li>)}
          <li>⚑ {t("map.mark")}</li>
        </ul>
        <p>{t("map.summary", { path: formatLength(sum.all), hole: formatLength(sum.hole), weak: formatLength(sum.weak), marks: marks.length })}</p>
      </div>
    </div>
  );
}

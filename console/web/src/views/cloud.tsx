import { effect, signal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import type { CloudScene } from "../cloud/scene";
import type { Mode } from "../cloud/shader";
import { readPoints, type ExtraField, type PointCloudMessage } from "../link/point_message";
import { feed, isDriving, problems, run } from "../state/live";
import { theme } from "../state/settings";
import { formatCount, t } from "../words/words";

interface Pose {
  pose?: { position?: { x: number; y: number; z: number }; orientation?: { x: number; y: number; z: number; w: number } };
}

const modes: readonly Mode[] = ["colour", "intensity", "height", "quality", "sigma", "exposure", "moving"];
const needs: Partial<Record<Mode, ExtraField>> = { intensity: "intensity", sigma: "sigma", exposure: "exposure", moving: "moving" };
const withScale = new Set<Mode>(["intensity", "height", "quality", "sigma"]);
const capacities = [1, 3, 5, 10]; // million points
// What a device says of its memory is at most 8 GB, in GB; telephones say 4 or less.
const memory = (navigator as { deviceMemory?: number }).deviceMemory ?? 8;

const scene = signal<CloudScene | null>(null);
const hasNoWebGl = signal(false);
const fields = signal<ReadonlySet<ExtraField>>(new Set());
const shownPoints = signal(0);
const mode = signal<Mode>("colour");
const follows = signal(true);
const size = signal(1);
const capacity = signal(memory > 4 ? 10 : 3);
let isBegun = false;

/// Makes the scene and subscribes the cloud, once: from then on the cloud grows on every view.
async function beginCloud(): Promise<void> {
  if (isBegun) return;
  isBegun = true;
  const { CloudScene } = await import("../cloud/scene"); // three comes with it, so other views load faster
  let made: CloudScene;
  try {
    made = new CloudScene(capacity.value * 1e6);
  } catch {
    hasNoWebGl.value = true;
    return;
  }
  let shown = "";
  feed.want<PointCloudMessage>("/cloud", (message) => {
    const points = readPoints(message);
    if (points.has.size !== fields.value.size) fields.value = points.has;
    made.append(points);
    shownPoints.value = made.ring.count;
  });
  feed.want<Pose>("/pose", ({ pose }) => {
    if (pose?.position && pose.orientation) made.pose(pose.position, pose.orientation);
  });
  effect(() => {
    const now = run.value; // a part of a drive has an origin of its own, so its points fit to no others
    if (now === shown) return;
    if (shown !== "") {
      made.clear();
      shownPoints.value = 0;
    }
    shown = now;
  });
  effect(() => void (made.mode = mode.value));
  effect(() => void (made.follows = follows.value));
  effect(() => void (made.pointSize = size.value));
  effect(() => made.ring.resize(capacity.value * 1e6));
  effect(() => void (made.background = theme.value === "day" ? "#dde2e7" : "#0b0e12"));
  scene.value = made;
}

function Controls() {
  const isThere = (one: Mode): boolean => needs[one] === undefined || fields.value.has(needs[one]);
  return (
    <div class="controls">
      <label>
        {t("cloud.by")}
        <select value={mode.value} onChange={(event) => (mode.value = event.currentTarget.value as Mode)}>
          {modes.map((one) => <option key={one} value={one} disabled={!isThere(one)}>{t(`cloud.by.${one}`)}</option>)}
        </select>
      </label>
      <button type="button" aria-pressed={follows.value} onClick={() => (follows.value = !follows.value)}>
        {t("cloud.camera")}: {t(follows.value ? "cloud.follow" : "cloud.free")}
      </button>
      <label>
        {t("cloud.size")}
        <input type="range" min={0.5} max={4} step={0.5} value={size.value} onInput={(event) => (size.value = event.currentTarget.valueAsNumber)} />
      </label>
      <label class="most">
        {t("cloud.most")}
        <select value={capacity.value} onChange={(event) => (capacity.value = Number(event.currentTarget.value))}>
          {capacities.map((one) => <option key={one} value={one}>{t("cloud.millions", { count: one })}</option>)}
        </select>
      </label>
    </div>
  );
}

/// The coloured cloud while it grows.
export function CloudView() {
  const host = useRef<HTMLDivElement>(null);
  const [wrong, setWrong] = useState("");
  useEffect(() => {
    beginCloud().catch((error: unknown) => {
      isBegun = false;
      setWrong(String(error));
    });
  }, []);
  const made = scene.value;
  useEffect(() => {
    if (!made) return;
    made.attach(host.current!);
    return () => made.detach();
  }, [made]);
  const count = shownPoints.value;
  const isFull = (made?.ring.dropped ?? 0) > 0;
  if (hasNoWebGl.value) return <p class="wrong" role="alert">{t("cloud.no_webgl")}</p>;
  return (
    <div class="cloud-view">
      <div ref={host} class="canvas" role="img" aria-label={t("cloud.label")} />
      <Controls />
      <p class="legend" role="status">
        {wrong || (count === 0 ? t(isDriving.value ? "cloud.waiting" : "drive.none") : t(isFull ? "cloud.count_oldest" : "cloud.count", { count: formatCount(count) }))}
        {withScale.has(mode.value) && (
          <span class="scale">
            {t(mode.value === "quality" ? "cloud.high" : "cloud.low")} <i aria-hidden="true" /> {t(mode.value === "quality" ? "cloud.low" : "cloud.high")}
          </span>
        )}
        <small>{t("cloud.keys")}</small>
        {problems.value.at(-1)?.startsWith("/cloud") && <span class="wrong" lang="en">{problems.value.at(-1)}</span>}
      </p>
    </div>
  );
}

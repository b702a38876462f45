import { signal } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { compose, Frames, inverse, rigid } from "../images/frames";
import { drawSeen, overlay, type LensModel, type Seen } from "../images/project";
import { readPoints, type PointCloudMessage } from "../link/point_message";
import { feed, isDriving, now } from "../state/live";
import { formatAge, t } from "../words/words";

interface Timestamp {
  seconds: bigint;
  nanos: number;
}
interface CompressedImage {
  timestamp?: Timestamp;
  frameId: string;
  format: string;
  data: Uint8Array<ArrayBuffer>;
}
interface Calibration {
  timestamp?: Timestamp;
  frameId: string;
  width: number;
  height: number;
  distortionModel: string;
  D: number[];
  K: number[];
}
type Vector = { x: number; y: number; z: number };
type Quaternion = Vector & { w: number };
interface PoseInFrame {
  timestamp?: Timestamp;
  pose?: { position?: Vector; orientation?: Quaternion };
}
interface Transforms {
  transforms: { parentFrameId: string; childFrameId: string; translation?: Vector; rotation?: Quaternion }[];
}
interface Shown {
  url: string;
  at: number; // performance.now()
  points: { width: number; height: number; seen: Seen } | null; // laser points over it, if their places are known
}

const images = signal<ReadonlyMap<string, Shown>>(new Map());
const withPoints = signal(true);
const frames = new Frames();
const lenses = new Map<string, { model: LensModel; ns: bigint }>(); // by frame
const kCalibrationsAfterMs = 150; // the calibrations of an image come after it
const kRecent = 60_000; // points; those of the last seconds
const kMostSeen = 20_000; // of them in one image
const kOverlayShare = 0.3; // of the time, at most: a slow computer draws fewer images' points, and the page still answers
let overlayFrom = 0; // performance.now()
const recent = new Float32Array(3 * kRecent);
let recentCount = 0, recentAt = 0;

const nsOf = (time: Timestamp | undefined): bigint => (time ? time.seconds * 1_000_000_000n + BigInt(time.nanos) : 0n);

function keep(message: PointCloudMessage): void {
  const { place, count } = readPoints(message);
  for (let i = 0; i < count; ++i) {
    recent.set(place.subarray(3 * i, 3 * i + 3), 3 * recentAt);
    recentAt = (recentAt + 1) % kRecent;
    recentCount = Math.min(recentCount + 1, kRecent);
  }
}

function takeCalibration(one: Calibration): void {
  const [fx, , cx, , fy, cy] = one.K;
  if (!fx || !fy || cx === undefined || cy === undefined) return;
  const model = { frame: one.frameId, width: one.width, height: one.height, isFisheye: one.distortionModel === "kannala_brandt", D: one.D, fx, fy, cx, cy };
  lenses.set(one.frameId, { model, ns: nsOf(one.timestamp) });
}

/// The laser points over an image: by the pose at its time, and the lenses that were described for the same time.
function pointsOver(image: CompressedImage): Shown["points"] {
  const ns = nsOf(image.timestamp);
  const T_enu_body = frames.bodyAt(ns);
  if (!T_enu_body) return null;
  const mine = [...lenses.values()].filter((one) => one.ns === ns && (image.frameId === one.model.frame || !image.frameId.startsWith("lens/")));
  const placed = mine.flatMap(({ model }) => {
    const T_body_lens = frames.onBody(model.frame);
    return T_body_lens ? [{ model, T_lens_enu: inverse(compose(T_enu_body, T_body_lens)) }] : [];
  });
  if (placed.length === 0) return null;
  const { width, height } = placed[0]!.model;
  return { width, height, seen: overlay(recent.subarray(0, 3 * recentCount), placed, kMostSeen) };
}

function show(message: CompressedImage, topic: string): void {
  const name = topic.slice("/image/".length);
  const old = images.value.get(name);
  const url = URL.createObjectURL(new Blob([message.data], { type: `image/${message.format === "jpg" ? "jpeg" : message.format}` }));
  const shown: Shown = { url, at: performance.now(), points: null };
  images.value = new Map(images.value).set(name, shown);
  if (old) setTimeout(() => URL.revokeObjectURL(old.url), 1000); // the browser may still draw it
  setTimeout(() => {
    const began = performance.now();
    if (!withPoints.value || began < overlayFrom) return;
    const points = pointsOver(message);
    overlayFrom = performance.now() + (performance.now() - began) / kOverlayShare;
    if (points && images.value.get(name) === shown) images.value = new Map(images.value).set(name, { ...shown, points });
  }, kCalibrationsAfterMs);
}

/// Subscribes what the view needs, until the returned function is called.
function watch(): () => void {
  const ends = [
    feed.want<CompressedImage>((topic) => topic.startsWith("/image/"), show),
    feed.want<Calibration>((topic) => topic.startsWith("/camera/"), takeCalibration),
    feed.want<PoseInFrame>("/pose", ({ timestamp, pose }) => {
      if (pose?.position && pose.orientation) frames.pose(nsOf(timestamp), pose.orientation, pose.position);
    }),
    feed.want<Transforms>("/tf_static", ({ transforms }) => {
      for (const one of transforms)
        if (one.rotation && one.translation) frames.mount(one.parentFrameId, one.childFrameId, rigid(one.rotation, one.translation));
    }),
    feed.want<PointCloudMessage>("/cloud", keep, () => (recentCount = recentAt = 0)),
  ];
  return () => ends.forEach((end) => end());
}

function Overlay({ points }: { points: NonNullable<Shown["points"]> }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const context = canvas.current?.getContext("2d");
    if (!context) return;
    const picture = context.createImageData(points.width, points.height);
    drawSeen(points.seen, new Uint32Array(picture.data.buffer), points.width, points.height);
    context.putImageData(picture, 0, 0);
  }, [points]);
  return <canvas ref={canvas} width={points.width} height={points.height} aria-hidden="true" />;
}

/// The newest image of each camera, with the laser's points over it. They are subscribed only while this view is open,
/// because images are large.
export function ImagesView() {
  const [large, setLarge] = useState<string | null>(null);
  useEffect(watch, []);
  const list = [...images.value].sort(([a], [b]) => a.localeCompare(b));
  if (list.length === 0) return <p class="empty">{t(isDriving.value ? "images.none" : "drive.none")}</p>;
  return (
    <>
      <p>
        <button type="button" aria-pressed={withPoints.value} onClick={() => (withPoints.value = !withPoints.value)}>{t("images.points")}</button>
      </p>
      <div class={`images${large === null ? "" : " large"}`}>
        {list.filter(([name]) => large === null || name === large).map(([name, one]) => (
          <figure key={name}>
            <button type="button" aria-label={`${name}: ${t("images.large")}`} aria-pressed={large === name} onClick={() => setLarge(large === name ? null : name)}>
              <img src={one.url} alt={t("images.alt", { name })} />
              {withPoints.value && one.points && <Overlay points={one.points} />}
            </button>
            <figcaption>
              <b>{name}</b> <span class={now.value - one.at > 3000 ? "late" : ""}>{formatAge((now.value - one.at) / 1000)}</span>
              {withPoints.value && one.points && <small> {t("images.shown", { count: one.points.seen.length / 3 })}</small>}
            </figcaption>
          </figure>
        ))}
      </div>
    </>
  );
}

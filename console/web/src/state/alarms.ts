import { computed, effect, signal } from "@preact/signals";
import type { Level, Trouble } from "../link/messages";
import { post } from "../link/rest";
import { consoleState, isDriving, isReplaying, linked, mayOperate, oldBy, status } from "./live";
import { sound } from "./settings";

/// Something that is wrong now. It stays in the list while it lasts; who has seen it acknowledges it, which ends the sound
/// and hides nothing. hueline-console has the same ids (console/server/alarms.hpp): what an operator acknowledges is
/// acknowledged on every page and on the vehicle's computer; what a viewer does is silent on that page alone.
export interface Alarm {
  id: string;
  sensor: string; // "drive", or "console" for the link to the server
  level: Level;
  trouble: string;
  cause: string;
  action: string;
  since_s: number | null;
}

const kRank: Record<Level, number> = { ok: 0, waiting: 1, warning: 2, alarm: 3 };

function alarmOf(sensor: string, one: Trouble): Alarm {
  return { ...one, sensor, id: `${sensor} ${one.trouble} ${one.level}` };
}

/// Warnings and alarms, the gravest first.
export const alarms = computed<Alarm[]>(() => {
  const list: Alarm[] = [];
  if (oldBy.value > 0)
    list.push({
      id: "console link",
      sensor: "console",
      level: "alarm",
      trouble: linked.value ? "feed_lost" : "link_lost",
      cause: "",
      action: "",
      since_s: null,
    });
  if (consoleState.value?.ended)
    list.push({ id: "console ended", sensor: "drive", level: "alarm", trouble: "capture_ended", cause: "", action: "", since_s: null });
  const now = status.value;
  if (now) {
    for (const one of now.troubles ?? []) list.push(alarmOf("drive", one));
    for (const sensor of now.sensors) {
      const { trouble, level, cause, action, since_s } = sensor;
      const all = sensor.troubles ?? (trouble ? [{ trouble, level, cause, action, since_s }] : []);
      for (const one of all) list.push(alarmOf(sensor.name, one));
    }
  }
  return list
    .filter((one) => kRank[one.level] >= kRank.warning)
    .sort((a, b) => kRank[b.level] - kRank[a.level] || (a.since_s ?? 0) - (b.since_s ?? 0));
});

const acknowledged = signal<ReadonlySet<string>>(new Set());
const acknowledgedByAll = computed(() => new Set(isReplaying.value ? [] : consoleState.value?.acknowledged));
export const isAcknowledged = (alarm: Alarm): boolean => acknowledged.value.has(alarm.id) || acknowledgedByAll.value.has(alarm.id);
export function acknowledge(list: Alarm[]): void {
  acknowledged.value = new Set([...acknowledged.value, ...list.map((one) => one.id)]);
  if (!mayOperate.value || isReplaying.value) return;
  // Without an answer this page is silent at least; the vehicle's computer goes on, which is the safe side.
  for (const one of list) void post("acknowledge", { alarm: one.id }).catch(() => {});
}
export const unacknowledged = computed(() => alarms.value.filter((one) => !isAcknowledged(one)));

// What is over and comes again is new.
effect(() => {
  const current = new Set(alarms.value.map((one) => one.id));
  const still = [...acknowledged.peek()].filter((id) => current.has(id));
  if (still.length !== acknowledged.peek().size) acknowledged.value = new Set(still);
});

/// The worst of all, with the link: what the lamp at the top shows. Nothing while nothing runs.
export const overall = computed<Level | null>(() => {
  const list = alarms.value;
  if (list.some((one) => one.level === "alarm")) return "alarm";
  if (!isDriving.value || !status.value) return null;
  return list.length > 0 && status.value.level !== "alarm" ? "warning" : status.value.level;
});

let audio: AudioContext | undefined;
export const canSound = signal(false);
/// Somebody has touched the page, and still it cannot sound: the device has no speaker, or the browser may not use it.
export const isMute = signal(false);
const kSoundWithinMs = 3000;

/// Browsers allow sound only after somebody has touched the page. Call it in the handler of a touch or key.
export function allowSound(): void {
  if (canSound.value) return;
  if (!audio) {
    audio = new AudioContext();
    setTimeout(() => (isMute.value = !canSound.value), kSoundWithinMs);
  }
  void audio.resume().then(() => {
    canSound.value = audio?.state === "running";
    if (canSound.value) isMute.value = false;
  }, () => {});
}

function tone(start: number, frequency: number, length: number): void {
  if (!audio) return;
  const oscillator = audio.createOscillator();
  const gain = audio.createGain();
  oscillator.type = "square"; // its overtones are heard above the noise of a car
  oscillator.frequency.value = frequency;
  gain.gain.setValueAtTime(0.0001, start);
  gain.gain.exponentialRampToValueAtTime(0.25, start + 0.01);
  gain.gain.setValueAtTime(0.25, start + length - 0.02);
  gain.gain.exponentialRampToValueAtTime(0.0001, start + length);
  oscillator.connect(gain).connect(audio.destination);
  oscillator.start(start);
  oscillator.stop(start + length);
}

/// Alarm: high, low, high. Warning: one low tone.
export function play(level: Level): void {
  if (!audio || sound.value === "off") return;
  const t = audio.currentTime + 0.02;
  if (level === "alarm") for (const [i, f] of [880, 587, 880].entries()) tone(t + 0.18 * i, f, 0.16);
  else tone(t, 440, 0.25);
}

const kRepeatAlarmMs = 3000;

/// Sounds each new warning once, and each alarm until it is acknowledged or over. Call it once.
export function beginSound(): void {
  let heard = new Set<string>();
  effect(() => {
    const list = unacknowledged.value;
    const fresh = list.filter((one) => !heard.has(one.id));
    heard = new Set(alarms.value.map((one) => one.id));
    if (fresh.length > 0) play(fresh[0]!.level);
  });
  setInterval(() => {
    if (unacknowledged.value.some((one) => one.level === "alarm")) play("alarm");
  }, kRepeatAlarmMs);
}

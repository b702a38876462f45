import { computed, signal } from "@preact/signals";
import { Feed } from "../link/feed";
import type { ConsoleState, DriveEvent, DriveSecond, MapPart, Session, Status } from "../link/messages";

/// What the page knows now. Views read these signals; only this file and session.ts write them.

export const session = signal<Session | null>(null);
export const consoleState = signal<ConsoleState | null>(null);
export const status = signal<Status | null>(null);
export const linked = signal(false);
/// Texts of what the page could not read or the server told it, newest last.
export const problems = signal<string[]>([]);
/// What the server last said that it left out, because this link is slow; empty if nothing for some seconds.
export const leftOut = signal("");
/// performance.now(), ms, four times a second.
export const now = signal(performance.now());
const lastStatusAt = signal(-Infinity);
const lastLinkAt = signal(performance.now());

const kOldAfterMs = 2000;
const kMostEvents = 2000;
const kMostSeconds = 40000; // of the map; then every second one is dropped
const kMostProblems = 20;

/// Whether a replay is shown, running or paused.
export const isReplaying = computed(() => {
  const state = consoleState.value?.state;
  return state === "replaying" || state === "paused";
});
export const isDriving = computed(() => {
  const state = consoleState.value?.state;
  return state === "driving" || state === "starting" || state === "stopping" || isReplaying.value;
});
export const mayOperate = computed(() => session.value?.role === "operator");

/// How old the newest status is, s; 0 while it is fresh or while nothing runs.
export const oldBy = computed(() => {
  if (linked.value && (!isDriving.value || !status.value)) return 0;
  const since = linked.value ? lastStatusAt.value : Math.max(lastLinkAt.value, lastStatusAt.value);
  const age = now.value - since;
  return age > kOldAfterMs ? age / 1000 : 0;
});

export const events = signal<DriveEvent[]>([]);

/// The drive so far, a second an entry.
export const seconds: DriveSecond[] = [];
export const secondsVersion = signal(0);
export const mapOrigin = signal<MapPart["origin"]>(null);

/// One value of a clock in time, for the curves.
export interface ClockSample {
  drive_s: number;
  residual_s: number | null;
  sigma_s: number | null;
}
export const clockSamples = new Map<string, ClockSample[]>();
export const clockVersion = signal(0);
const kClockEvery_s = 0.5;
const kMostSamples = 7200; // an hour

function note(text: string): void {
  if (problems.value.at(-1) !== text) problems.value = [...problems.value, text].slice(-kMostProblems);
}

function forgetDrive(): void {
  events.value = [];
  seconds.length = 0;
  secondsVersion.value++;
  clockSamples.clear();
  clockVersion.value++;
}

function takeClocks(next: Status): void {
  for (const clock of next.clocks ?? []) {
    let samples = clockSamples.get(clock.name);
    if (!samples) clockSamples.set(clock.name, (samples = []));
    const last = samples.at(-1);
    if (last && next.drive_s - last.drive_s < kClockEvery_s && next.drive_s >= last.drive_s) continue;
    samples.push({ drive_s: next.drive_s, residual_s: clock.residual_s, sigma_s: clock.sigma_s });
    if (samples.length > kMostSamples) samples.splice(0, kMostSamples / 4);
    clockVersion.value++;
  }
}

/// What tells one run of a drive or of a replay from the next; a replay that goes on elsewhere is another one.
export const run = signal("");
const runOf = (one: Status): string => `${one.drive} ${one.since ?? ""}`;

function takeStatus(next: Status): void {
  if (status.value && status.value.drive !== next.drive) forgetDrive();
  const isOther = run.value !== "" && run.value !== runOf(next);
  if (isOther) clockSamples.clear(); // the other topics begin again by themselves
  run.value = runOf(next);
  status.value = next;
  lastStatusAt.value = performance.now();
  takeClocks(next);
}

function takeMap(part: MapPart): void {
  mapOrigin.value = part.origin;
  seconds.push(...part.seconds);
  if (seconds.length > kMostSeconds) {
    const kept = seconds.filter((_, index) => index % 2 === 0);
    seconds.length = 0;
    seconds.push(...kept);
  }
  secondsVersion.value++;
}

// Faults come in bursts, and each new list draws the table again, so events are gathered for a moment.
let gathered: DriveEvent[] = [];
let gathering = false;
function takeEvent(event: DriveEvent): void {
  gathered.push(event);
  if (gathering) return;
  gathering = true;
  setTimeout(() => {
    events.value = [...events.value, ...gathered].slice(-kMostEvents);
    gathered = [];
    gathering = false;
  }, 100);
}

function socketUrl(): string {
  const url = new URL("/ws", location.href);
  url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}

export const feed = new Feed(socketUrl());

/// Connects the signals with the feed. Call it once.
export function begin(): void {
  feed.onLink = (connected) => {
    if (!connected && linked.value) lastLinkAt.value = performance.now();
    linked.value = connected;
  };
  feed.onProblem = note;
  let forget: ReturnType<typeof setTimeout> | undefined;
  feed.onLost = (text) => {
    leftOut.value = text;
    clearTimeout(forget);
    forget = setTimeout(() => (leftOut.value = ""), 3000);
  };
  feed.want<ConsoleState>("/hueline/console", (state) => {
    consoleState.value = state;
    // While a replay begins again elsewhere, what came before is over.
    if (state.state === "idle" || state.state === "starting") status.value = null;
  });
  feed.want<Status>("/hueline/status", takeStatus);
  feed.want<DriveEvent>("/hueline/events", takeEvent, () => (events.value = []));
  feed.want<MapPart>("/hueline/map", takeMap, () => {
    seconds.length = 0;
    secondsVersion.value++;
  });
  setInterval(() => (now.value = performance.now()), 250);
}

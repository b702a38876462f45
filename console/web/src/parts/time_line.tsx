import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { post } from "../link/rest";
import { consoleState, isReplaying, mayOperate, status } from "../state/live";
import { formatDriveTime, t } from "../words/words";
import { useTask } from "./task";

export const speeds = [0.5, 1, 2, 5, 10, 20];
const kSettledMs = 400; // keys move the slider in steps, and each jump begins the replay again

/// Where a replay is, below every view: pause, another second of the drive, another speed.
export function TimeLine() {
  const state = consoleState.value;
  const replay = state?.replay ?? null;
  const pacing = useTask(), seeking = useTask();
  /// Where the slider has been moved to, until the replay is there.
  const wanted = useSignal<number | null>(null);
  const timer = useRef<ReturnType<typeof setTimeout>>();
  const now = status.value?.replay;
  const isHere = isReplaying.value && now !== undefined;
  const reached = isHere && now.from_s === replay?.from_s && now.position_s >= now.from_s;
  useEffect(() => {
    if (reached && timer.current === undefined && !seeking.busy) wanted.value = null;
  }, [reached, seeking.busy, now?.from_s]);
  useEffect(() => () => clearTimeout(timer.current), []);
  if (!replay) return null;

  const duration = now?.duration_s ?? replay.duration_s;
  const position = Math.max(now?.position_s ?? 0, replay.from_s);
  const shown = wanted.value ?? position;
  const isPaused = replay.paused;
  const seek = (to: number): void => {
    wanted.value = to;
    clearTimeout(timer.current);
    timer.current = setTimeout(() => {
      timer.current = undefined;
      seeking.run(() => post("replay/seek", { position_s: to }).catch((error: unknown) => {
        wanted.value = null;
        throw error;
      }));
    }, kSettledMs);
  };
  const whole = { position: formatDriveTime(shown), duration: formatDriveTime(duration) };
  const all = speeds.includes(replay.speed) ? speeds : [...speeds, replay.speed].sort((a, b) => a - b);
  return (
    <section class="time-line" aria-label={t("replay.label")}>
      {mayOperate.value && (
        <button type="button" class="pause" disabled={pacing.busy || !isReplaying.value} onClick={() => pacing.run(() => post("replay/pace", { paused: !isPaused }))}>
          {isPaused ? `▶ ${t("replay.go")}` : `❚❚ ${t("replay.pause")}`}
        </button>
      )}
      <input
        type="range"
        min={0}
        max={Math.max(1, Math.floor(duration ?? position))}
        step={1}
        value={Math.floor(shown)}
        disabled={!mayOperate.value || duration === null}
        aria-label={t("replay.position")}
        aria-valuetext={t("replay.of", whole)}
        onInput={(event) => seek(Number(event.currentTarget.value))}
      />
      <span class="value">{isHere && wanted.value === null ? t("replay.of", whole) : t("replay.seeking", { position: whole.position })}</span>
      {mayOperate.value && (
        <select aria-label={t("replay.speed")} value={replay.speed} disabled={pacing.busy || !isReplaying.value} onChange={(event) => {
          const speed = Number(event.currentTarget.value);
          pacing.run(() => post("replay/pace", { speed }));
        }}>
          {all.map((one) => <option key={one} value={one}>{one === 0 ? t("replay.fastest") : `${one} ×`}</option>)}
        </select>
      )}
      <span class="wrong" role="alert">{pacing.wrong || seeking.wrong}</span>
    </section>
  );
}

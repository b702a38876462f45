import { useSignal } from "@preact/signals";
import { whoseName } from "../parts/alarms";
import { Lamp, type LampLevel } from "../parts/lamp";
import type { DriveEvent } from "../link/messages";
import { events, isDriving, problems } from "../state/live";
import { formatDriveTime, known, t } from "../words/words";

const levels = ["alarm", "warning", "waiting", "ok", "info"] as const;
const kMostRows = 300; // on the page; the filters look at all

const unique = (values: string[]): string[] => [...new Set(values)].sort();

/// What happened in this drive, the newest first.
export function EventsView() {
  const level = useSignal(""), kind = useSignal(""), sensor = useSignal(""), search = useSignal("");
  const all = events.value;
  const wanted = search.value.trim().toLowerCase();
  const fits = (one: DriveEvent): boolean =>
    (!level.value || one.level === level.value) && (!kind.value || one.kind === kind.value) &&
    (!sensor.value || one.sensor === sensor.value) &&
    (!wanted || `${one.sensor} ${one.text} ${one.action ?? ""}`.toLowerCase().includes(wanted));
  const shown = all.filter(fits).reverse();
  const choice = (word: "events.level" | "events.kind" | "events.sensor", value: typeof level, options: readonly string[], name: (option: string) => string) => (
    <label>
      {t(word)}
      <select value={value.value} onChange={(event) => (value.value = event.currentTarget.value)}>
        <option value="">{t("events.all")}</option>
        {options.map((one) => <option key={one} value={one}>{name(one)}</option>)}
      </select>
    </label>
  );
  return (
    <>
      <div class="filters">
        {choice("events.level", level, levels, (one) => known("level", one))}
        {choice("events.kind", kind, unique(all.map((one) => one.kind)), (one) => known("kind", one))}
        {choice("events.sensor", sensor, unique(all.map((one) => one.sensor)), whoseName)}
        <label>
          {t("events.search")}
          <input type="search" value={search.value} onInput={(event) => (search.value = event.currentTarget.value)} />
        </label>
      </div>
      <p role="status">{all.length === 0 ? t(isDriving.value ? "events.none" : "drive.none") : shown.length === 0 ? t("events.none_fit") : t("events.count", { shown: Math.min(shown.length, kMostRows), count: all.length })}</p>
      <ul class="events">
        {shown.slice(0, kMostRows).map((one, i) => (
          <li key={all.length - i} class={`item ${one.level}`}>
            <Lamp level={one.level as LampLevel} />
            <div>
              <time>{formatDriveTime(one.drive_s)}</time> <b>{whoseName(one.sensor)}</b> <small>{known("kind", one.kind)}</small>
              <p lang="en">{one.text}{one.action && <> → {one.action}</>}</p>
            </div>
          </li>
        ))}
      </ul>
      {problems.value.length > 0 && (
        <details>
          <summary>{t("word.console")}</summary>
          <ul>{problems.value.map((one, i) => <li key={i} lang="en">{one}</li>)}</ul>
        </details>
      )}
    </>
  );
}

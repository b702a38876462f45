import { useEffect, useState } from "preact/hooks";
import { Lamp } from "../parts/lamp";
import { gradeOf, lampOfGrade, Verdict } from "../parts/verdict";
import { reason, useTask } from "../parts/task";
import { speeds } from "../parts/time_line";
import { get, post } from "../link/rest";
import type { Drive } from "../link/messages";
import { consoleState, isDriving, mayOperate } from "../state/live";
import { formatBytes, formatClock, formatLength, formatTime, t } from "../words/words";

function Replay({ drive }: { drive: string }) {
  const task = useTask();
  const [speed, setSpeed] = useState(1);
  if (!mayOperate.value || isDriving.value) return null;
  return (
    <form class="replay" onSubmit={(event) => { event.preventDefault(); task.run(() => post("replay", { drive, speed })); }}>
      <label>
        {t("drives.speed")}
        <select value={speed} onChange={(event) => setSpeed(Number(event.currentTarget.value))}>
          {speeds.map((one) => <option key={one} value={one}>{one} ×</option>)}
        </select>
      </label>
      <button type="submit" disabled={task.busy}>▶ {t("drives.replay")}</button>
      <span class="wrong" role="alert">{task.wrong}</span>
    </form>
  );
}

/// The drives in the folder of the server, with their verdicts, reports and replays.
export function DrivesView() {
  const [drives, setDrives] = useState<Drive[] | null>(null);
  const [all, setAll] = useState(0);
  const [open, setOpen] = useState<string | null>(null);
  const [wrong, setWrong] = useState("");
  const state = consoleState.value?.state;
  useEffect(() => {
    get<{ drives: Drive[]; all: number }>("drives").then(
      (found) => {
        setDrives(found.drives);
        setAll(found.all);
      },
      (error: unknown) => setWrong(reason(error)),
    );
  }, [state]);
  if (open !== null)
    return (
      <>
        <button type="button" onClick={() => setOpen(null)}>← {t("drives.back")}</button>
        <Replay drive={open} />
        <Verdict drive={open} />
      </>
    );
  if (wrong) return <p class="wrong" role="alert">{wrong}</p>;
  if (!drives) return <p class="empty">…</p>;
  if (drives.length === 0) return <p class="empty">{t("drives.none")}</p>;
  return (
    <>
      {all > drives.length && <p class="empty">{t("drives.left_out", { shown: drives.length, all })}</p>}
      <ul class="drives">
        {drives.map((one) => (
          <li key={one.name}>
            <button type="button" class="line" disabled={one.running} onClick={() => setOpen(one.name)}>
              <Lamp
                level={one.running ? "info" : lampOfGrade[gradeOf(one.grade)]}
                word={one.running ? t("drives.running") : t(`verdict.${gradeOf(one.grade)}`)}
              />
              <span class="name"><b>{one.name}</b></span>
              <span class="value">{formatClock(one.begin, true)}</span>
              <span class="value">{formatTime(one.duration_s)}</span>
              <span class="value">{formatLength(one.path_m)}</span>
              <span class="value">{formatBytes(one.bytes)}</span>
            </button>
          </li>
        ))}
      </ul>
    </>
  );
}

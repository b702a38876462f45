import { useEffect, useState } from "preact/hooks";
import { get, Refused } from "../link/rest";
import type { Remark } from "../link/messages";
import { formatDriveTime, formatLength, t } from "../words/words";
import { whoseName } from "./alarms";
import { Lamp, type LampLevel } from "./lamp";
import { reason } from "./task";

export type Grade = "good" | "remarks" | "again" | "unknown";
export const gradeOf = (words: string | null | undefined): Grade =>
  words === "good" ? "good" : words === "usable with remarks" ? "remarks" : words === "drive again" ? "again" : "unknown";
export const lampOfGrade: Record<Grade, LampLevel> = { good: "ok", remarks: "warning", again: "alarm", unknown: "none" };

interface Summary {
  verdict?: { grade: string; remarks?: Remark[] };
}
const advice = { good: "verdict.leave", remarks: "verdict.look", again: "verdict.stay" } as const;

function RemarkLine({ remark }: { remark: Remark }) {
  const isPart = (remark.end_s ?? 0) > 0;
  return (
    <li class={`item ${gradeOf(remark.grade)}`}>
      <Lamp level={lampOfGrade[gradeOf(remark.grade)]} word={t(`verdict.${gradeOf(remark.grade)}`)} />
      <div>
        <b>{whoseName(remark.sensor)}</b> <span lang="en">{remark.text}</span>
        {isPart && (
          <p class="at">
            {t("verdict.at", {
              begin: formatDriveTime(remark.begin_s),
              end: formatDriveTime(remark.end_s),
              length: formatLength(remark.length_m),
            })}
          </p>
        )}
      </div>
    </li>
  );
}

/// May I leave the site? The verdict of a drive in large letters, its reasons, and its report with the map.
export function Verdict({ drive }: { drive: string }) {
  const [summary, setSummary] = useState<Summary | "none" | null>(null);
  const [wrong, setWrong] = useState("");
  const folder = `/api/drives/${encodeURIComponent(drive)}`;
  useEffect(() => {
    let isCurrent = true;
    setSummary(null);
    setWrong("");
    get<Summary>(`drives/${encodeURIComponent(drive)}/summary.json`).then(
      (found) => isCurrent && setSummary(found ?? "none"),
      (error: unknown) => {
        if (!isCurrent) return;
        // A summary that a full disk has cut is no JSON, though the server has answered.
        if (error instanceof Refused && (error.status === 404 || error.status === 200)) setSummary("none");
        else setWrong(reason(error));
      },
    );
    return () => {
      isCurrent = false;
    };
  }, [drive]);
  if (wrong) return <p class="wrong" role="alert" lang="en">{wrong}</p>;
  if (!summary) return <p class="empty">…</p>;
  const grade = summary === "none" ? "unknown" : gradeOf(summary.verdict?.grade);
  if (summary === "none" || grade === "unknown")
    return (
      <section class="verdict-view" aria-label={t("verdict.title", { name: drive })}>
        <h2>{t("verdict.title", { name: drive })}</h2>
        <p class="answer unknown" role="status"><Lamp level="none" word={t("verdict.unknown")} /></p>
        <p class="advice">{t("verdict.cut", { name: drive })}</p>
      </section>
    );
  const remarks = summary.verdict?.remarks ?? [];
  return (
    <section class="verdict-view" aria-label={t("verdict.title", { name: drive })}>
      <h2>{t("verdict.title", { name: drive })}</h2>
      <p class={`answer ${grade}`} role="status">
        <Lamp level={lampOfGrade[grade]} word={t(`verdict.${grade}`)} />
      </p>
      <p class="advice">{t(advice[grade])}</p>
      <h3>{t("verdict.reasons")}</h3>
      {remarks.length > 0 ? <ul class="items">{remarks.map((one, i) => <RemarkLine key={i} remark={one} />)}</ul> : <p>{t("verdict.no_reasons")}</p>}
      <h3>{t("verdict.report")}</h3>
      <p class="files">
        <a class="button" href={`${folder}/report.html`} target="_blank" rel="noopener">{t("verdict.open_report")}</a>
        <a class="button" href={`${folder}/report.pdf`} download={`${drive}.pdf`}>{t("verdict.save_pdf")}</a>
      </p>
      <iframe class="report" sandbox="" src={`${folder}/report.html`} title={t("verdict.report")} />
    </section>
  );
}

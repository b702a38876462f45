import { isDriving, status } from "../state/live";
import { formatClock, formatDriveTime, formatNumber, t } from "../words/words";

/// The marks that the operator has set in this drive, the newest first.
export function MarksView() {
  const marks = status.value?.marks ?? [];
  if (marks.length === 0) return <p class="empty">{t(isDriving.value ? "marks.none" : "drive.none")}</p>;
  return (
    <table>
      <caption>{t("marks.title")}</caption>
      <thead>
        <tr><th>{t("marks.number")}</th><th>{t("marks.at")}</th><th>{t("marks.note")}</th><th>{t("marks.place")}</th></tr>
      </thead>
      <tbody>
        {[...marks].reverse().map((one) => (
          <tr key={one.number}>
            <td>⚑ {one.number}</td>
            <td>{formatDriveTime(one.drive_s)}<br /><small>{formatClock(one.time)}</small></td>
            <td>{one.note}</td>
            <td>{one.latitude_deg === undefined ? "–" : `${formatNumber(one.latitude_deg, 6)}° ${formatNumber(one.longitude_deg, 6)}°`}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

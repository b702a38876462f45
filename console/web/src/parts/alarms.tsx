import { useState } from "preact/hooks";
import { acknowledge, alarms, isAcknowledged, unacknowledged, type Alarm } from "../state/alarms";
import { language } from "../state/settings";
import { formatDriveTime, known, t } from "../words/words";
import { Lamp } from "./lamp";

const narrow = matchMedia("(max-width: 700px)"); // a telephone shows one, so that the view below stays in sight

export const whoseName = (sensor: string): string =>
  sensor === "drive" || sensor === "console" ? t(`word.${sensor}`) : sensor;

/// Cause and action of a trouble. The program's own sentence names values; in Chinese the translated action stands
/// before it, under the translated title.
export function Explanation({ trouble, cause, action }: { trouble: string | null; cause: string; action: string }) {
  const translated = trouble !== null && known("todo", trouble) !== trouble;
  const own = language.value === "zh" && translated;
  return (
    <dl class="explanation">
      <dt>{t("word.cause")}</dt>
      <dd>
        {!cause && trouble && <span>{known("trouble", trouble)} </span>}
        {cause && <span lang="en">{cause}</span>}
      </dd>
      {(action || translated) && (
        <>
          <dt>{t("word.action")}</dt>
          <dd>
            {(own || !action) && trouble && translated && <span>{known("todo", trouble)} </span>}
            {action && <span lang="en">{action}</span>}
          </dd>
        </>
      )}
    </dl>
  );
}

function One({ alarm }: { alarm: Alarm }) {
  const seen = isAcknowledged(alarm);
  return (
    <li class={`alarm ${alarm.level}${seen ? " seen" : ""}`}>
      <Lamp level={alarm.level} />
      <div>
        <strong>
          {whoseName(alarm.sensor)}: {known("trouble", alarm.trouble)}
        </strong>{" "}
        {alarm.since_s !== null && <span class="since">{t("word.since")} {formatDriveTime(alarm.since_s)}</span>}
        {!seen && <Explanation {...alarm} />}
      </div>
      {seen ? (
        <span class="seen">{t("alarms.acknowledged")}</span>
      ) : (
        <button type="button" onClick={() => acknowledge([alarm])}>
          {t("alarms.acknowledge")}
        </button>
      )}
    </li>
  );
}

/// Warnings and alarms above every view. Acknowledging makes one small and silent; it stays until it is over.
export function Alarms() {
  const [all, setAll] = useState(false);
  // New ones first, so that none hides behind those that are known.
  const list = [...unacknowledged.value, ...alarms.value.filter(isAcknowledged)];
  const most = narrow.matches ? 1 : 3;
  const shown = all ? list : list.slice(0, most);
  return (
    <section class="alarms" aria-label={t("alarms.label")} aria-live="assertive">
      {shown.length > 0 && (
        <ul>
          {shown.map((one) => (
            <One key={one.id} alarm={one} />
          ))}
        </ul>
      )}
      {(list.length > most || unacknowledged.value.length > 2) && (
        <p class="more">
          {list.length > most && (
            <button type="button" onClick={() => setAll(!all)}>
              {all ? t("alarms.fewer") : t("alarms.more", { count: list.length - most })}
            </button>
          )}
          {unacknowledged.value.length > 2 && (
            <button type="button" onClick={() => acknowledge(unacknowledged.value)}>
              {t("alarms.acknowledge_all")}
            </button>
          )}
        </p>
      )}
    </section>
  );
}

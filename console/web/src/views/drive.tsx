import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { Explanation } from "../parts/alarms";
import { Lamp } from "../parts/lamp";
import type { Level, Sensor, Status, Trouble } from "../link/messages";
import { isDriving, oldBy, status } from "../state/live";
import {
  formatAge, formatBytes, formatCount, formatDriveTime, formatLength, formatNumber, formatShare, formatTime, known, t,
} from "../words/words";

const kRank: Record<Level, number> = { ok: 0, waiting: 1, warning: 2, alarm: 3 };
const worst = (levels: Level[]): Level => levels.reduce((a, b) => (kRank[b] > kRank[a] ? b : a), "ok");

function Troubles({ list, well }: { list: Trouble[]; well: string }) {
  if (list.length === 0) return <p>{well}</p>;
  return (
    <>
      {list.map((one) => (
        <div key={one.trouble} class="trouble">
          <p>
            <Lamp level={one.level} word={known("trouble", one.trouble)} />
            {one.since_s !== null && <span class="since"> {t("word.since")} {formatDriveTime(one.since_s)}</span>}
          </p>
          <Explanation {...one} />
        </div>
      ))}
    </>
  );
}

const troublesOf = (sensor: Sensor): Trouble[] => {
  const { trouble, level, cause, action, since_s } = sensor;
  return sensor.troubles ?? (trouble ? [{ trouble, level, cause, action, since_s }] : []);
};

function SensorLine({ sensor }: { sensor: Sensor }) {
  const [isOpen, setOpen] = useState(false);
  const level = t(`level.${sensor.level}`);
  return (
    <li class={`sensor ${sensor.level}`}>
      <button type="button" class="line" aria-expanded={isOpen} aria-label={t("drive.explain", { name: sensor.name, level })} onClick={() => setOpen(!isOpen)}>
        <Lamp level={sensor.level} />
        <span class="name">
          <b>{sensor.name}</b> <small>{known("role", sensor.role)}</small>
        </span>
        <span class="value state">{known("sensor", sensor.state)}</span>
        <span class="value rate">{formatNumber(sensor.rate_hz, (sensor.rate_hz ?? 0) < 20 ? 1 : 0)} Hz</span>
        <span class="value age">{formatAge(sensor.age_s)}</span>
        <span class={`value lost${sensor.lost > 0 ? " some" : ""}`}>{formatCount(sensor.lost)} <small>{t("drive.lost")}</small></span>
      </button>
      {isOpen && (
        <div class="more">
          <Troubles list={troublesOf(sensor)} well={t("drive.all_well")} />
          <p class="figures">
            {t("drive.packets")} {formatNumber(sensor.packets)} · {t("drive.lost")} {formatNumber(sensor.lost)} · {t("drive.shed")}{" "}
            {formatNumber(sensor.shed)} · {formatBytes(sensor.bytes_per_s)}/s{sensor.driver && ` · ${sensor.driver}`}
          </p>
        </div>
      )}
    </li>
  );
}

/// A lamp with its figures. The lamp explains itself when it is tapped.
function Card(props: { title: string; level: Level; troubles: Trouble[]; well: string; children: ComponentChildren }) {
  const [isOpen, setOpen] = useState(false);
  return (
    <section class={`card ${props.level}`}>
      <button type="button" class="line" aria-expanded={isOpen} onClick={() => setOpen(!isOpen)}>
        <span class="name">{props.title}</span>
        <Lamp level={props.level} />
      </button>
      <div class="figures">{props.children}</div>
      {isOpen && (
        <div class="more">
          <Troubles list={props.troubles} well={props.well} />
        </div>
      )}
    </section>
  );
}

const ofRole = (now: Status, role: string): Sensor[] => now.sensors.filter((one) => one.role === role);
const clockLevel: Record<string, Level> = { Locked: "ok", Acquiring: "waiting", Unlocked: "waiting", Holdover: "warning" };

function TimeCard({ now }: { now: Status }) {
  const sensors = ofRole(now, "pps");
  const timing = new Set(["no_clock", "holdover", "late_pulses", "time_sigma"]);
  const troubles = [...sensors.flatMap(troublesOf), ...(now.troubles ?? []).filter((one) => timing.has(one.trouble))];
  const level = worst([...sensors.map((one) => one.level), ...troubles.map((one) => one.level), ...now.clocks.map((one) => clockLevel[one.state] ?? "ok")]);
  return (
    <Card title={t("drive.time")} level={level} troubles={troubles} well={t("drive.time_ok")}>
      {now.clocks.map((clock) => (
        <p key={clock.name}>
          <b>{known("clock", clock.state)}</b> <small>{clock.name}</small>
          <br />
          {clock.holdover_s !== null && <strong>{t("drive.holdover", { time: formatTime(Math.round(clock.holdover_s)) })} · </strong>}
          {t("drive.sigma", { sigma: formatTime(clock.sigma_s) })}
        </p>
      ))}
      {now.clocks.length === 0 && <p>{t("clocks.none")}</p>}
    </Card>
  );
}

function PositionCard({ now }: { now: Status }) {
  const sensors = ofRole(now, "pos");
  const pos = now.pos;
  const place = new Set(["no_pose", "pose_sigma", "weak_gnss"]);
  const troubles = [...sensors.flatMap(troublesOf), ...(now.troubles ?? []).filter((one) => place.has(one.trouble))];
  const level = worst([...sensors.map((one) => one.level), ...troubles.map((one) => one.level)]);
  return (
    <Card title={t("drive.position")} level={level} troubles={troubles} well={t(pos ? "drive.position_ok" : "drive.position_none")}>
      {pos ? (
        <>
          <p>
            <b>{pos.fix === null ? pos.status : known("fix", pos.fix)}</b> <small>{pos.fix !== null && pos.status.replaceAll("_", " ")}</small>
          </p>
          <p>
            {t("drive.horizontal", { sigma: formatLength(pos.sigma_horizontal_m) })} · {t("drive.vertical", { sigma: formatLength(pos.sigma_vertical_m) })}
          </p>
          <p>{t("drive.speed", { speed: formatNumber(pos.speed_m_s === null ? null : pos.speed_m_s * 3.6) })}</p>
        </>
      ) : (
        <p>{t("drive.position_none")}</p>
      )}
    </Card>
  );
}

function DiskCard({ now }: { now: Status }) {
  const troubles = (now.troubles ?? []).filter((one) => one.trouble === "disk");
  return (
    <Card title={t("drive.disk")} level={worst(troubles.map((one) => one.level))} troubles={troubles} well={t("drive.disk_ok")}>
      <p><b>{t("drive.left", { time: formatTime(now.disk?.left_s) })}</b></p>
      <p>{t("drive.free", { bytes: formatBytes(now.disk?.free_bytes) })} · {formatBytes(now.disk?.bytes_per_s)}/s</p>
    </Card>
  );
}

function QueuesCard({ now }: { now: Status }) {
  const troubles = (now.troubles ?? []).filter((one) => one.trouble === "left_out");
  const isFull = now.queues.some((one) => one.share > 0.5);
  const level = worst([...troubles.map((one) => one.level), isFull ? "warning" : "ok"]);
  return (
    <Card title={t("drive.queues")} level={level} troubles={troubles} well={t(isFull ? "drive.queues_full" : "drive.queues_ok")}>
      {now.queues.map((queue) => (
        <label key={queue.name} class="queue">
          <span>{known("queue", queue.name)}</span>
          <meter min={0} max={1} low={0.5} high={0.8} optimum={0} value={queue.share} />
          <span class="value">{formatNumber(100 * queue.share)} %</span>
        </label>
      ))}
    </Card>
  );
}

function PointsCard({ now }: { now: Status }) {
  const mine = new Set(["no_points", "colourless"]);
  const troubles = (now.troubles ?? []).filter((one) => mine.has(one.trouble));
  return (
    <Card title={t("drive.points")} level={worst(troubles.map((one) => one.level))} troubles={troubles} well={t("drive.points_ok")}>
      <p><b>{formatCount(now.points)}</b> · {t("drive.coloured", { share: formatShare(now.coloured_share) })}</p>
      <p>{t("drive.exposures", { count: formatNumber(now.exposures) })} · {t("drive.path", { path: formatLength(now.path_m) })}</p>
    </Card>
  );
}

/// Is all well? One line a sensor, and a card for what the sensors make together.
export function DriveView() {
  const now = status.value;
  if (!now) return <p class="empty">{t(isDriving.value ? "start.starting" : "drive.none")}</p>;
  return (
    <div class={`drive-view${oldBy.value > 0 ? " old" : ""}`}>
      <section class="sensors" aria-label={t("drive.sensors")}>
        <div class="line titles" aria-hidden="true">
          <span />
          <span>{t("drive.sensor")}</span>
          <span class="value state">{t("drive.state")}</span>
          <span class="value rate">{t("drive.rate")}</span>
          <span class="value age">{t("drive.age")}</span>
          <span class="value lost">{t("drive.lost")}</span>
        </div>
        <ul>
          {now.sensors.map((one) => (
            <SensorLine key={one.name} sensor={one} />
          ))}
        </ul>
      </section>
      <div class="cards">
        <TimeCard now={now} />
        <PositionCard now={now} />
        <PointsCard now={now} />
        <DiskCard now={now} />
        <QueuesCard now={now} />
      </div>
    </div>
  );
}

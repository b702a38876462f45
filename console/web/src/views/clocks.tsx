import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import { clockSamples, clockVersion, isDriving, status, type ClockSample } from "../state/live";
import { theme } from "../state/settings";
import { formatDriveTime, formatTime, known, t } from "../words/words";

const kDashes = [[], [10, 5], [3, 3], [12, 4, 3, 4]]; // clocks differ by their dashes, not by colour alone
const kColours = { day: ["#0b57d0", "#a4330d", "#146c2e", "#7a1fa2"], night: ["#8ab4f8", "#ffab91", "#81c995", "#d7aefb"] };

function Curve({ word, value, isLog }: { word: "clocks.residual" | "clocks.sigma"; value: (sample: ClockSample) => number | null; isLog: boolean }) {
  const host = useRef<HTMLDivElement>(null);
  const plot = useRef<uPlot | null>(null);
  const names = [...clockSamples.keys()];
  const data = (): uPlot.AlignedData => {
    const tables = names.map((name) => {
      const samples = clockSamples.get(name) ?? [];
      return [samples.map((one) => one.drive_s), samples.map((one) => { const v = value(one); return isLog && v !== null && v <= 0 ? null : v; })] as uPlot.AlignedData;
    });
    return tables.length === 1 ? tables[0]! : uPlot.join(tables);
  };
  const key = `${names.join(" ")} ${theme.value}`;
  useEffect(() => {
    if (names.length === 0) return;
    const height = (): number => Math.max(160, host.current!.clientHeight - (names.length > 1 ? 40 : 8));
    const ink = theme.value === "day" ? "#1b1f24" : "#e6e6e6", grid = theme.value === "day" ? "#d0d4d9" : "#3a4048";
    const axis = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid }, font: "14px system-ui" };
    const made = new uPlot(
      {
        width: host.current!.clientWidth,
        height: height(),
        legend: { show: names.length > 1 }, // one clock is named above
        scales: { x: { time: false }, y: isLog ? { distr: 3 } : {} },
        axes: [
          { ...axis, values: (_, splits) => splits.map((one) => formatDriveTime(one)) },
          { ...axis, size: 84, values: (_, splits) => splits.map((one) => (one === null ? "" : formatTime(one))) },
        ],
        series: [
          { label: t("clocks.time"), value: (_, v) => (v === null ? "–" : formatDriveTime(v)) },
          ...names.map((name, i) => ({
            label: name,
            stroke: kColours[theme.value][i % 4]!,
            width: 2,
            dash: kDashes[i % 4]!,
            spanGaps: true,
            points: { show: false },
            value: (_: uPlot, v: number | null) => formatTime(v),
          })),
        ],
      },
      data(),
      host.current!,
    );
    plot.current = made;
    const observer = new ResizeObserver(() => made.setSize({ width: host.current!.clientWidth, height: height() }));
    observer.observe(host.current!);
    return () => {
      observer.disconnect();
      made.destroy();
      plot.current = null;
    };
  }, [key]);
  const version = clockVersion.value;
  useEffect(() => {
    if (names.length > 0) plot.current?.setData(data());
  }, [version]);
  return (
    <section class="curve">
      <h2>{t(word)}</h2>
      <div ref={host} class="plot" />
    </section>
  );
}

/// How well the clocks are known: the residual of each pulse, and the sigma that stamps get from it.
export function ClocksView() {
  void clockVersion.value;
  const now = status.value?.clocks ?? [];
  const isTold = [...clockSamples.values()].some((samples) => samples.some((one) => one.residual_s !== null));
  if (clockSamples.size === 0) return <p class="empty">{t(isDriving.value ? "clocks.none" : "drive.none")}</p>;
  return (
    <div class="clocks-view">
      <p class="figures">
        {now.map((one) => (
          <span key={one.name}>
            <b>{one.name}</b> {known("clock", one.state)} · {t("drive.sigma", { sigma: formatTime(one.sigma_s) })}
            {one.holdover_s !== null && ` · ${t("drive.holdover", { time: formatTime(one.holdover_s) })}`}
          </span>
        ))}
      </p>
      {isTold && <Curve word="clocks.residual" value={(one) => one.residual_s} isLog={false} />}
      <Curve word="clocks.sigma" value={(one) => one.sigma_s} isLog />
    </div>
  );
}

import { language } from "../state/settings";
import { catalogue, type Word } from "./catalogue";

const fill = (text: string, values: Record<string, string | number>): string =>
  text.replace(/\{(\w+)\}/g, (whole, name: string) => (name in values ? String(values[name]) : whole));

/// The word in the chosen language.
export function t(word: Word, values: Record<string, string | number> = {}): string {
  return fill(catalogue[word][language.value === "zh" ? 1 : 0], values);
}

/// The word of something that the server names, or that name itself if this page does not know it.
export function known(group: string, name: string): string {
  const word = `${group}.${name}`;
  return word in catalogue ? t(word as Word) : name;
}

const numbers = (): string => (language.value === "zh" ? "zh-CN" : "en-GB");
const kDash = "–";

export function formatNumber(value: number | null | undefined, digits = 0): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return kDash;
  return value.toLocaleString(numbers(), { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

/// Three digits and a prefix: 12.3 M.
export function formatCount(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return kDash;
  for (const [size, prefix] of [[1e9, "G"], [1e6, "M"], [1e3, "k"]] as const)
    if (Math.abs(value) >= 10 * size || (Math.abs(value) >= size && size > 1e3))
      return `${formatNumber(value / size, Math.abs(value) >= 100 * size ? 0 : 1)} ${prefix}`;
  return formatNumber(value);
}
export const formatBytes = (value: number | null | undefined): string => {
  const count = formatCount(value);
  return count === kDash ? kDash : /\d$/.test(count) ? `${count} B` : `${count}B`;
};

/// A length in m, km, cm or mm, as the value asks for.
export function formatLength(metres: number | null | undefined): string {
  if (metres === null || metres === undefined || !Number.isFinite(metres)) return kDash;
  const size = Math.abs(metres);
  if (size >= 10000) return `${formatNumber(metres / 1000, 1)} km`;
  if (size >= 10) return `${formatNumber(metres)} m`;
  if (size >= 1) return `${formatNumber(metres, 1)} m`;
  if (size === 0) return "0 m";
  if (size >= 0.1) return `${formatNumber(metres * 100)} cm`;
  return size >= 0.01 ? `${formatNumber(metres * 100, 1)} cm` : `${formatNumber(metres * 1000, 1)} mm`;
}

/// A short time: 3.2 µs, 12 ms, 4 s, 3 min, 2 h 05 min.
export function formatTime(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return kDash;
  const size = Math.abs(seconds);
  if (size >= 3600) {
    const minutes = Math.round(size / 60);
    return `${Math.sign(seconds) * Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, "0")} min`;
  }
  if (size >= 120) return `${formatNumber(seconds / 60)} min`;
  if (size >= 10) return `${formatNumber(seconds)} s`;
  if (size >= 1) return `${formatNumber(seconds, 1)} s`;
  if (size === 0) return "0 s";
  for (const [unit, name] of [[1e-3, "ms"], [1e-6, "µs"]] as const)
    if (size >= unit) return `${formatNumber(seconds / unit, size >= 10 * unit ? 0 : 1)} ${name}`;
  return `${formatNumber(seconds / 1e-9)} ns`;
}

/// The age of data in a form that does not dance: tenths below ten seconds.
export function formatAge(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined) return t("drive.never");
  return seconds < 0.95 ? t("drive.now") : t("drive.ago", { time: formatTime(seconds) });
}

/// Seconds of the drive as a clock: 0:12, 61:05 is 1:01:05.
export function formatDriveTime(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return kDash;
  const whole = Math.max(0, Math.floor(seconds));
  const two = (n: number): string => String(n).padStart(2, "0");
  const hours = Math.floor(whole / 3600);
  const rest = `${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
  return hours ? `${hours}:${rest}` : rest;
}

export const formatShare = (share: number | null | undefined): string =>
  share === null || share === undefined ? kDash : `${formatNumber(100 * share, share > 0 && share < 0.9995 ? 1 : 0)} %`;

/// A time of day on this device's clock and zone, with the date if `withDate`.
export function formatClock(iso: string | null | undefined, withDate = false): string {
  const date = iso ? new Date(iso) : undefined;
  if (!date || Number.isNaN(date.getTime())) return kDash;
  const time: Intl.DateTimeFormatOptions = { hour: "2-digit", minute: "2-digit", second: "2-digit", hour12: false };
  return withDate
    ? date.toLocaleString(numbers(), { year: "numeric", month: "2-digit", day: "2-digit", hour: "2-digit", minute: "2-digit", hour12: false })
    : date.toLocaleTimeString(numbers(), time);
}

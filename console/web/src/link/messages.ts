/// The JSON that hueline-console sends, as docs/formats.md describes it. Unknown numbers are null.

export type Level = "ok" | "waiting" | "warning" | "alarm";

export interface Trouble {
  trouble: string; // the word of runtime/health.hpp
  level: Level;
  cause: string;
  action: string;
  since_s: number | null; // drive seconds
}

export interface Sensor {
  name: string;
  role: string; // scanner, camera, pos, pps, wheel, other
  driver?: string;
  state: string; // connecting, running, silent, ended, replay
  level: Level;
  trouble: string | null;
  cause: string;
  action: string;
  since_s: number | null;
  troubles?: Trouble[];
  packets: number;
  rate_hz: number | null;
  bytes_per_s?: number | null;
  age_s: number | null;
  lost: number;
  shed: number;
  refused?: number;
}

export interface Clock {
  name: string;
  state: string; // Unlocked, Acquiring, Locked, Holdover
  sigma_s: number | null;
  residual_s: number | null;
  holdover_s: number | null;
}

export interface Position {
  status: string;
  is_good: boolean;
  sigma_horizontal_m: number | null;
  sigma_vertical_m: number | null;
  latitude_deg: number | null;
  longitude_deg: number | null;
  height_m: number | null;
  speed_m_s: number | null;
  heading_deg: number | null;
  fix: string | null;
  satellites: number | null;
}

export interface Mark {
  number: number;
  drive_s: number;
  time: string | null;
  note: string;
  latitude_deg?: number;
  longitude_deg?: number;
}

export interface Status {
  mode: string; // capture or replay
  rig: string;
  drive: string;
  since?: string; // when the program began
  drive_s: number;
  gps: string | null;
  level: Level;
  simulated?: boolean;
  sensors: Sensor[];
  troubles?: Trouble[];
  clocks: Clock[];
  pos: Position | null;
  disk: { free_bytes: number | null; bytes_per_s: number | null; left_s: number | null } | null;
  queues: { name: string; packets: number; share: number }[];
  points: number;
  coloured_share: number | null;
  exposures: number;
  path_m: number | null;
  marks?: Mark[];
  replay?: { speed: number; paused: boolean; from_s: number; position_s: number; duration_s: number | null };
}

export interface DriveEvent {
  time: string | null;
  drive_s: number;
  kind: string; // health, fault, clock, mark, command
  level: Level | "info";
  sensor: string;
  text: string;
  action?: string;
}

/// One second of the drive: index, east and north in m, points, coloured points, sigma in m, kind of the fix.
export type DriveSecond = [number, number, number, number, number, number | null, string | null];

export interface MapPart {
  origin: { latitude_deg: number; longitude_deg: number; height_m: number } | null;
  first_s: number;
  seconds: DriveSecond[];
}

export interface ConsoleState {
  state: "idle" | "checking" | "starting" | "driving" | "replaying" | "paused" | "stopping";
  drive: string | null;
  rig: string | null;
  since: string | null;
  allow_simulate: boolean;
  scenarios: string[];
  replay?: { speed: number; paused: boolean; from_s: number; duration_s: number | null } | null; // while one runs
  last: { drive: string; what?: string; exit_status: number; text: string } | null; // what: capture, replay or simulate
  feed?: "connected" | "none" | "lost";
  ended?: boolean; // the capture has ended although nobody had asked it to, and no operator has acknowledged it
  acknowledged?: string[]; // ids of alarms of the running capture (state/alarms.ts)
  sound_trouble?: string; // why alarms cannot be heard from the vehicle's computer; empty: they can
}

export interface Session {
  name: string;
  role: "operator" | "viewer";
  csrf: string;
}

export interface CheckItem {
  name: string;
  state: "ok" | "remark" | "missing";
  text: string;
  action: string;
}

/// How bright a lens is in the check's test exposure.
export interface LensLight {
  camera: string;
  lens: string;
  median: number;
  dark_share: number;
  saturated_share: number;
  /// Numbers of pixels by value, from 0 to 255.
  histogram: number[];
}

export interface Check {
  state: "none" | "running" | "done" | "failed";
  rig: string | null;
  at: string | null;
  ready: boolean | null;
  items: CheckItem[];
  lenses: LensLight[];
  /// What people have to look at before a drive, in the rig's words.
  checklist: string[];
  /// What the program said if there was no check, and its exit status.
  error: string;
  exit_status: number | null;
}

export interface Drive {
  name: string;
  begin: string | null;
  duration_s: number | null;
  path_m: number | null;
  points: number | null;
  coloured_share: number | null;
  grade: string | null;
  bytes: number;
  running: boolean;
}

export interface Remark {
  grade: string;
  sensor: string;
  text: string;
  begin_s?: number;
  end_s?: number;
  length_m?: number;
}

import { computed, effect, signal } from "@preact/signals";
import type { ComponentType } from "preact";
import { useEffect, useState } from "preact/hooks";
import { Alarms } from "./parts/alarms";
import { Bar } from "./parts/bar";
import { DriveActions, marking } from "./parts/drive_actions";
import { reason } from "./parts/task";
import { TimeLine } from "./parts/time_line";
import { acknowledge, allowSound, unacknowledged } from "./state/alarms";
import { consoleState, isDriving, isReplaying, mayOperate, session } from "./state/live";
import { resume } from "./state/session";
import { theme } from "./state/settings";
import { CloudView } from "./views/cloud";
import { ClocksView } from "./views/clocks";
import { DriveView } from "./views/drive";
import { DrivesView } from "./views/drives";
import { EventsView } from "./views/events";
import { ImagesView } from "./views/images";
import { Login } from "./views/login";
import { MapView } from "./views/map";
import { MarksView } from "./views/marks";
import { StartView } from "./views/start";
import { StopView } from "./views/stop";
import { t } from "./words/words";

const views = {
  start: StartView,
  drive: DriveView,
  stop: StopView,
  cloud: CloudView,
  images: ImagesView,
  map: MapView,
  clocks: ClocksView,
  events: EventsView,
  marks: MarksView,
  drives: DrivesView,
} as const satisfies Record<string, ComponentType>;
type ViewName = keyof typeof views;
const names = Object.keys(views) as ViewName[];

const address = signal(location.hash.slice(1));
addEventListener("hashchange", () => (address.value = location.hash.slice(1)));
const view = computed<ViewName>(() => {
  const name = address.value as ViewName;
  return name in views ? name : isDriving.value ? "drive" : "start";
});
const go = (name: ViewName): void => {
  location.hash = name;
};

// A drive that begins is looked at, and a drive that ends is judged. Other views stay where they are.
let before: string | undefined;
effect(() => {
  const state = consoleState.value?.state;
  if (state === undefined || state === before) return;
  const was = before;
  before = state;
  if (was === undefined) return;
  const shown = view.peek();
  if ((state === "driving" || isReplaying.peek()) && (shown === "start" || shown === "stop" || shown === "drives")) go("drive");
  if (state === "idle" && (was === "driving" || was === "stopping")) go("stop");
});

function onKey(event: KeyboardEvent): void {
  allowSound();
  const target = event.target as HTMLElement;
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (/^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName) || document.querySelector("dialog[open]")) return;
  const digit = "1234567890".indexOf(event.key);
  if (digit >= 0) go(names[digit]!);
  else if (event.key === "m" && isDriving.value && mayOperate.value) marking.value = true;
  else if (event.key === "a") acknowledge(unacknowledged.value);
  else if (event.key === "n") theme.value = theme.value === "day" ? "night" : "day";
  else return;
  event.preventDefault();
}

function Tabs() {
  return (
    <nav class="tabs" aria-label={t("tabs.label")}>
      {names.map((name) => (
        <a key={name} href={`#${name}`} aria-current={view.value === name ? "page" : undefined}>
          {t(`tab.${name}`)}
        </a>
      ))}
    </nav>
  );
}

export function App() {
  const [state, setState] = useState<"asking" | "asked" | { wrong: string; nobody: boolean }>("asking");
  useEffect(() => {
    let retry: ReturnType<typeof setTimeout>;
    const ask = (): void => {
      resume().then(
        (nobody) => setState(nobody ? { wrong: nobody, nobody: true } : "asked"),
        (error: unknown) => {
          setState({ wrong: reason(error), nobody: false });
          retry = setTimeout(ask, 3000);
        },
      );
    };
    ask();
    addEventListener("pointerdown", allowSound);
    addEventListener("keydown", onKey);
    return () => {
      clearTimeout(retry);
      removeEventListener("pointerdown", allowSound);
      removeEventListener("keydown", onKey);
    };
  }, []);

  if (!session.value)
    return (
      <Login
        asking={state === "asking"}
        problem={typeof state === "object" ? state.wrong : ""}
        nobody={typeof state === "object" && state.nobody}
      />
    );
  const Shown = views[view.value];
  return (
    <div class="frame">
      <a class="skip" href="#view" onClick={(event) => { event.preventDefault(); document.getElementById("view")?.focus(); }}>
        {t("bar.skip")}
      </a>
      <Bar />
      <Alarms />
      <Tabs />
      <main id="view" tabIndex={0} class={`view ${view.value}`}>
        <h1 class="hidden">{t(`tab.${view.value}`)}</h1>
        <Shown />
      </main>
      <div class="foot">
        <TimeLine />
        <DriveActions />
      </div>
    </div>
  );
}

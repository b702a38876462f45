import { signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { Lamp } from "../parts/lamp";
import { reason, useTask } from "../parts/task";
import { get, post } from "../link/rest";
import type { Check, CheckItem, LensLight } from "../link/messages";
import { consoleState, isDriving, mayOperate } from "../state/live";
import { formatClock, t } from "../words/words";

const rigs = signal<string[] | null>(null);
const rig = signal("");
const scenario = signal("");
const check = signal<Check | null>(null);
const wrong = signal("");
const isChecking = signal(false);
/// The points of the rig's checklist that are done.
const done = signal<ReadonlySet<string>>(new Set());

const kPollMs = 500;

/// Checks the chosen rig and follows that. The console checks one rig at a time, so a check that another page or an earlier choice has begun
/// is followed if it is of this rig, else waited for. A newer call ends an older one.
let run = 0;
async function runCheck(): Promise<void> {
  const mine = ++run;
  check.value = null;
  done.value = new Set();
  wrong.value = "";
  isChecking.value = rig.value !== "";
  if (!rig.value) return;
  try {
    for (let isMine = false; ; await new Promise((wake) => setTimeout(wake, kPollMs))) {
      const now = await get<Check>("check");
      if (mine !== run) return;
      if (now.rig === rig.value && (isMine || now.state === "running")) {
        isMine = true;
        check.value = now;
        if (now.state !== "running") return;
      } else if (now.state !== "running") {
        await post("check", { rig: rig.value });
        isMine = true;
      }
    }
  } catch (error) {
    if (mine === run) wrong.value = reason(error);
  } finally {
    if (mine === run) isChecking.value = false;
  }
}

async function findRigs(): Promise<void> {
  try {
    const found = await get<{ rigs: { name: string }[] }>("rigs");
    rigs.value = found.rigs.map((one) => one.name);
    if (!rigs.value.includes(rig.value)) rig.value = rigs.value[0] ?? "";
    if (mayOperate.value && !isDriving.value) await runCheck();
  } catch (error) {
    wrong.value = reason(error);
  }
}

const lampOf = { ok: "ok", remark: "warning", missing: "alarm" } as const;

function Item({ item }: { item: CheckItem }) {
  return (
    <li class={`item ${item.state}`}>
      <Lamp level={lampOf[item.state]} word={t(`check.${item.state}`)} />
      <div>
        <b>{item.name}</b> <span lang="en">{item.text}</span>
        {item.action && <p class="action">→ <span lang="en">{item.action}</span></p>}
      </div>
    </li>
  );
}

const isListDone = (): boolean => (check.value?.checklist ?? []).every((item) => done.value.has(item));

function Answer() {
  const now = check.value;
  const driving = isDriving.value;
  const answer = now?.ready !== true ? "not_ready" : isListDone() ? "ready" : "by_hand";
  const kind = driving ? "running" : !now ? (wrong.value || !rig.value ? "unknown" : "checking")
    : now.state === "running" ? "checking" : now.state !== "done" ? "unknown" : answer;
  const lamp = { running: "info", unknown: "none", checking: "waiting", ready: "ok", by_hand: "waiting", not_ready: "alarm" } as const;
  return (
    <p class={`answer ${kind}`} role="status">
      <Lamp level={lamp[kind]} word={t(`start.${kind}`)} />
    </p>
  );
}

const kWrongUse = 2; // the exit status of the program if a rig is wrong

/// Why there was no check, in the operator's words, with those of the program below.
function Failure({ check }: { check: Check }) {
  return (
    <div class="failed">
      <p class="wrong" role="alert">{check.exit_status === kWrongUse ? t("start.wrong_rig", { rig: check.rig ?? "" }) : t("start.check_failed")}</p>
      <details>
        <summary>{t("start.program_said")}</summary>
        <pre lang="en">{check.error}</pre>
      </details>
    </div>
  );
}

function Items() {
  const items = check.value?.items ?? [];
  const of = (state: CheckItem["state"]): CheckItem[] => items.filter((one) => one.state === state);
  const missing = of("missing"), remarks = of("remark"), passed = of("ok");
  return (
    <div class="items">
      {check.value?.error && <Failure check={check.value} />}
      {missing.length > 0 && <h2>{t("start.missing", { count: missing.length })}</h2>}
      <ul>{missing.map((one, i) => <Item key={i} item={one} />)}</ul>
      {remarks.length > 0 && <h2>{t("start.remarks", { count: remarks.length })}</h2>}
      <ul>{remarks.map((one, i) => <Item key={i} item={one} />)}</ul>
      {passed.length > 0 && (
        <details>
          <summary>{t("start.passed", { count: passed.length })}</summary>
          <ul>{passed.map((one, i) => <Item key={i} item={one} />)}</ul>
        </details>
      )}
    </div>
  );
}

/// What the operator has to look at. Each point is ticked by hand.
function Checklist() {
  const items = check.value?.checklist ?? [];
  if (items.length === 0) return null;
  const tick = (item: string): void => {
    const now = new Set(done.value);
    if (!now.delete(item)) now.add(item);
    done.value = now;
  };
  return (
    <fieldset class="checklist">
      <legend>{t("start.checklist")}</legend>
      {items.map((item) => (
        <label key={item}>
          <input type="checkbox" checked={done.value.has(item)} onChange={() => tick(item)} />
          {item}
        </label>
      ))}
    </fieldset>
  );
}

const kBinWidth = 4, kBarHeight = 48;

/// The pixels of a lens by their brightness. Few pixels are to be seen too, so heights go by the root of the number.
function Light({ light }: { light: LensLight }) {
  const most = Math.max(1, ...light.histogram);
  const percent = (share: number): string => (100 * share).toFixed(1);
  const words = t("start.light_of", { median: light.median, dark: percent(light.dark_share), saturated: percent(light.saturated_share) });
  const width = light.histogram.length * kBinWidth;
  return (
    <figure class="light">
      <svg viewBox={`0 0 ${width} ${kBarHeight}`} role="img" aria-label={`${light.lens}: ${words}`}>
        {light.histogram.map((count, i) => {
          const height = kBarHeight * Math.sqrt(count / most);
          return <rect key={i} x={i * kBinWidth} y={kBarHeight - height} width={kBinWidth} height={height} />;
        })}
      </svg>
      <figcaption><b>{light.lens}</b> {words}</figcaption>
    </figure>
  );
}

function Lights() {
  const lenses = check.value?.lenses ?? [];
  if (lenses.length === 0) return null;
  return (
    <section class="lights">
      <h2>{t("start.light")}</h2>
      {lenses.map((one) => <Light key={one.lens} light={one} />)}
    </section>
  );
}

function StartForm() {
  const task = useTask();
  const [name, setName] = useState("");
  const [override, setOverride] = useState("");
  const state = consoleState.value;
  const isReady = check.value?.ready === true;
  const isSimulated = scenario.value !== "";
  const isNameRight = /^[A-Za-z0-9._-]{0,64}$/.test(name);
  const mustSayWhy = (!isReady || !isListDone()) && !isSimulated;
  const start = (): void =>
    task.run(() =>
      post("start", {
        rig: rig.value,
        ...(name && { name }),
        ...(isSimulated && { simulate: scenario.value }),
        ...(mustSayWhy && { override }),
        ...(!isSimulated && done.value.size > 0 && { checked: done.value.size }),
      }),
    );
  return (
    <form class="start-form" onSubmit={(event) => { event.preventDefault(); start(); }}>
      <label>
        {t("start.rig")}
        <select value={rig.value} onChange={(event) => { rig.value = event.currentTarget.value; void runCheck(); }}>
          {(rigs.value ?? []).map((one) => <option key={one}>{one}</option>)}
        </select>
      </label>
      {state?.allow_simulate && (
        <label>
          {t("start.scenario")}
          <select value={scenario.value} onChange={(event) => (scenario.value = event.currentTarget.value)}>
            <option value="">{t("start.scenario_none")}</option>
            {state.scenarios.map((one) => <option key={one} value={one}>{t("start.scenario_one", { name: one })}</option>)}
          </select>
        </label>
      )}
      <label>
        {t("start.name")}
        <input type="text" value={name} autocomplete="off" aria-invalid={!isNameRight} onInput={(event) => setName(event.currentTarget.value)} />
        {!isNameRight && <small class="wrong">{t("start.name_wrong")}</small>}
      </label>
      {isSimulated && !isReady && <p>{t("check.simulated")}</p>}
      {mustSayWhy && check.value?.state === "done" && (
        <label>
          {t("start.override")}
          <input type="text" value={override} maxLength={200} autocomplete="off" onInput={(event) => setOverride(event.currentTarget.value)} />
          <small>{t("start.override_hint")}</small>
        </label>
      )}
      <p class="wrong" role="alert">{task.wrong || wrong.value}</p>
      <div class="buttons">
        <button type="button" onClick={() => void runCheck()} disabled={isChecking.value}>{t("start.check")}</button>
        <button type="submit" class="main" disabled={task.busy || isChecking.value || !rig.value || !isNameRight || (mustSayWhy && override.trim() === "")}>
          {task.busy ? t("start.starting") : t(mustSayWhy ? "start.go_anyway" : "start.go")}
        </button>
      </div>
    </form>
  );
}

/// May I start? The check runs by itself when the page is opened and when another rig is chosen.
export function StartView() {
  useEffect(() => void findRigs(), []);
  const state = consoleState.value;
  const isFailed = state?.state === "idle" && state.last !== null && state.last.exit_status !== 0;
  return (
    <div class="start-view">
      <div class="judgement">
        <Answer />
        {check.value?.at && <p class="at">{check.value.rig} · {formatClock(check.value.at)}</p>}
        {isFailed && (
          <details class="failed" open>
            <summary>{t("start.last_failed", { status: state.last!.exit_status })}</summary>
            <pre lang="en">{state.last!.text}</pre>
          </details>
        )}
        {!isDriving.value && <><Checklist /><Items /><Lights /></>}
      </div>
      {rigs.value?.length === 0 && <p class="wrong" role="alert">{t("start.no_rigs")}</p>}
      {!mayOperate.value ? <p class="empty">{t("error.viewer")}</p> : !isDriving.value && <StartForm />}
    </div>
  );
}

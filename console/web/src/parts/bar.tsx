import { useState } from "preact/hooks";
import { canSound, isMute, overall } from "../state/alarms";
import { post } from "../link/rest";
import { consoleState, isDriving, isReplaying, leftOut, linked, mayOperate, oldBy, session, status } from "../state/live";
import { logout } from "../state/session";
import { language, sound, theme } from "../state/settings";
import { formatDriveTime, formatTime, t } from "../words/words";
import { Dialog } from "./dialog";
import { Lamp } from "./lamp";
import { useTask } from "./task";

function Link() {
  const old = oldBy.value;
  if (old > 0)
    return (
      <span class="link lost" role="status">
        ⚠ {t(linked.value ? "bar.old" : "bar.offline", { age: formatTime(Math.floor(old)) })}
      </span>
    );
  if (!linked.value) return <span class="link">…</span>;
  return (
    <span class="link" title={leftOut.value ? t("bar.slow") : undefined}>
      ● {t("bar.live")}
      {leftOut.value && ` · ${t("bar.slow")}`}
    </span>
  );
}

function What() {
  const state = consoleState.value?.state ?? "idle";
  const now = status.value;
  if (!isDriving.value) return <span class="what">{t(state === "checking" ? "bar.checking" : "bar.idle")}</span>;
  return (
    <span class="what">
      <b>{now?.drive ?? consoleState.value?.drive}</b>{" "}
      {state === "driving" || isReplaying.value ? "" : t(state === "starting" ? "bar.starting" : "bar.stopping")}
      {now?.mode === "replay" && <em>{t(state === "paused" ? "bar.paused" : "bar.replay")}</em>}
      {now?.simulated && <em>{t("bar.simulated")}</em>} <time class="clock">{formatDriveTime(now?.drive_s)}</time>
    </span>
  );
}

function Settings({ close }: { close: () => void }) {
  const hearing = useTask();
  return (
    <Dialog title={t("bar.settings")} close={close}>
      <div class="settings">
        <button type="button" onClick={() => (theme.value = theme.value === "day" ? "night" : "day")}>
          {t(theme.value === "day" ? "bar.theme.night" : "bar.theme.day")}
        </button>
        <button type="button" lang={language.value === "en" ? "zh-CN" : "en"} onClick={() => (language.value = language.value === "en" ? "zh" : "en")}>
          {t("bar.language")}
        </button>
        <button type="button" aria-pressed={sound.value === "on"} onClick={() => (sound.value = sound.value === "on" ? "off" : "on")}>
          {t(sound.value === "on" ? "bar.sound.on" : "bar.sound.off")}
        </button>
        {mayOperate.value && (
          <button type="button" disabled={hearing.busy} onClick={() => hearing.run(() => post("sound"))}>
            {t("bar.sound.try")}
          </button>
        )}
        <button type="button" onClick={() => void logout()}>
          {t("bar.logout")} ({session.value?.name})
        </button>
      </div>
      {hearing.wrong && <p class="wrong" role="alert">{hearing.wrong}</p>}
      {consoleState.value?.sound_trouble && (
        <p>
          {t("bar.sound.none")}: <span lang="en">{consoleState.value.sound_trouble}</span>
        </p>
      )}
      <h3>{t("keys.title")}</h3>
      <ul>
        {(["keys.views", "keys.mark", "keys.acknowledge", "keys.theme"] as const).map((key) => (
          <li key={key}>{t(key)}</li>
        ))}
      </ul>
    </Dialog>
  );
}

/// What is always in sight: how the whole is, which drive runs, and whether what is shown is new.
export function Bar() {
  const [isOpen, setOpen] = useState(false);
  const level = overall.value ?? "none";
  return (
    <header class={`bar ${level}`}>
      <span role="status" class="overall">
        <Lamp level={level} word={level === "ok" ? t("overall.ok") : undefined} big />
      </span>
      <What />
      <Link />
      {isDriving.value && sound.value === "on" && !canSound.value && <span class="touch">{t(isMute.value ? "bar.sound.mute" : "bar.sound.touch")}</span>}
      <button type="button" class="plain menu" aria-label={t("bar.settings")} onClick={() => setOpen(true)}>
        ☰
      </button>
      {isOpen && <Settings close={() => setOpen(false)} />}
    </header>
  );
}

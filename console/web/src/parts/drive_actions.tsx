import { signal } from "@preact/signals";
import { useRef, useState } from "preact/hooks";
import { post } from "../link/rest";
import { consoleState, isDriving, mayOperate, status } from "../state/live";
import { t } from "../words/words";
import { Dialog } from "./dialog";
import { useTask } from "./task";

/// Whether the question for a mark's note is open.
export const marking = signal(false);
const stopping = signal(false);

const kMostNoteBytes = 500;
const quick = ["mark.quick.sign", "mark.quick.blocked", "mark.quick.again", "mark.quick.weather"] as const;

/// Cuts a note to what the server takes, between characters.
export function shortened(note: string): string {
  const bytes = new TextEncoder().encode(note.trim());
  if (bytes.length <= kMostNoteBytes) return note.trim();
  let end = kMostNoteBytes;
  while (end > 0 && (bytes[end]! & 0xc0) === 0x80) --end; // not inside a character
  return new TextDecoder().decode(bytes.subarray(0, end));
}

function MarkDialog({ done }: { done: () => void }) {
  const task = useTask();
  const note = useRef<HTMLInputElement>(null);
  const close = (): void => void (marking.value = false);
  const send = (text: string): void =>
    task.run(async () => {
      await post("mark", { note: shortened(text) });
      close();
      done();
    });
  return (
    <Dialog title={t("mark.title")} close={close}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          send(note.current!.value);
        }}
      >
        <div class="quick">
          {quick.map((word) => (
            <button type="button" key={word} disabled={task.busy} onClick={() => send(t(word))}>
              {t(word)}
            </button>
          ))}
        </div>
        <label>
          {t("mark.note")}
          <input ref={note} type="text" maxLength={kMostNoteBytes} autocomplete="off" />
        </label>
        <p class="wrong" role="alert">{task.wrong}</p>
        <div class="buttons">
          <button type="button" onClick={close}>{t("word.cancel")}</button>
          <button type="submit" class="main" disabled={task.busy}>{t("mark.save")}</button>
        </div>
      </form>
    </Dialog>
  );
}

function StopDialog() {
  const task = useTask();
  const close = (): void => void (stopping.value = false);
  return (
    <Dialog title={t("stop.title")} close={close}>
      <p>{t("stop.text")}</p>
      <p class="wrong" role="alert">{task.wrong}</p>
      <div class="buttons">
        <button type="button" onClick={close}>{t("stop.keep")}</button>
        <button type="button" class="main danger" disabled={task.busy} onClick={() => task.run(() => post("stop").then(close))}>
          {t("stop.confirm")}
        </button>
      </div>
    </Dialog>
  );
}

/// Mark and Stop, in reach on every view while a drive runs.
export function DriveActions() {
  const [told, setTold] = useState("");
  const state = consoleState.value?.state;
  if (!isDriving.value || !mayOperate.value) return null;
  const marks = status.value?.marks ?? [];
  return (
    <div class="actions">
      <button type="button" class="mark" disabled={state !== "driving"} onClick={() => (marking.value = true)}>
        ⚑ {t("mark.button")}{marks.length > 0 && ` (${marks.at(-1)!.number})`}
      </button>
      <button type="button" class="stop" disabled={state === "stopping"} onClick={() => (stopping.value = true)}>
        ■ {state === "stopping" ? t("bar.stopping") : t("stop.button")}
      </button>
      <span role="status" class="told">{told}</span>
      {marking.value && (
        <MarkDialog
          done={() => {
            setTold(t("mark.sent"));
            setTimeout(() => setTold(""), 3000);
          }}
        />
      )}
      {stopping.value && state !== "stopping" && <StopDialog />}
    </div>
  );
}

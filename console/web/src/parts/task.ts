import { useState } from "preact/hooks";
import { Refused } from "../link/rest";
import { t } from "../words/words";

/// What went wrong with a call, as a sentence.
export function reason(error: unknown): string {
  if (error instanceof Refused && error.status === 0) return t("error.no_answer");
  return error instanceof Error ? error.message : String(error);
}

/// Runs one call at a time and keeps what went wrong, for a button and the text below it.
export function useTask(): { busy: boolean; wrong: string; run: (act: () => Promise<unknown>) => void } {
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  const run = (act: () => Promise<unknown>): void => {
    if (busy) return;
    setBusy(true);
    setWrong("");
    act()
      .catch((error: unknown) => setWrong(reason(error)))
      .finally(() => setBusy(false));
  };
  return { busy, wrong, run };
}

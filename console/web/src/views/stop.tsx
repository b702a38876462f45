import { useEffect, useState } from "preact/hooks";
import { Verdict } from "../parts/verdict";
import { reason } from "../parts/task";
import { get } from "../link/rest";
import type { Drive } from "../link/messages";
import { consoleState, isDriving } from "../state/live";
import { t } from "../words/words";

/// The verdict of the drive that ended last.
export function StopView() {
  const [newest, setNewest] = useState<string | null>(null);
  const [wrong, setWrong] = useState("");
  const state = consoleState.value?.state;
  const last = consoleState.value?.last?.drive ?? null;
  useEffect(() => {
    if (last !== null || isDriving.value) return;
    get<{ drives: Drive[] }>("drives").then(
      ({ drives }) => setNewest(drives.find((one) => !one.running)?.name ?? null),
      (error: unknown) => setWrong(reason(error)),
    );
  }, [state, last]);
  if (isDriving.value) return <p class="empty">{t(state === "stopping" ? "stop.closing" : "stop.running")}</p>;
  if (wrong) return <p class="wrong" role="alert">{wrong}</p>;
  const drive = last ?? newest;
  return drive === null ? <p class="empty">{t("stop.none")}</p> : <Verdict drive={drive} />;
}

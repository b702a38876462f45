import type { JSX } from "preact";
import type { Level } from "../link/messages";
import { t } from "../words/words";

/// The levels that a lamp can show. "none": nothing runs. "old": what was said is too old to be believed.
export type LampLevel = Level | "none" | "info";

const shapes: Record<LampLevel, JSX.Element> = {
  ok: (
    <>
      <circle cx="12" cy="12" r="11" class="body" />
      <path d="M6.5 12.5l4 4 7-8" class="sign" />
    </>
  ),
  waiting: (
    <>
      <circle cx="12" cy="12" r="9.5" class="ring" />
      <path d="M12 6.5V12l3.5 3" class="line" />
    </>
  ),
  warning: (
    <>
      <path d="M12 1.5L23.5 22H.5z" class="body" />
      <path d="M12 9v6M12 18v1" class="sign" />
    </>
  ),
  alarm: (
    <>
      <path d="M7.5 1h9L23 7.5v9L16.5 23h-9L1 16.5v-9z" class="body" />
      <path d="M8 8l8 8M16 8l-8 8" class="sign" />
    </>
  ),
  info: (
    <>
      <rect x="2" y="2" width="20" height="20" rx="4" class="ring" />
      <path d="M12 11v6M12 7v1" class="line" />
    </>
  ),
  none: (
    <>
      <circle cx="12" cy="12" r="9.5" class="ring dashed" />
    </>
  ),
};

/// A lamp: a shape of its own for each level, so that it is read without its colour, and a word beside it.
export function Lamp({ level, word, big }: { level: LampLevel; word?: string | undefined; big?: boolean }) {
  return (
    <span class={`lamp ${level}${big ? " big" : ""}`}>
      <svg viewBox="0 0 24 24" aria-hidden="true">
        {shapes[level] ?? shapes.none}
      </svg>
      <span class="word">{word ?? t(`level.${level}`)}</span>
    </span>
  );
}

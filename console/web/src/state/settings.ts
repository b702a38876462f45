import { effect, signal } from "@preact/signals";

/// What one person likes on this device. It is kept in the browser alone.
export type Language = "en" | "zh";
export type Theme = "day" | "night";

function kept<Value extends string>(key: string, allowed: readonly Value[], otherwise: Value) {
  let start = otherwise;
  try {
    const found = localStorage.getItem(`hueline.${key}`) as Value | null;
    if (found !== null && allowed.includes(found)) start = found;
  } catch {
    // A browser that keeps nothing has the default each time.
  }
  const value = signal<Value>(start);
  effect(() => {
    try {
      localStorage.setItem(`hueline.${key}`, value.value);
    } catch {
      // As above.
    }
  });
  return value;
}

export const language = kept<Language>("language", ["en", "zh"], navigator.language.startsWith("zh") ? "zh" : "en");
export const theme = kept<Theme>("theme", ["day", "night"], matchMedia("(prefers-color-scheme: dark)").matches ? "night" : "day");
/// Whether the map of the drive is drawn on the tiles of the console.
export const background = kept<"on" | "off">("background", ["on", "off"], "on");
export const sound = kept<"on" | "off">("sound", ["on", "off"], "on");

effect(() => {
  document.documentElement.lang = language.value === "zh" ? "zh-CN" : "en";
});
effect(() => {
  document.documentElement.dataset["theme"] = theme.value;
});

import { signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { feed, now } from "../state/live";
import { formatAge, t } from "../words/words";

interface CompressedImage {
  format: string;
  data: Uint8Array<ArrayBuffer>;
}
interface Shown {
  url: string;
  at: number; // performance.now()
}
const images = signal<ReadonlyMap<string, Shown>>(new Map());

function show(message: CompressedImage, topic: string): void {
  const name = topic.slice("/image/".length);
  const old = images.value.get(name);
  const url = URL.createObjectURL(new Blob([message.data], { type: `image/${message.format === "jpg" ? "jpeg" : message.format}` }));
  images.value = new Map(images.value).set(name, { url, at: performance.now() });
  if (old) setTimeout(() => URL.revokeObjectURL(old.url), 1000); // the browser may still draw it
}

/// The newest image of each camera. The images are subscribed only while this view is open, because they are large.
export function ImagesView() {
  const [large, setLarge] = useState<string | null>(null);
  useEffect(() => feed.want<CompressedImage>((topic) => topic.startsWith("/image/"), show), []);
  const list = [...images.value].sort(([a], [b]) => a.localeCompare(b));
  if (list.length === 0) return <p class="empty">{t("images.none")}</p>;
  return (
    <div class={`images${large === null ? "" : " large"}`}>
      {list.filter(([name]) => large === null || name === large).map(([name, one]) => (
        <figure key={name}>
          <button type="button" aria-label={`${name}: ${t("images.large")}`} aria-pressed={large === name} onClick={() => setLarge(large === name ? null : name)}>
            <img src={one.url} alt={t("images.alt", { name })} />
          </button>
          <figcaption>
            <b>{name}</b> <span class={now.value - one.at > 3000 ? "late" : ""}>{formatAge((now.value - one.at) / 1000)}</span>
          </figcaption>
        </figure>
      ))}
    </div>
  );
}

import { FoxgloveClient } from "@foxglove/ws-protocol";
import { decoderOf, type Channel, type Decoder } from "./decode";

export type Receiver = (message: never, topic: string) => void;

interface Wanted {
  matches: (topic: string) => boolean;
  receive: Receiver;
  begin: () => void;
}
interface Subscribed {
  topic: string;
  decode: Decoder;
  receive: Receiver[];
}

const kFirstRetryMs = 250;
const kLongestRetryMs = 5000;
const kSilentMs = 8000; // /hueline/console comes every 2 s, so a longer silence is a lost link

/// The connection to hueline-console by the Foxglove WebSocket protocol. It subscribes by topic, connects again by itself,
/// and never stops trying. A damaged message is reported and left out.
export class Feed {
  onLink: (connected: boolean) => void = () => {};
  onProblem: (text: string) => void = () => {};
  onLost: (text: string) => void = () => {};
  bytes = 0; // received since the page was opened

  #url: string;
  #client: FoxgloveClient | undefined;
  #channels = new Map<number, Channel>();
  #subscribed = new Map<number, Subscribed>(); // by subscription
  #ofChannel = new Map<number, number>(); // channel to subscription
  #wanted = new Set<Wanted>();
  #retryMs = kFirstRetryMs;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #heardAt = 0;
  #closed = false;

  constructor(url: string) {
    this.#url = url;
    setInterval(() => this.#watch(), 1000);
  }

  /// Calls `receive` for each message of the topics; ends when the returned function is called. `begin` is called when a
  /// channel is subscribed, because topics with a memory then send it again from its beginning.
  want<Message>(
    topic: string | ((topic: string) => boolean),
    receive: (message: Message, topic: string) => void,
    begin: () => void = () => {},
  ): () => void {
    const wanted: Wanted = {
      matches: typeof topic === "string" ? (other) => other === topic : topic,
      receive: receive as Receiver,
      begin,
    };
    this.#wanted.add(wanted);
    this.#renew();
    return () => {
      this.#wanted.delete(wanted);
      this.#renew();
    };
  }

  open(): void {
    this.#closed = false;
    if (!this.#client) this.#connect();
  }
  close(): void {
    this.#closed = true;
    clearTimeout(this.#timer);
    this.#client?.close();
    this.#forget();
  }

  #connect(): void {
    clearTimeout(this.#timer);
    this.#heardAt = performance.now();
    const client = new FoxgloveClient({
      ws: new WebSocket(this.#url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) as never,
    });
    this.#client = client;
    const ifCurrent = <A extends unknown[]>(act: (...args: A) => void) => (...args: A): void => {
      if (this.#client === client) act(...args);
    };
    client.on("serverInfo", ifCurrent(() => {
      this.#retryMs = kFirstRetryMs;
      this.onLink(true);
    }));
    client.on("advertise", ifCurrent((channels) => {
      for (const channel of channels) this.#channels.set(channel.id, channel as Channel);
      this.#renew();
    }));
    client.on("unadvertise", ifCurrent((ids) => {
      for (const id of ids) {
        this.#drop(id, false);
        this.#channels.delete(id);
      }
    }));
    client.on("status", ifCurrent((status) => {
      this.#heardAt = performance.now();
      if (status.id === "lost") this.onLost(status.message);
      else if (status.level > 0) this.onProblem(status.message);
    }));
    client.on("message", ifCurrent(({ subscriptionId, data }) => {
      this.#heardAt = performance.now();
      this.bytes += data.byteLength;
      const one = this.#subscribed.get(subscriptionId);
      if (!one) return;
      try {
        const message = one.decode(data) as never;
        for (const receive of one.receive) receive(message, one.topic);
      } catch (error) {
        this.onProblem(`${one.topic}: ${error instanceof Error ? error.message : String(error)}`);
      }
    }));
    client.on("error", ifCurrent(() => {})); // a close follows
    client.on("close", ifCurrent(() => this.#again()));
  }

  #again(): void {
    this.#forget();
    this.onLink(false);
    if (this.#closed) return;
    this.#timer = setTimeout(() => this.#connect(), this.#retryMs);
    this.#retryMs = Math.min(2 * this.#retryMs, kLongestRetryMs);
  }

  #watch(): void {
    if (!this.#client || performance.now() - this.#heardAt < kSilentMs) return;
    this.#client.close();
    this.#again(); // the close of a dead link can take a minute, so it is not waited for
  }

  #forget(): void {
    this.#client = undefined;
    this.#channels.clear();
    this.#subscribed.clear();
    this.#ofChannel.clear();
  }

  #drop(channel: number, tell = true): void {
    const subscription = this.#ofChannel.get(channel);
    if (subscription === undefined) return;
    this.#ofChannel.delete(channel);
    this.#subscribed.delete(subscription);
    if (tell) this.#client?.unsubscribe(subscription);
  }

  /// Subscribes what is wanted and offered, and nothing else.
  #renew(): void {
    if (!this.#client) return;
    for (const [id, channel] of this.#channels) {
      const wanted = [...this.#wanted].filter((one) => one.matches(channel.topic));
      const receive = wanted.map((one) => one.receive);
      const subscription = this.#ofChannel.get(id);
      if (receive.length === 0) {
        this.#drop(id);
      } else if (subscription !== undefined) {
        this.#subscribed.get(subscription)!.receive = receive;
      } else {
        try {
          const decode = decoderOf(channel);
          for (const one of wanted) one.begin();
          const made = this.#client.subscribe(id);
          this.#ofChannel.set(id, made);
          this.#subscribed.set(made, { topic: channel.topic, decode, receive });
        } catch (error) {
          this.#channels.delete(id); // it is offered again with the next connection
          this.onProblem(error instanceof Error ? error.message : String(error));
        }
      }
    }
  }
}

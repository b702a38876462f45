import { get, post, Refused, setCsrf } from "../link/rest";
import type { ConsoleState, Session } from "../link/messages";
import { consoleState, feed, session, status } from "./live";

/// Who is logged in: asks the server, and connects the feed if somebody is. Returns the server's text if nobody can log in
/// yet; throws Refused if the server does not answer.
export async function resume(): Promise<string> {
  try {
    enter(await get<Session>("session"));
    return "";
  } catch (error) {
    if (error instanceof Refused && error.status === 401) return "";
    if (error instanceof Refused && error.status === 503) return error.message;
    throw error;
  }
}

function enter(who: Session): void {
  setCsrf(who.csrf);
  session.value = who;
  feed.open();
  void get<ConsoleState>("state").then((state) => (consoleState.value ??= state), () => {});
}

/// Throws Refused with the server's reason.
export async function login(name: string, password: string): Promise<void> {
  enter(await post<Session>("login", { name, password }));
}

export async function logout(): Promise<void> {
  await post("logout").catch(() => {}); // the page forgets the session even if the server does not answer
  feed.close();
  setCsrf("");
  session.value = null;
  status.value = null;
  consoleState.value = null;
}

/// What the server refused, in its own words.
export class Refused extends Error {
  constructor(readonly status: number, text: string) {
    super(text);
  }
}

let csrf = "";
export function setCsrf(token: string): void {
  csrf = token;
}

const kTimeoutMs = 15000;

async function call<Answer>(method: string, path: string, body?: object): Promise<Answer> {
  const headers: Record<string, string> = {};
  if (body) headers["Content-Type"] = "application/json";
  if (csrf) headers["X-Csrf"] = csrf;
  let answer: Response;
  try {
    answer = await fetch(`/api/${path}`, {
      method,
      headers,
      body: body ? JSON.stringify(body) : null,
      credentials: "same-origin",
      signal: AbortSignal.timeout(kTimeoutMs),
    });
  } catch {
    throw new Refused(0, "");
  }
  const text = await answer.text();
  let json: unknown = {};
  try {
    json = text ? JSON.parse(text) : {};
  } catch {
    throw new Refused(answer.status, `${path}: ${text.slice(0, 200)}`);
  }
  if (!answer.ok) throw new Refused(answer.status, String((json as { error?: unknown }).error ?? answer.statusText));
  return json as Answer;
}

/// Asks hueline-console. A refusal is thrown as Refused; its status 0 means that there was no answer.
export const get = <Answer>(path: string): Promise<Answer> => call<Answer>("GET", path);
export const post = <Answer>(path: string, body: object = {}): Promise<Answer> => call<Answer>("POST", path, body);

import { useRef } from "preact/hooks";
import { Refused } from "../link/rest";
import { login } from "../state/session";
import { language } from "../state/settings";
import { reason, useTask } from "../parts/task";
import { t } from "../words/words";

/// Asks for name and password. `problem` is why the server cannot be used, `nobody` that it has no users yet.
export function Login({ asking, problem, nobody }: { asking: boolean; problem: string; nobody: boolean }) {
  const task = useTask();
  const name = useRef<HTMLInputElement>(null);
  const password = useRef<HTMLInputElement>(null);
  if (asking) return <main class="login"><p>{t("app.loading")}</p></main>;
  const send = (): void =>
    task.run(async () => {
      try {
        await login(name.current!.value, password.current!.value);
      } catch (error) {
        password.current?.select();
        throw error instanceof Refused ? new Error(reason(error)) : error;
      }
    });
  return (
    <main class="login">
      <h1>{t("app.title")}</h1>
      {nobody ? (
        <>
          <h2>{t("login.none")}</h2>
          <p class="wrong" role="alert" lang="en">{problem}</p>
        </>
      ) : (
        <form onSubmit={(event) => { event.preventDefault(); send(); }}>
          <label>
            {t("login.name")}
            <input ref={name} name="name" type="text" autocomplete="username" autocapitalize="none" required />
          </label>
          <label>
            {t("login.password")}
            <input ref={password} name="password" type="password" autocomplete="current-password" required />
          </label>
          <p class="wrong" role="alert">{task.wrong || problem}</p>
          <button type="submit" class="main" disabled={task.busy}>{t(task.busy ? "login.busy" : "login.submit")}</button>
        </form>
      )}
      <button type="button" class="plain" lang={language.value === "en" ? "zh-CN" : "en"} onClick={() => (language.value = language.value === "en" ? "zh" : "en")}>
        {t("bar.language")}
      </button>
    </main>
  );
}

// Signing in, one's own account, administration, in a real browser against the mock.

import assert from "node:assert/strict";
import { after, before, beforeEach, describe, test } from "node:test";
import { startMock } from "../mock-server.mjs";
import { findChrome, HOW_TO_GET_CHROME, openPage } from "./chrome.mjs";

const skip = (await findChrome()) ? false : HOW_TO_GET_CHROME;

describe("people and rights", { skip }, () => {
  /** @type {Awaited<ReturnType<typeof startMock>>} */
  let mock;
  /** @type {Awaited<ReturnType<typeof openPage>>} */
  let tab;

  before(async () => {
    mock = await startMock({ stepMs: 500 });
    tab = await openPage(mock.url);
    tab.page.on("dialog", (dialog) => dialog.accept());
  });
  after(async () => {
    await tab?.close();
    await mock?.stop();
  });
  beforeEach(async () => {
    mock.staff.open();
    await tab.page.goto("about:blank");
  });
  const visit = (/** @type {string} */ hash) => tab.page.goto(`${mock.url}/${hash}`);
  const ready = () => tab.page.locator("html[data-ready=yes]").waitFor();
  const signIn = async (password = "a good sentence") => {
    await tab.page.locator("[data-testid=door] [name=name]").fill("Chen Wei");
    await tab.page.locator("[data-testid=door] [name=password]").fill(password);
    await tab.page.keyboard.press("Enter");
  };
  /** What a refusal leaves in the console. @param {string} status */
  const refused = (status) => tab.wrongs.splice(0, tab.wrongs.length, ...tab.wrongs.filter((w) => !w.includes(status)));

  test("whoever is unknown meets the door, and nothing of the site is behind it", async () => {
    mock.staff.close();
    await visit("#/sessions/s9");
    await tab.page.getByTestId("door").waitFor();
    assert.equal(await tab.page.locator("[data-testid=session]").count(), 0);
    await tab.page.keyboard.press("Escape");
    await signIn("not the password");
    await tab.page.getByTestId("problem").getByText("found at least one of them wrong").waitFor();
    refused("401");
    await signIn();
    await ready();
    // On to the place that was asked for.
    await tab.page.locator("[data-testid=session]").waitFor();
    await tab.page.locator("#account").getByText("Chen Wei").waitFor();
  });

  test("a sign-in that has ended brings the door back", async () => {
    await visit("#/live");
    await ready();
    mock.staff.close();
    await visit("#/sessions");
    await tab.page.getByTestId("door").waitFor();
    refused("401");
  });

  test("the first account is made with the setup token", async () => {
    await visit("#/account");
    const form = tab.page.getByTestId("set-up");
    await form.locator("[name=setup_token]").fill("another token");
    await form.locator("[name=name]").fill("Wang Fang");
    await form.locator("[name=password]").fill("a good sentence");
    await tab.page.keyboard.press("Enter");
    await tab.page.getByTestId("problem").waitFor();
    refused("401");
    await form.locator("[name=setup_token]").fill("the setup token");
    await form.getByRole("button").click();
    await tab.page.getByRole("heading", { name: "Wang Fang" }).waitFor();
  });

  test("a token is made, shown once and revoked; a password is changed", async () => {
    mock.staff.close();
    await visit("#/account");
    await signIn();
    await tab.page.locator(".new-token [name=name]").fill("survey script");
    await tab.page.getByRole("button", { name: "Create" }).click();
    await tab.page.getByTestId("token-secret").getByText("5e5e").waitFor();
    await tab.page.getByTestId("tokens").getByText("survey script").waitFor();
    await tab.page.getByTestId("tokens").getByRole("button", { name: "Revoke" }).first().click();
    await tab.page.getByTestId("tokens").getByText("revoked").waitFor();
    await tab.page.locator("[name=old]").fill("a good sentence");
    await tab.page.locator("[name=new]").fill("a better sentence");
    await tab.page.getByRole("button", { name: "Change password" }).click();
    await tab.page.getByText("All other browsers have been signed out").waitFor();
    await tab.page.getByRole("button", { name: "Sign out" }).first().click();
    await tab.page.getByTestId("door").waitFor();
  });

  test("an administrator adds an account, changes a role, and is told what cannot be", async () => {
    mock.staff.close();
    await visit("#/admin");
    await signIn();
    const form = tab.page.getByTestId("admin-accounts").locator("form");
    await form.locator("[name=name]").fill("Li Na");
    await form.locator("[name=password]").fill("a good sentence");
    await form.locator("[name=role]").selectOption("viewer");
    await form.getByRole("button", { name: "Add" }).click();
    await tab.page.getByTestId("accounts").getByText("Li Na").waitFor();
    await tab.page.getByLabel("Role Li Na").selectOption("dispatcher");
    await tab.page.waitForFunction(
      () =>
        /** @type {HTMLSelectElement | null} */ (document.querySelector("[data-account=a2] [data-field=role]"))
          ?.value === "dispatcher",
    );
    assert.equal(mock.staff.accounts[1].role, "dispatcher");
    await tab.page.getByLabel("Can sign in Chen Wei").click();
    await tab.page.getByTestId("problem").getByText("expected an administrator").waitFor();
    refused("409");
    await tab.page.locator("[data-account=a2] [data-remove]").click();
    await tab.page.getByTestId("accounts").getByText("Li Na").waitFor({ state: "detached" });
  });

  test("who changed what is read as from → to; a backup is made", async () => {
    await visit("#/admin/audit");
    await tab.page.getByTestId("audit").getByText("name: Li Na → 李娜").waitFor();
    await visit("#/admin/server");
    await tab.page.getByRole("button", { name: "Back up now" }).click();
    await tab.page.getByText("lodestep-20261125T081500Z.db").waitFor();
  });

  test("the API is described by the server itself", async () => {
    await visit("#/api");
    await tab.page.locator("summary", { hasText: "/api/v1/markers/{name}" }).click();
    await tab.page.getByText("e_m?: number").waitFor();
    await tab.page.getByText("404 marker_not_found").waitFor();
    await tab.page.getByText("view everything", { exact: false }).first().waitFor();
  });

  test("nothing went wrong", () => assert.deepEqual(tab.wrongs, []));
});

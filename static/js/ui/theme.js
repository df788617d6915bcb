// Light and dark: the system's, until the person chooses.

import * as store from "./remembered.js";

/** @returns {"light" | "dark"} */
export function chosenTheme() {
  const chosen = store.recall("theme");
  if (chosen === "light" || chosen === "dark") return chosen;
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

/** @param {"light" | "dark"} theme */
export function showTheme(theme) {
  document.documentElement.dataset.theme = theme;
}

export function toggleTheme() {
  const next = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  store.remember("theme", next);
  showTheme(next);
}

// A list as a table to take along.

/** What a spreadsheet takes for the beginning of a formula, also in the full width of East Asian keyboards. */
const BEGINS_A_FORMULA = /^[=+\-@\t\r＝＋－＠]/u;

/** @param {unknown} value a number as it is; a text is quoted, and no formula to the program that opens it */
function cell(value) {
  if (value === null || value === undefined) return "";
  if (typeof value === "number" || typeof value === "boolean") return String(value);
  const text = String(value);
  return `"${BEGINS_A_FORMULA.test(text) ? "'" : ""}${text.replaceAll('"', '""')}"`;
}

/**
 * @param {readonly string[]} columns
 * @param {Record<string, unknown>[]} rows
 */
export function csv(columns, rows) {
  return `${[columns.join(","), ...rows.map((row) => columns.map((name) => cell(row[name])).join(","))].join("\n")}\n`;
}

/**
 * Hands a text to the browser as a file.
 * @param {string} name
 * @param {string} text
 */
export function download(name, text) {
  // With its mark of UTF-8, by which a spreadsheet knows the letters.
  const url = URL.createObjectURL(new Blob(["\ufeff", text], { type: "text/csv;charset=utf-8" }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  URL.revokeObjectURL(url);
}

//! `migrations/schema.sql`, the tables as all steps leave them, is written here and held true. The statements are SQLite's
//! own, read from a database that took every step; the comments are those of the steps.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use sqlx::{AssertSqlSafe, Connection, SqliteConnection};

use super::migrations;

/// Set to write the file in place of comparing it.
const WRITE: &str = "LODESTEP_WRITE_SCHEMA";
const HEAD: &str = "\
-- The tables of the newest step, written by a test from the steps beside it. Read it; never run or edit it. Anew:
--
--   LODESTEP_WRITE_SCHEMA=1 cargo test -p lodestep --lib schema_tests
--
-- Ids, instants, times and positions are in the units that the head of 0001_walks_and_findings.sql lays down.
";
/// Characters of a line.
const WIDTH: usize = 120;
/// Words that a line within a table begins with when it goes on with a column or the table, and names no new column.
const NO_COLUMN: [&str; 6] = ["check", "primary", "unique", "foreign", "references", "default"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../migrations")
}

/// Name and text of every step, in order.
fn steps() -> Vec<(String, String)> {
    let files = std::fs::read_dir(folder()).unwrap().map(|file| file.unwrap());
    let mut steps: Vec<(String, String)> = files
        .map(|file| (file.file_name().into_string().unwrap(), file.path()))
        .filter(|(name, _)| name.starts_with(|c: char| c.is_ascii_digit()))
        .map(|(name, path)| (name, std::fs::read_to_string(path).unwrap()))
        .collect();
    steps.sort_unstable();
    steps
}

/// The code of a line and its comment.
fn split(line: &str) -> (&str, Option<&str>) {
    let mut quoted = false;
    for (at, c) in line.char_indices() {
        quoted ^= c == '\'';
        if !quoted && line[at..].starts_with("--") {
            return (line[..at].trim(), Some(line[at + 2..].trim()));
        }
    }
    (line.trim(), None)
}

/// SQL on one line, without comments and the quotes that SQLite puts around a name when a table is renamed.
fn bare(sql: &str) -> String {
    let code: Vec<&str> = sql.lines().flat_map(|line| split(line).0.split_whitespace()).collect();
    code.join(" ").replace('"', "").replace("( ", "(").replace(" )", ")").replace(" ,", ",")
}

/// What the steps say of tables, indexes and triggers, of columns, and in headings between columns.
#[derive(Default)]
struct Comments {
    objects: BTreeMap<String, String>,
    columns: BTreeMap<(String, String), String>,
    headings: BTreeMap<(String, String), String>,
}

impl Comments {
    fn read(&mut self, step: &str) {
        // The comment lines right before the next statement; and the first paragraph of the file, which is of its first
        // statement where that has none of its own.
        let mut pending: Vec<&str> = Vec::new();
        let mut first: Option<String> = None;
        let mut table: Option<String> = None;
        let mut column = String::new();
        for line in step.lines() {
            let (code, comment) = split(line);
            let mut words = code.split_whitespace();
            let Some(word) = words.next() else {
                let indented = line.len() - line.trim_start().len() > 4;
                match (comment, &table) {
                    (Some(comment), Some(table)) if indented => self.of_column(table, &column, comment),
                    (Some(comment), _) => pending.push(comment),
                    (None, _) if first.is_none() => first = Some(std::mem::take(&mut pending).join(" ")),
                    (None, _) => pending.clear(),
                }
                continue;
            };
            let before = std::mem::take(&mut pending).join(" ");
            if let Some(name) = table.clone() {
                if word.starts_with(')') {
                    table = None;
                } else {
                    if !NO_COLUMN.contains(&word) {
                        word.clone_into(&mut column);
                    }
                    if !before.is_empty() {
                        self.headings.insert((name.clone(), column.clone()), before);
                    }
                    self.of_column(&name, &column, comment.unwrap_or_default());
                }
                continue;
            }
            let about = if before.is_empty() { first.take().unwrap_or_default() } else { before };
            first = Some(String::new());
            let rest: Vec<&str> = words.filter(|word| *word != "unique").collect();
            match (word, rest.as_slice()) {
                ("create", [what, name, ..]) => {
                    self.objects.insert((*name).to_owned(), about);
                    table = (*what == "table").then(|| (*name).to_owned());
                }
                ("alter", ["table", name, "add", "column", column, ..]) => {
                    self.of_column(name, column, comment.unwrap_or(&about));
                }
                ("alter", ["table", name, "rename", "column", from, "to", to]) => {
                    self.rename_column(name, from, to.trim_end_matches(';'), about);
                }
                ("alter", ["table", from, "rename", "to", to]) => {
                    self.rename(from, to.trim_end_matches(';'), about);
                }
                ("drop", ["table", name]) => self.forget_columns(name.trim_end_matches(';')),
                _ => {}
            }
        }
    }

    fn of_column(&mut self, table: &str, column: &str, comment: &str) {
        let all = self.columns.entry((table.to_owned(), column.to_owned())).or_default();
        *all = format!("{all} {comment}").trim().to_owned();
    }

    fn forget_columns(&mut self, of: &str) {
        self.columns.retain(|(table, _), _| table != of);
        self.headings.retain(|(table, _), _| table != of);
    }

    /// What is said here of a column, else what was said of it under its former name.
    fn rename_column(&mut self, table: &str, from: &str, to: &str, about: String) {
        let before = self.columns.remove(&(table.to_owned(), from.to_owned())).unwrap_or_default();
        let about = if about.is_empty() { before } else { about };
        self.columns.insert((table.to_owned(), to.to_owned()), about);
    }

    /// A table under another name: what is said of it here, else of the table whose place it takes, else of itself.
    fn rename(&mut self, from: &str, to: &str, about: String) {
        let before = self.objects.remove(from).unwrap_or_default();
        if about.is_empty() {
            self.objects.entry(to.to_owned()).or_insert(before);
        } else {
            self.objects.insert(to.to_owned(), about);
        }
        for comments in [&mut self.columns, &mut self.headings] {
            let moved: Vec<_> = comments.keys().filter(|(table, _)| table == from).cloned().collect();
            for key in moved {
                let comment = comments.remove(&key).unwrap_or_default();
                comments.insert((to.to_owned(), key.1), comment);
            }
        }
    }
}

/// Comment lines that hold this text.
fn comment_lines(indent: &str, text: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= WIDTH => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("{indent}-- {word}")),
        }
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// The columns and conditions between the outermost brackets, and what follows these.
fn definitions(sql: &str) -> (Vec<String>, String) {
    let sql = bare(sql);
    let (open, close) = (sql.find('(').unwrap(), sql.rfind(')').unwrap());
    let mut all = vec![String::new()];
    let mut depth = 0;
    for c in sql[open + 1..close].chars() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        if c == ',' && depth == 0 {
            all.push(String::new());
        } else {
            all.last_mut().unwrap().push(c);
        }
    }
    (all.iter().map(|one| one.trim().to_owned()).collect(), sql[close + 1..].trim().to_owned())
}

fn write_table(name: &str, sql: &str, comments: &Comments) -> String {
    let (all, end) = definitions(sql);
    let width = all.iter().map(|one| one.chars().count()).filter(|n| *n < 50).max().unwrap_or(0) + 1;
    let mut out = format!("create table {name} (\n");
    for (k, one) in all.iter().enumerate() {
        let key = (name.to_owned(), one.split(' ').next().unwrap().to_owned());
        out += &comment_lines("    ", comments.headings.get(&key).map_or("", String::as_str));
        let comma = if k + 1 < all.len() { "," } else { "" };
        let comment = comments.columns.get(&key).map_or("", String::as_str);
        let line = format!("    {:width$}  -- {comment}", format!("{one}{comma}"));
        if comment.is_empty() || line.chars().count() > WIDTH {
            out += &comment_lines("    ", comment);
            out += &format!("    {one}{comma}\n");
        } else {
            out += &format!("{line}\n");
        }
    }
    out + &format!(") {end};\n")
}

/// SQLite writes the first words of a statement anew, in capitals.
fn in_small_letters(sql: &str) -> String {
    let capitals = sql.find(|c: char| c.is_ascii_lowercase()).unwrap_or(sql.len());
    sql[..capitals].to_lowercase() + &sql[capitals..]
}

/// Every table, index and trigger: what it is, the table that it belongs to, its name and its statement.
async fn objects(db: &mut SqliteConnection) -> Vec<(String, String, String, String)> {
    let sql = "select type, tbl_name, name, sql from sqlite_master where sql is not null
        and name not like 'sqlite\\_%' escape '\\' and name not like '\\_sqlx%' escape '\\'
        order by tbl_name, type = 'trigger', type = 'index', name";
    sqlx::query_as(sql).fetch_all(db).await.unwrap()
}

async fn empty() -> SqliteConnection {
    SqliteConnection::connect("sqlite::memory:").await.unwrap()
}

async fn schema() -> String {
    let mut db = empty().await;
    migrations::run(&mut db).await.unwrap();
    let mut comments = Comments::default();
    for (_, step) in steps() {
        comments.read(&step);
    }
    let mut out = HEAD.to_owned();
    for (kind, _, name, sql) in objects(&mut db).await {
        let about = comments.objects.get(&name).map_or("", String::as_str);
        if kind == "table" || !about.is_empty() {
            out += "\n";
        }
        out += &comment_lines("", about);
        out += &match kind.as_str() {
            "table" => write_table(&name, &sql, &comments),
            // As it was typed, lines and all.
            "trigger" => format!("{};\n", in_small_letters(&sql)),
            _ => format!("{};\n", in_small_letters(&bare(&sql))),
        };
    }
    out
}

#[tokio::test]
async fn the_written_schema_is_that_of_all_steps() {
    let path = folder().join("schema.sql");
    let schema = schema().await;
    if std::env::var_os(WRITE).is_some() {
        std::fs::write(&path, &schema).unwrap();
    }
    assert!(
        std::fs::read_to_string(&path).unwrap_or_default() == schema,
        "migrations/schema.sql is not what the steps make: run the command at its top, and look at the difference"
    );
}

#[tokio::test]
async fn a_database_made_from_the_written_schema_is_the_same_as_one_made_step_by_step() {
    let (mut by_steps, mut at_once) = (empty().await, empty().await);
    migrations::run(&mut by_steps).await.unwrap();
    sqlx::raw_sql(AssertSqlSafe(schema().await)).execute(&mut at_once).await.unwrap();
    let told = |objects: Vec<(String, String, String, String)>| -> Vec<String> {
        objects
            .into_iter()
            .map(|(kind, table, name, sql)| format!("{kind} {table} {name} {}", bare(&sql).to_lowercase()))
            .collect()
    };
    assert_eq!(told(objects(&mut at_once).await), told(objects(&mut by_steps).await));
}

#[test]
fn every_step_has_its_line_in_the_readme() {
    let readme = std::fs::read_to_string(folder().join("README.md")).unwrap();
    let named: Vec<&str> =
        readme.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect();
    let steps = steps();
    assert_eq!(named, steps.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>());
}

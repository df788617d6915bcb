//! What a database is made of, tables, indexes, triggers and views, held against what the steps make.
//!
//! A trigger or a view that came with a file would run inside every write of the server's, with all of its rights.

use sqlx::{Row, SqliteConnection};

use super::StoreError;

/// How many differences a sentence names.
const NAMED: usize = 3;

/// A row of `sqlite_schema`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Item {
    /// `table`, `index`, `trigger` or `view`.
    kind: String,
    name: String,
    table: String,
    /// The words of the statement that made it; none for an index that a table makes by itself.
    words: Vec<String>,
}

impl Item {
    fn is(&self, other: &Item) -> bool {
        self.kind == other.kind && self.name == other.name
    }

    /// What `analyze` leaves behind, which the keeper of a database may have run.
    fn is_statistics(&self) -> bool {
        let made = match self.name.as_str() {
            "sqlite_stat1" => "create table sqlite_stat1(tbl,idx,stat)",
            "sqlite_stat4" => "create table sqlite_stat4(tbl,idx,neq,nlt,ndlt,sample)",
            _ => return false,
        };
        self.kind == "table" && self.table == self.name && self.words == words(made)
    }

    fn told(&self) -> String {
        format!("the {} {:?}", self.kind, self.name)
    }
}

/// Everything that a database is made of. Nothing of it is run by this.
pub(super) async fn of(db: &mut SqliteConnection) -> Result<Vec<Item>, StoreError> {
    let query = sqlx::query("select type, name, tbl_name, coalesce(sql, '') from sqlite_schema");
    let rows = query.fetch_all(db).await?;
    let items = rows.iter().map(|row| {
        let sql: String = row.try_get(3)?;
        let (kind, name, table) = (row.try_get(0)?, row.try_get(1)?, row.try_get(2)?);
        Ok(Item { kind, name, table, words: words(&sql) })
    });
    items.filter(|item| !item.as_ref().is_ok_and(Item::is_statistics)).collect()
}

/// Whether this table is there, made as expected.
pub(super) fn has_as(found: &[Item], expected: &[Item], table: &str) -> bool {
    let of = |items: &[Item]| -> Vec<Item> {
        items.iter().filter(|item| item.name.eq_ignore_ascii_case(table)).cloned().collect()
    };
    !of(expected).is_empty() && of(found) == of(expected)
}

/// In what a database differs from what is expected, in a sentence; nothing, when it does not.
pub(super) fn difference(expected: &[Item], found: &[Item]) -> Option<String> {
    let mut foreign = found.to_vec();
    let mut missing = expected.to_vec();
    missing.retain(|item| match foreign.iter().position(|other| other == item) {
        Some(at) => {
            foreign.swap_remove(at);
            false
        }
        None => true,
    });
    let mut told = Vec::new();
    for item in &foreign {
        let altered = missing.iter().position(|other| other.is(item));
        told.push(match altered {
            Some(at) => {
                missing.swap_remove(at);
                format!("{} is not as Lodestep makes it", item.told())
            }
            None => format!("{} is not Lodestep's", item.told()),
        });
    }
    told.extend(missing.iter().map(|item| format!("{} is missing", item.told())));
    told.sort();
    let more = told.len().saturating_sub(NAMED);
    told.truncate(NAMED);
    if more > 0 {
        told.push(format!("{more} more"));
    }
    (!told.is_empty()).then(|| told.join(", "))
}

/// The words of a statement, as SQLite reads them: without comments and spaces, with small letters but in quotes.
fn words(sql: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = sql;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            ' ' | '\t' | '\n' | '\x0c' | '\r' => {
                rest = &rest[1..];
                continue;
            }
            '-' if rest.starts_with("--") => {
                rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
                continue;
            }
            '/' if rest.starts_with("/*") => {
                rest = &rest[rest[2..].find("*/").map_or(rest.len(), |at| at + 4)..];
                continue;
            }
            '\'' | '"' | '`' => quoted(rest, first),
            '[' => rest.find(']').map_or(rest.len(), |at| at + 1),
            _ if is_of_a_word(first) => rest.find(|c| !is_of_a_word(c)).unwrap_or(rest.len()),
            _ => first.len_utf8(),
        };
        let (word, after) = rest.split_at(length);
        words.push(if is_of_a_word(first) { word.to_ascii_lowercase() } else { word.to_owned() });
        rest = after;
    }
    words
}

fn is_of_a_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '$' || !c.is_ascii()
}

/// How long a text in quotes is, both of them counted; a doubled one stands for itself.
fn quoted(text: &str, quote: char) -> usize {
    let mut letters = text.char_indices().skip(1).peekable();
    while let Some((at, letter)) = letters.next() {
        if letter != quote {
            continue;
        }
        if letters.peek().is_some_and(|(_, next)| *next == quote) {
            letters.next();
        } else {
            return at + 1;
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(name: &str, sql: &str) -> Item {
        Item { kind: "table".into(), name: name.into(), table: name.into(), words: words(sql) }
    }

    #[test]
    fn spaces_comments_and_capitals_do_not_count_and_what_is_in_quotes_does() {
        let plain = words("create table a (b text not null default 'X -- y')");
        let other = "CREATE  TABLE a( /* of ' a */ b\n\tTEXT -- the \"b\"\r\nNOT NULL DEFAULT 'X -- y' )";
        assert_eq!(words(other), plain);
        assert_ne!(words("create table a (b text not null default 'x -- y')"), plain);
        assert_eq!(words("'it''s' \"a\"\"b\" [c d] `e`"), ["'it''s'", "\"a\"\"b\"", "[c d]", "`e`"]);
    }

    #[test]
    fn a_comment_that_hides_a_column_is_not_taken_for_the_column() {
        assert_ne!(words("create table a (b text -- , c text\n)"), words("create table a (b text, c text)"));
        assert_ne!(words("create table a (b text /* , c text */)"), words("create table a (b text, c text)"));
        // What has no end goes to the end of the text.
        for open in ["'a b", "\"a b", "[a b"] {
            assert_eq!(words(open), [open]);
        }
        assert!(words("/* a b").is_empty() && words("-- a b").is_empty() && words("/*/").is_empty());
    }

    #[test]
    fn each_difference_is_named() {
        let expected = [table("a", "create table a (b)"), table("c", "create table c (d)")];
        assert_eq!(difference(&expected, &expected), None);
        let told = |found: &[Item]| difference(&expected, found).unwrap();
        assert_eq!(told(&expected[..1]), "the table \"c\" is missing");
        let altered = [table("a", "create table a (b, e)"), expected[1].clone()];
        assert_eq!(told(&altered), "the table \"a\" is not as Lodestep makes it");
        let twice = [expected[0].clone(), expected[0].clone(), expected[1].clone()];
        assert_eq!(told(&twice), "the table \"a\" is not Lodestep's");
        let many: Vec<Item> =
            ('m'..='q').map(|name| table(&name.to_string(), "create table x (y)")).collect();
        let told = told(&[&expected[..], &many].concat());
        assert!(told.ends_with("the table \"o\" is not Lodestep's, 2 more"), "{told}");
    }

    #[test]
    fn what_analyze_leaves_is_nothing_foreign_unless_it_only_bears_that_name() {
        assert!(table("sqlite_stat1", "CREATE TABLE sqlite_stat1(tbl,idx,stat)").is_statistics());
        assert!(
            !table("sqlite_stat1", "create trigger x after insert on sessions begin end").is_statistics()
        );
        assert!(!table("sqlite_stat2", "CREATE TABLE sqlite_stat1(tbl,idx,stat)").is_statistics());
    }
}

//! Statements that write many rows at once, in few shapes, so that each shape is prepared once.

use sqlx::AssertSqlSafe;
use sqlx::query::Query;

use super::dialect::{Arguments, Database};

/// A statement on its way to be bound.
pub(super) type Statement = Query<'static, Database, Arguments>;

/// Cuts rows into pieces of `most`, then of a quarter of it, and so on to one: few sizes, whatever the number.
pub(super) fn shapes<T>(rows: &[T], most: usize) -> impl Iterator<Item = &[T]> {
    let mut rest = rows;
    let mut size = most;
    std::iter::from_fn(move || {
        while size > rest.len() {
            size = if size < 4 { size - 1 } else { size / 4 };
        }
        if rest.is_empty() {
            return None;
        }
        let (piece, later) = rest.split_at(size);
        rest = later;
        Some(piece)
    })
}

/// `(?, ?, …), (?, ?, …), …`: one group a row, each parameter as [`placeholder`] writes it.
pub(super) fn placeholders(rows: usize, columns: usize) -> String {
    let group = |row: usize| {
        let of_row: Vec<String> = (1..=columns).map(|column| placeholder(row * columns + column)).collect();
        format!("({})", of_row.join(", "))
    };
    (0..rows).map(group).collect::<Vec<_>>().join(", ")
}

/// The parameter of this number, in a statement that has all of them in order. On SQLite without the number, for what a number
/// names is looked up in a list at each binding, which for thousands of them takes longer than all else.
#[cfg(not(feature = "cluster"))]
pub(super) fn placeholder(_number: usize) -> String {
    "?".to_owned()
}

#[cfg(feature = "cluster")]
pub(super) fn placeholder(number: usize) -> String {
    format!("${number}")
}

/// A statement of a shape that comes again. `sql` holds nothing that came from outside: it is made of this
/// program's words and of parameters.
pub(super) fn shaped(sql: String) -> Statement {
    sqlx::query(AssertSqlSafe(sql)).persistent(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_cut_into_few_sizes_and_none_is_left_out() {
        let rows: Vec<u32> = (0..1_000).collect();
        for count in [0, 1, 2, 3, 4, 5, 15, 16, 63, 64, 65, 257, 1_000] {
            let pieces: Vec<&[u32]> = shapes(&rows[..count], 64).collect();
            assert_eq!(pieces.concat(), rows[..count]);
            assert!(pieces.iter().all(|piece| [1, 4, 16, 64].contains(&piece.len())), "{count}: {pieces:?}");
        }
    }
}

//! The names by which the store calls its database. The statements are written once, in what SQLite and PostgreSQL share.

pub use sqlx::sqlite::{SqliteArguments as Arguments, SqliteRow as Row};
pub use sqlx::{
    Sqlite as Database, SqliteConnection as Connection, SqliteExecutor as Executor, SqlitePool as Pool,
};

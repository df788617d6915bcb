//! The names by which the store calls its database, and the words that SQLite and PostgreSQL do not share. The statements are
//! written once; which database they are for is chosen when the program is built (docs/cluster.md).

#[cfg(not(feature = "cluster"))]
mod chosen {
    pub use sqlx::sqlite::{
        SqliteArguments as Arguments, SqliteConnectOptions as ConnectOptions, SqliteRow as Row,
    };
    pub use sqlx::{
        Sqlite as Database, SqliteConnection as Connection, SqliteExecutor as Executor, SqlitePool as Pool,
    };

    /// How a group of writes begins: no other program can write from then on.
    pub(in crate::store) const BEGIN: &str = "begin immediate";

    /// Compares without regard to the case of the letters A to Z.
    macro_rules! like {
        () => {
            "like"
        };
    }
    pub(in crate::store) use like;
}

#[cfg(feature = "cluster")]
mod chosen {
    pub use sqlx::postgres::{PgArguments as Arguments, PgConnectOptions as ConnectOptions, PgRow as Row};
    pub use sqlx::{
        PgConnection as Connection, PgExecutor as Executor, PgPool as Pool, Postgres as Database,
    };

    /// How a group of writes begins.
    pub(in crate::store) const BEGIN: &str = "begin";

    /// Compares without regard to the case of letters; of A to Z alone, for the database has the collation C.
    macro_rules! like {
        () => {
            "ilike"
        };
    }
    pub(in crate::store) use like;
}

pub use chosen::{Arguments, ConnectOptions, Connection, Database, Executor, Pool, Row};
pub(super) use chosen::{BEGIN, like};

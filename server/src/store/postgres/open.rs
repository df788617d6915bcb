//! The database on PostgreSQL: where it is, and how connections to it are made.

use std::path::Path;
use std::str::FromStr;

use sha2::{Digest, Sha256};
use sqlx::{AssertSqlSafe, ConnectOptions as _, Connection as _};

use super::StoreError;
use super::dialect::{ConnectOptions, Pool};
use super::writer::Writer;

/// Where tests have their databases: each data folder has a schema of its own there.
const FOR_TESTS: &str = "LODESTEP_TEST_POSTGRES";

/// Opens the database at this address (`postgres://…`) for reading and for writing.
pub(super) async fn open(address: &Path, readers: u32) -> Result<(Pool, Writer), StoreError> {
    let options = options(address).await?.application_name("lodestep");
    let writer = Writer::start(options.clone()).await?;
    let readers = sqlx::postgres::PgPoolOptions::new()
        .max_connections(readers.max(1))
        // Lazily: the writer has just shown that the database answers.
        .connect_lazy_with(options.options([("default_transaction_read_only", "on")]));
    Ok((readers, writer))
}

/// How connections to the database at this address are made.
pub(super) async fn options(address: &Path) -> Result<ConnectOptions, StoreError> {
    let given = address.to_string_lossy();
    if given.starts_with("postgres://") || given.starts_with("postgresql://") {
        return ConnectOptions::from_str(&given).map_err(|error| {
            StoreError::Open(format!(
                "expected an address such as postgres://lodestep@10.0.0.5/lodestep, found one that cannot be read: {error}"
            ))
        });
    }
    match std::env::var(FOR_TESTS) {
        Ok(server) => of_folder(&server, address).await,
        Err(_) => Err(StoreError::Open(
            "expected the address of its database, for this program keeps everything in PostgreSQL: give it with --database postgres://USER@HOST/NAME or LODESTEP_DATABASE".to_owned(),
        )),
    }
}

/// A schema for this folder alone, made when it is missing.
async fn of_folder(server: &str, folder: &Path) -> Result<ConnectOptions, StoreError> {
    let hash = Sha256::digest(folder.as_os_str().as_encoded_bytes());
    let schema: String = hash[..10].iter().map(|byte| format!("{byte:02x}")).collect();
    let schema = format!("t_{schema}");
    let options = ConnectOptions::from_str(server)?;
    let mut connection = options.connect().await?;
    // The name is made of hexadecimal digits.
    let make = AssertSqlSafe(format!("create schema if not exists {schema}"));
    sqlx::query(make).execute(&mut connection).await?;
    connection.close().await?;
    Ok(options.options([("search_path", schema.as_str())]))
}

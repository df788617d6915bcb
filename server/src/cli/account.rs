//! `lodestep account`: accounts made at the machine itself, for who cannot sign in: before the first start on an
//! address that is not loopback, or when an administrator's password is lost.

use std::io::{BufRead as _, IsTerminal as _, Write as _};
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow, ensure};
use clap::{Args, Subcommand, ValueEnum};
use uuid::Uuid;

use super::print::print;
use crate::auth::{Caller, Password, checked_name};
use crate::data_folder::{self, DATABASE};
use crate::rights::Role;
use crate::store::accounts::{self, Account};
use crate::store::{Store, StoreError, audit, sign_ins};
use crate::utc;

/// The arguments of `lodestep account`.
#[derive(Debug, Args)]
pub(super) struct AccountArgs {
    /// Folder of the server's database.
    #[arg(long, env = "LODESTEP_DATA", value_name = "FOLDER", default_value = "data", global = true)]
    data: PathBuf,
    /// Address of the PostgreSQL database.
    #[cfg(feature = "cluster")]
    #[arg(long, env = "LODESTEP_DATABASE", value_name = "ADDRESS", hide_env_values = true, global = true)]
    database: Option<String>,
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Adds one; its password is read from standard input
    Add {
        /// What its owner signs in with
        name: String,
        /// What its owner may do
        #[arg(long, value_enum)]
        role: RoleWord,
    },
    /// Sets a new password, read from standard input; all sign-ins of the account end
    Password {
        /// Whose
        name: String,
    },
    /// Lists them
    List,
}

/// A role, as it is typed.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum RoleWord {
    Viewer,
    Inspector,
    Dispatcher,
    Surveyor,
    Engineer,
    Admin,
}

impl From<RoleWord> for Role {
    fn from(word: RoleWord) -> Role {
        match word {
            RoleWord::Viewer => Role::Viewer,
            RoleWord::Inspector => Role::Inspector,
            RoleWord::Dispatcher => Role::Dispatcher,
            RoleWord::Surveyor => Role::Surveyor,
            RoleWord::Engineer => Role::Engineer,
            RoleWord::Admin => Role::Admin,
        }
    }
}

/// Does it, on a store that no server holds.
pub(super) fn account(args: AccountArgs) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    runtime.block_on(async {
        let _held = data_folder::hold_for_its_database(&args.data)?;
        let database = args.data.join(DATABASE);
        #[cfg(feature = "cluster")]
        let database = args.database.map_or(database, PathBuf::from);
        let store = Store::open(&database, 1)
            .await
            .with_context(|| format!("could not open the database {}", database.display()))?;
        let done = match args.what {
            What::Add { name, role } => add(&store, &name, role.into()).await,
            What::Password { name } => set_password(&store, &name).await,
            What::List => list(&store).await,
        };
        store.close().await;
        done
    })
}

async fn add(store: &Store, name: &str, role: Role) -> Result<()> {
    let name = checked_name(name)?;
    let password = read_password()?;
    password.checked(&name)?;
    let now = utc::now();
    let account = Account {
        id: Uuid::now_v7(),
        name: name.clone(),
        role,
        password_hash: password.hash().await?,
        inspector_id: None,
        disabled: false,
        expires_at: None,
        created_at: now,
        updated_at: now,
    };
    if let Some(alike) = accounts::look_alike(store.read(), &name, None).await?
        && accounts::name_key(&alike.name) != accounts::name_key(&name)
    {
        return Err(anyhow!(
            "there is already an account {:?}, which looks like {name:?}: choose a name that people can tell from it",
            alike.name
        ));
    }
    let entry = at_the_machine().did("account.added", account.id, None, serde_json::to_value(&account).ok());
    let added = store.writer().run(move |db| {
        Box::pin(async move {
            accounts::insert(&mut *db, &account).await?;
            audit::insert(db, &entry).await
        })
    });
    added.await.map_err(|error: StoreError| match error.is_duplicate() {
        true => anyhow!("there is already an account {name:?}: choose another name"),
        false => error.into(),
    })?;
    print(&format!("added {name}\n"))
}

async fn set_password(store: &Store, name: &str) -> Result<()> {
    let account = accounts::by_name(store.read(), name).await?;
    let account =
        account.ok_or_else(|| anyhow!("there is no account {name:?}: see `lodestep account list`"))?;
    let password = read_password()?;
    password.checked(&account.name)?;
    let account =
        Account { password_hash: password.hash().await?, disabled: false, updated_at: utc::now(), ..account };
    let entry = at_the_machine().did("account.password_set", account.id, None, None);
    let set = store.writer().run(move |db| {
        Box::pin(async move {
            accounts::update(&mut *db, &account).await?;
            sign_ins::delete_others(&mut *db, account.id, None).await?;
            audit::insert(db, &entry).await
        })
    });
    set.await.map_err(|error: StoreError| anyhow!(error))?;
    print(&format!("set a new password for {name}\n"))
}

async fn list(store: &Store) -> Result<()> {
    for account in accounts::list(store.read()).await? {
        let state = if account.disabled { " (disabled)" } else { "" };
        let role = serde_json::to_value(account.role)?;
        print(&format!("{}  {}{state}\n", account.name, role.as_str().unwrap_or_default()))?;
    }
    Ok(())
}

fn at_the_machine() -> Caller {
    Caller::itself("the command line")
}

/// One line of standard input; asked for, where somebody sits there.
fn read_password() -> Result<Password> {
    if std::io::stdin().is_terminal() {
        write!(std::io::stderr(), "Password (it shows as it is typed): ")?;
    }
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line).context("could not read the password")?;
    let line = line.trim_end_matches(['\n', '\r']);
    ensure!(!line.is_empty(), "expected a password on standard input, found none");
    Ok(serde_json::from_value(line.into())?)
}

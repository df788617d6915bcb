-- Who may do what: accounts of people, where they are signed in, tokens of devices and scripts, and who changed what.

create table accounts (
    id             text    not null primary key,
    name           text    not null,               -- what its owner signs in with, as it was typed
    name_key       text    not null unique,        -- the same in lower case: two names that differ by case are one
    role           text    not null check (role in ('viewer', 'inspector', 'dispatcher', 'surveyor', 'engineer', 'admin')),
    password_hash  text    not null,               -- argon2id, as a PHC string with its salt and cost
    inspector_id   text    references inspectors (id) on delete set null, -- whose walks its owner may write, where the role is inspector
    disabled       integer not null default 0,     -- 1: its owner cannot sign in, and what was open is cut
    expires_at     integer,                        -- UTC µs; null: it does not expire
    created_at     integer not null,               -- UTC µs
    updated_at     integer not null                -- UTC µs of the last change
) strict;

-- A browser in which somebody has signed in. The cookie's secret is not kept, only its hash.
create table sign_ins (
    id            text    not null primary key,
    account_id    text    not null references accounts (id) on delete cascade,
    secret_sha256 blob    not null unique,
    address       text    not null,                -- from where, as the server or its proxy saw it
    agent         text    not null default '',     -- what the browser calls itself
    created_at    integer not null,                -- UTC µs
    seen_at       integer not null,                -- UTC µs, to a minute or so
    expires_at    integer not null                 -- UTC µs
) strict;
create index sign_ins_by_account on sign_ins (account_id);

-- A bearer token of a device or a script. Its secret was shown once; only its hash is kept.
create table tokens (
    id            text    not null primary key,
    account_id    text    not null references accounts (id) on delete cascade, -- who made it; it may never do more than its owner
    name          text    not null,                -- what it is for
    secret_sha256 blob    not null unique,
    rights        text    not null,                -- JSON list of words such as read and walk
    inspector_id  text    references inspectors (id) on delete cascade, -- the one inspector whose walks it may write; null: those of its owner's rights
    created_at    integer not null,                -- UTC µs
    expires_at    integer,                         -- UTC µs; null: it does not expire
    used_at       integer,                         -- UTC µs of its last use, to a minute or so; null: never
    revoked_at    integer                          -- UTC µs; null while it is good
) strict;
create index tokens_by_account on tokens (account_id);

-- Every change, by whom and when, with what was there before and after. Rows are only ever added.
create table audit (
    id         integer not null primary key,       -- counts up
    at         integer not null,                   -- UTC µs
    account_id text,                               -- who; no foreign key, for the log outlives the account
    who        text    not null,                   -- the account's name then, with its token's, or what else acted
    address    text    not null default '',        -- from where
    action     text    not null,                   -- such as marker.moved
    subject    text    not null,                   -- the id or name of what was changed
    before     text,                               -- JSON; null where there was nothing
    after      text                                -- JSON; null where nothing is left
) strict;
create index audit_by_subject on audit (subject, id);

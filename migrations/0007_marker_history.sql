-- Every change of a marker is kept, and every file of markers with what it changed, so that it can be undone.

-- The table's revision at which the marker last changed. Who changes a marker names the version that he saw; as a
-- revision never comes twice, a marker that was removed and added anew is not taken for the old one.
alter table markers add column version integer not null default 0;
update markers set version = (select revision from marker_revision where only = 1);

-- A file of markers on its way into the table: compared, then applied, then perhaps reverted.
create table marker_imports (
    id                 text    not null primary key,
    state              text    not null check (state in ('compared', 'applied', 'reverted')),
    file_name          text,                -- as the sender calls it; shown, never used as a path
    file               blob    not null,    -- the bytes as they were sent
    plan               text    not null,    -- JSON: columns, mapping, findings and the exact difference
    whole_table        integer not null,    -- whether markers that the file does not name are removed
    added              integer not null,    -- how many markers were not there
    changed            integer not null,    -- how many stand elsewhere
    removed            integer not null,    -- how many the file lacks
    unchanged          integer not null,    -- how many stand there already
    compared_revision  integer not null,    -- the revision of the table that it was compared with
    applied_revision   integer,             -- the revision that it made; null before, or where it changed nothing
    reverted_revision  integer,             -- the revision that its revert made
    reason             text    not null default '',  -- why, as whoever applied it said
    created_at         integer not null,    -- UTC µs
    created_by         text,                -- who; null where nobody had to sign in
    applied_at         integer,             -- UTC µs; null before
    applied_by         text,
    reverted_at        integer,             -- UTC µs; null before
    reverted_by        text
) strict;
create index marker_imports_by_time on marker_imports (created_at);

-- The history of each marker: what it was and what it became. Never changed.
create table marker_changes (
    id           integer not null primary key,  -- in the order in which they were made
    marker       text    not null,      -- its name; no foreign key, for it outlives the marker
    revision     integer not null,      -- of the table, after this change
    changed_at   integer not null,      -- UTC µs
    changed_by   text,                  -- who; null where nobody had to sign in
    reason       text    not null,      -- why, as whoever changed it said; may be empty
    import_id    text    references marker_imports (id),  -- the file that it came with, or whose revert it is
    is_revert    integer not null,      -- whether it takes back what the file changed
    before_e_m   real,                  -- where it stood; null: there was none
    before_n_m   real,
    before_u_m   real,                  -- null: its height was not surveyed
    after_e_m    real,                  -- where it stands now; null: it was removed
    after_n_m    real,
    after_u_m    real
) strict;
create index marker_changes_by_marker on marker_changes (marker, id);
create index marker_changes_by_import on marker_changes (import_id);

-- Where the marker stood when a visit was weighed, so that its residual can be told against the survey of today.
-- Null: it was weighed before this was kept, or the marker was gone.
alter table visits add column marker_e_m real;
alter table visits add column marker_n_m real;
alter table visits add column marker_u_m real;
create index visits_by_marker on visits (marker);

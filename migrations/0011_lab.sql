-- Walks worked out with other parameters, to be compared; and where each result comes from.

-- Values for some parameters under a name.
create table parameter_sets (
    id          text    not null primary key,
    name        text    not null unique,         -- as it is shown
    about       text    not null default '',     -- what it is for; may be empty
    parameters  text    not null,                -- JSON: {"marker_sigma_m": 0.5, …}; only what differs from the default
    version     integer not null default 1,      -- counts its changes: who changes it names the one that was seen
    created_at  integer not null,                -- UTC µs
    created_by  text,                            -- who; null where nobody had to sign in
    updated_at  integer not null                 -- UTC µs of the last change
) strict;

-- A walk worked out once more, beside its own track, which it leaves as it is. Its job says how far it has come.
create table lab_runs (
    id                text    not null primary key,
    session_id        text    not null references sessions (id) on delete cascade,
    name              text    not null,     -- as it is shown: of its set of parameters, or as whoever asked for it said
    parameter_set_id  text    references parameter_sets (id) on delete set null,
    parameters        text    not null,     -- JSON as in parameter_sets: as they were when it was asked for
    aids              text,                 -- JSON list of words such as zupt and heading; null: all that the data allow
    solution          text    not null check (solution in ('filtered', 'smoothed')),
    created_at        integer not null,     -- UTC µs
    created_by        text,                 -- who; null where nobody had to sign in
    figures           text,                 -- JSON: what it came to; null until it has been computed
    provenance        text                  -- JSON: engine, parameters, hashes of what it was computed from and of its track; null likewise
) strict;
create index lab_runs_by_session on lab_runs (session_id, created_at);

-- The points of a lab run, in one piece: they are read whole and never searched.
create table lab_tracks (
    run_id    text    not null primary key references lab_runs (id) on delete cascade,
    points    integer not null,  -- how many, at the rate at which tracks are stored
    encoding  integer not null,  -- layout of the unpacked points: 1 = all values of a column, then of the next, little-endian:
                                 --   t_ns i64, then f64 × 17: as the columns of track_points; NaN for null, 0 and 1 for the stances
    body      blob    not null   -- the points in that layout, as one zstd frame
) strict;

-- The same of the main run; null for what was computed before this was kept.
alter table session_reports add column figures text;
alter table session_reports add column provenance text;

-- A job computes a session's own track or a lab run, and may be given up. SQLite changes no check in place, so the
-- table is written anew.
create table jobs_of_lab (
    id           text    not null primary key,
    session_id   text    not null references sessions (id) on delete cascade,
    lab_run_id   text    references lab_runs (id) on delete cascade,  -- null: it computes the session's own track
    state        text    not null check (state in ('queued', 'running', 'finished', 'failed', 'cancelled')),
    stage        text    not null default '',  -- what it is doing, a word such as filtering
    progress     real    not null default 0,   -- 0 to 1
    error        text,                         -- why it failed, in a sentence
    created_at   integer not null,             -- UTC µs
    started_at   integer,                      -- UTC µs; null while queued
    finished_at  integer                       -- UTC µs; null until it ended
) strict;
insert into jobs_of_lab (id, session_id, state, stage, progress, error, created_at, started_at, finished_at)
    select id, session_id, state, stage, progress, error, created_at, started_at, finished_at from jobs;
drop table jobs;
alter table jobs_of_lab rename to jobs;
create index jobs_by_state on jobs (state, created_at);
create unique index jobs_by_lab_run on jobs (lab_run_id) where lab_run_id is not null;

-- Walks (sessions), what they are made of (logs, raw samples), what came out of them (track points,
-- visits, anomalies), what the site has (markers), and what people found on it (faults).
--
-- Conventions, for every table:
--   * ids are UUIDs (version 7, so they sort by creation) as lower-case text with hyphens;
--   * `…_at` is an instant in UTC as integer microseconds since 1970-01-01T00:00:00Z;
--   * `t_…ns` is time since the session's start (its `started_at`) in integer nanoseconds;
--   * e, n, u are east, north, up in metres from the site's origin;
--   * `sigma_…` is one standard deviation, in the unit of what it belongs to;
--   * booleans are 0 or 1.
-- An applied migration is never edited: a change is a new file.

-- The people who walk.
create table inspectors (
    id          text    not null primary key,
    name        text    not null unique,        -- as it is shown; one person, one name
    created_at  integer not null                -- UTC µs
) strict;

-- One walk of one inspector, from the standing start to the end.
create table sessions (
    id                   text    not null primary key,
    inspector_id         text    not null references inspectors (id),
    title                text    not null default '',    -- free words; may be empty
    state                text    not null                -- how far it has come
        check (state in ('created', 'receiving', 'live', 'processing', 'finished', 'failed')),
    started_at           integer not null,               -- UTC µs of t_ns = 0
    ended_at             integer,                        -- UTC µs of its last point; null while it goes on
    feet                 text    not null                -- which feet carry a sensor
        check (feet in ('left', 'right', 'left,right')),
    start_marker         text,                           -- name of the marker it started at; null when coordinates were given
    start_e_m            real    not null,               -- where the middle of the feet stood at t_ns = 0, m
    start_n_m            real    not null,
    start_u_m            real    not null,
    initial_heading_deg  real,                           -- heading of the first sensor's x axis, clockwise from true north, degrees; null: found from the magnetometer
    samples              integer not null default 0,     -- IMU samples processed, both feet
    epochs               integer not null default 0,     -- epochs the engine told (the stored track may keep fewer)
    duration_s           real    not null default 0,     -- from the first to the last point, s
    distance_m           real    not null default 0,     -- length of the path of the middle of the feet, m
    since_marker_s       real    not null default 0,     -- since the last accepted visit (or the start), s
    since_marker_m       real    not null default 0,     -- walked since then, m
    track_sha256         text,                           -- hash over every epoch of the main run, lower-case hex: two runs with the same hash gave the same bits
    error                text,                           -- why it failed, in a sentence; null otherwise
    created_at           integer not null                -- UTC µs
) strict;
create index sessions_by_inspector on sessions (inspector_id, started_at);
create index sessions_by_state on sessions (state);

-- One foot's log file as it is handed in at the dock. The bytes on their way lie in a file beside the
-- database; once accepted, the samples are in `raw_chunks` and the file is gone.
create table logs (
    id            text    not null primary key,
    session_id    text    not null references sessions (id) on delete cascade,
    foot          text    not null check (foot in ('left', 'right')),
    state         text    not null           -- unchanged: the session already held these very bytes
        check (state in ('receiving', 'accepted', 'unchanged', 'failed')),
    file_name     text,                      -- as the sender calls it; shown, never used as a path
    offset_bytes  integer not null,          -- bytes received and on disk, as sent (compressed, when they are)
    size_bytes    integer,                   -- bytes announced; null when the sender did not say
    sha256        text,                      -- of the bytes as sent, lower-case hex; null until announced or finished
    codec         text                       -- how the bytes were packed; null until they were read
        check (codec in ('plain', 'gzip', 'zstd')),
    samples       integer not null default 0,-- samples found in it
    t_first_ns    integer,                   -- time of the first and last sample, ns
    t_last_ns     integer,
    error         text,                      -- why it failed, in a sentence
    created_at    integer not null,          -- UTC µs
    finished_at   integer                    -- UTC µs; null while receiving
) strict;
create index logs_by_session on logs (session_id, foot, created_at);
create unique index logs_accepted_once on logs (session_id, foot, sha256) where state = 'accepted';

-- The samples as they were measured: the truth that every track is computed from. Written once,
-- never changed, kept as long as the session.
create table raw_chunks (
    id              integer not null primary key,
    session_id      text    not null references sessions (id) on delete cascade,
    foot            text    not null check (foot in ('left', 'right')),
    log_id          text    references logs (id) on delete cascade, -- the log it came from; null: the live stream
    first_sequence  integer not null,    -- stream: number of its first batch; log: number of the chunk in the log
    sequences       integer not null,    -- how many batches (or chunks) it holds, at least 1
    t_first_ns      integer not null,    -- time of its first sample, ns
    samples         integer not null,    -- how many samples
    encoding        integer not null,    -- layout of the unpacked samples: 1 = 88 bytes each, little-endian:
                                         --   t_ns i64, then f64 × 10: gyr x y z rad/s, acc x y z m/s²,
                                         --   mag x y z µT, pressure hPa; NaN for a missing mag or pressure
    body            blob    not null     -- the samples in that layout, as one zstd frame
) strict;
create unique index raw_chunks_of_stream on raw_chunks (session_id, foot, first_sequence) where log_id is null;
create unique index raw_chunks_of_log on raw_chunks (log_id, first_sequence) where log_id is not null;

-- Where the inspector was. Points may be revised in hindsight: then the row is replaced, the newest
-- knowledge stands here. At most `track_rate_hz` rows a second (10 by default), a subset of the epochs.
create table track_points (
    session_id         text    not null references sessions (id) on delete cascade,
    run                text    not null check (run in ('main', 'without_markers')), -- with every aid; or the same walk with no visit used
    t_ns               integer not null,
    e_m                real    not null,   -- the middle of the feet (the one foot, when there is one)
    n_m                real    not null,
    u_m                real    not null,
    heading_rad        real    not null,   -- clockwise from true north, in (−π, π]
    sigma_heading_rad  real    not null,
    sigma_e_m          real    not null,
    sigma_n_m          real    not null,
    sigma_u_m          real    not null,
    covariance_en_m2   real    not null,   -- of east and north, m²
    left_e_m           real,               -- the left sensor; null when that foot carries none
    left_n_m           real,
    left_u_m           real,
    right_e_m          real,               -- the right sensor; null when that foot carries none
    right_n_m          real,
    right_u_m          real,
    left_stance        integer,            -- whether that foot stands; null with its position
    right_stance       integer,
    primary key (session_id, run, t_ns)
) strict, without rowid;

-- An inspector stood at a marker: what was said, and what the filter made of it.
create table visits (
    id              text    not null primary key,
    session_id      text    not null references sessions (id) on delete cascade,
    marker          text    not null,      -- its name at that time; no foreign key, for a marker may be renamed later
    t_start_ns      integer not null,      -- when the inspector arrived
    t_end_ns        integer not null,      -- when the inspector left
    created_at      integer not null,      -- UTC µs
    -- The outcome; null until a run has weighed it.
    t_applied_ns    integer,               -- the moment at which it was applied
    accepted        integer,               -- whether it was used
    nis             real,                  -- normalised innovation squared
    degrees_of_freedom integer,            -- axes measured: 2 where the marker has no height
    before_e_m      real,                  -- position before the correction minus the marker's, m
    before_n_m      real,
    before_u_m      real,
    after_e_m       real,                  -- position after the correction minus the marker's, m
    after_n_m       real,
    after_u_m       real,
    reason          text,                  -- why it was not used, in a sentence; empty when it was
    unique (session_id, marker, t_start_ns)
) strict;
create index visits_by_session on visits (session_id, t_start_ns);

-- Trouble with a sensor or its data, found while the main run was computed.
create table anomalies (
    id          integer not null primary key,
    session_id  text    not null references sessions (id) on delete cascade,
    kind        text    not null,          -- the engine's word for it, such as gap or saturation
    foot        text    check (foot in ('left', 'right')), -- null when it concerns the session
    t_start_ns  integer not null,
    t_end_ns    integer not null,
    samples     integer not null,          -- how many samples it concerns
    detail      text    not null           -- expected and found, in a sentence with units
) strict;
create index anomalies_by_session on anomalies (session_id, t_start_ns);

-- Surveyed actuator anchors: the fixed points that a walk is tied to.
create table markers (
    name        text    not null primary key,   -- such as A17; case matters
    e_m         real    not null,
    n_m         real    not null,
    u_m         real,                            -- null: its height was never surveyed
    created_at  integer not null,                -- UTC µs
    updated_at  integer not null                 -- UTC µs of the last change of a coordinate
) strict;

-- Counts the changes of the marker table, so that a page knows when to fetch it again. One row.
create table marker_revision (
    only      integer not null primary key check (only = 1),
    revision  integer not null
) strict;
insert into marker_revision (only, revision) values (1, 0);

-- A finding on equipment, placed by where its inspector was at that time.
create table faults (
    id                text    not null primary key,
    inspector_id      text    not null references inspectors (id),
    session_id        text    references sessions (id) on delete set null, -- the walk it was found on, where there is one
    reported_at       integer not null,    -- UTC µs: when the inspector saw it
    t_ns              integer,             -- the same moment on the session's clock
    kind              text    not null,    -- what is wrong, a word such as hydraulic_leak
    severity          text    not null check (severity in ('low', 'medium', 'high')),
    text              text    not null default '',  -- what the inspector wrote
    marker            text,                -- the actuator the inspector named; null when not said
    e_m               real,                -- the inspector's position then; null when it is not known
    n_m               real,
    u_m               real,
    sigma_e_m         real,
    sigma_n_m         real,
    sigma_u_m         real,
    covariance_en_m2  real,
    candidates        text    not null default '[]', -- JSON: [{"marker":"A17","probability":0.81,"distance_m":3.2}, …], likeliest first; marker null is "none of them"
    state             text    not null default 'open' check (state in ('open', 'closed')),
    closed_at         integer,             -- UTC µs; null while open
    created_at        integer not null     -- UTC µs
) strict;
create index faults_by_state on faults (state, reported_at);

-- Work on a stored session that takes a while: one row for each run.
create table jobs (
    id           text    not null primary key,
    session_id   text    not null references sessions (id) on delete cascade,
    state        text    not null check (state in ('queued', 'running', 'finished', 'failed')),
    stage        text    not null default '',  -- what it is doing, a word such as filtering
    progress     real    not null default 0,   -- 0 to 1
    error        text,                         -- why it failed, in a sentence
    created_at   integer not null,             -- UTC µs
    started_at   integer,                      -- UTC µs; null while queued
    finished_at  integer                       -- UTC µs; null until it ended
) strict;
create index jobs_by_state on jobs (state, created_at);

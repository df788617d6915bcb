-- The tables of the newest step, written by a test from the steps beside it. Read it; never run or edit it. Anew:
--
--   LODESTEP_WRITE_SCHEMA=1 cargo test -p lodestep --lib schema_tests
--
-- Ids, instants, times and positions are in the units that the head of 0001_walks_and_findings.sql lays down.

-- Who may do what: accounts of people, where they are signed in, tokens of devices and scripts, and who changed what.
create table accounts (
    id text not null primary key,
    name text not null,                   -- what its owner signs in with, as it was typed
    name_key text not null unique,        -- the same in lower case: two names that differ by case are one
    role text not null check (role in ('viewer', 'inspector', 'dispatcher', 'surveyor', 'engineer', 'admin')),
    password_hash text not null,          -- argon2id, as a PHC string with its salt and cost
    -- whose walks its owner may write, where the role is inspector
    inspector_id text references carriers (id) on delete set null,
    disabled integer not null default 0,  -- 1: its owner cannot sign in, and what was open is cut
    expires_at integer,                   -- UTC µs; null: it does not expire
    created_at integer not null,          -- UTC µs
    updated_at integer not null           -- UTC µs of the last change
) strict;

-- Alarms of the live page stay until somebody has acknowledged them, for everybody who looks.
create table alarm_acknowledgements (
    -- what the alarm is about: its kind, its subject, and when it began where it can come again
    key text not null primary key,
    acknowledged_at integer not null,  -- UTC µs
    acknowledged_by text not null      -- who, as the log of changes has it
) strict, without rowid;

-- The server itself watches for alarms: what stands, so that a restart raises nothing twice, and what stood.
create table alarms (
    key text not null primary key,  -- as in alarm_acknowledgements: the same thing that comes again has another key
    kind text not null check (kind in ('lost', 'standing', 'fault')),
    session_id text,                -- the walk it is about; null where it is about none
    carrier_id text,                -- who walks, or reported the fault; null where nobody is known
    fault_id text,                  -- the fault it is about; null where it is about none
    since integer not null,         -- UTC µs since when it has been so: the last word, the last step, the report
    raised_at integer not null,     -- UTC µs
    ended_at integer                -- UTC µs when it was so no longer; null while it is
) strict, without rowid;
create index alarms_standing on alarms (key) where ended_at is null;

-- Trouble with a sensor or its data, found while the main run was computed.
create table anomalies (
    id integer not null primary key,
    session_id text not null references sessions (id) on delete cascade,
    kind text not null,                -- the engine's word for it, such as gap or saturation
    stream text,                       -- null when it concerns the session
    t_start_ns integer not null,
    t_end_ns integer not null,
    samples integer not null,          -- how many samples it concerns
    detail text not null,              -- expected and found, in a sentence with units
    -- The figures of `detail`, JSON by name, the unit at its end; null for what was found before they were kept.
    figures text,
    times integer not null default 1   -- how many were gathered into this row
) strict;
create index anomalies_by_session on anomalies (session_id, t_start_ns);

-- Every change, by whom and when, with what was there before and after. Rows are only ever added.
create table audit (
    id integer not null primary key,   -- counts up
    at integer not null,               -- UTC µs
    account_id text,                   -- who; no foreign key, for the log outlives the account
    who text not null,                 -- the account's name then, with its token's, or what else acted
    address text not null default '',  -- from where
    action text not null,              -- such as marker.moved
    subject text not null,             -- the id or name of what was changed
    before text,                       -- JSON; null where there was nothing
    after text                         -- JSON; null where nothing is left
) strict;
create index audit_by_subject on audit (subject, id);

-- What is positioned: a person, an instrument. A person is what the page calls an inspector.
create table carriers (
    id text not null primary key,
    name text not null unique,            -- as it is shown; one person, one name
    created_at integer not null,          -- UTC µs
    kind text not null default 'person'   -- person, instrument, …: as the system declares it
) strict;

-- How the clock by which a walk's markers were keyed in stands to that of its logs.
create table clock_ties (
    session_id text not null primary key references sessions (id) on delete cascade,
    state text not null,       -- 'same', 'tied', 'ambiguous', 'unmatched', 'too_few', or 'given' by somebody
    offset_s real not null,    -- the log's time less the keyed one, s; 0 where it is not known
    sigma_s real,              -- its sigma, s; null where it was not measured
    keyed integer not null,    -- visits that were keyed in
    matched integer not null,  -- of these, those that fall on a stand of the log where the track agrees
    tied_at integer not null   -- UTC µs
) strict, without rowid;

-- The history of each fault, a row for each thing that changed. Never changed.
create table fault_changes (
    id integer not null primary key,   -- in the order in which they were made
    fault_id text not null references faults (id) on delete cascade,
    changed_at integer not null,       -- UTC µs
    changed_by text,                   -- who; null where nobody had to sign in
    -- what changed; a comment changes nothing else
    what text not null check (what in ('state', 'assignee', 'severity', 'kind', 'text', 'marker', 'photo', 'comment', 'place')),
    before text,                       -- as a word, an id or a text; null: nothing
    after text,                        -- the same after it
    comment text not null default ''   -- what was said with it
) strict;
create index fault_changes_by_fault on fault_changes (fault_id, id);

-- Photos of a fault, as they were sent. In the database, so that a backup of it is whole.
create table fault_photos (
    id text not null primary key,
    fault_id text not null references faults (id) on delete cascade,
    content_type text not null check (content_type in ('image/jpeg', 'image/png', 'image/webp')),  -- by its first bytes
    size_bytes integer not null,
    sha256 text not null,          -- of the bytes, lower-case hex: the same photo is kept once
    created_at integer not null,   -- UTC µs
    created_by text,               -- who; null where nobody had to sign in
    body blob not null,
    unique (fault_id, sha256)
) strict;

-- A finding on equipment, placed by where its inspector was at that time.
create table faults (
    id text not null primary key,
    inspector_id text not null references carriers (id),
    session_id text references sessions (id) on delete set null,  -- the walk it was found on, where there is one
    reported_at integer not null,               -- UTC µs: when the inspector saw it
    t_ns integer,                               -- the same moment on the session's clock
    kind text not null,                         -- what is wrong, a word such as hydraulic_leak
    severity text not null check (severity in ('low', 'medium', 'high')),
    text text not null default '',              -- what is to be said of it
    marker text,                                -- the actuator that was named; null when not said
    e_m real,                                   -- the inspector's position at the report; null when it is not known
    n_m real,
    u_m real,
    sigma_e_m real,
    sigma_n_m real,
    sigma_u_m real,
    covariance_en_m2 real,
    -- JSON: [{"marker":"A17","probability":0.81,"distance_m":3.2}, …], likeliest first; marker null is "none of them"
    candidates text not null default '[]',
    state text not null default 'open' check (state in ('open', 'acknowledged', 'in_work', 'fixed', 'verified')),
    assignee_id text references carriers (id),  -- who is to see to it; null: nobody yet
    version integer not null default 1,         -- counts its changes: who changes it names the one that was seen
    closed_at integer,                          -- UTC µs when it was verified; null before
    created_at integer not null,                -- UTC µs
    updated_at integer not null                 -- UTC µs of the last change
) strict;
create index faults_by_assignee on faults (assignee_id, state);
create index faults_by_state on faults (state, reported_at);

-- Work on a stored session that takes a while: one row for each run.
create table jobs (
    id text not null primary key,
    session_id text not null references sessions (id) on delete cascade,
    lab_run_id text references lab_runs (id) on delete cascade,  -- null: it computes the session's own track
    state text not null check (state in ('queued', 'running', 'finished', 'failed', 'cancelled')),
    stage text not null default '',    -- what it is doing, a word such as filtering
    progress real not null default 0,  -- 0 to 1
    error text,                        -- why it failed, in a sentence
    created_at integer not null,       -- UTC µs
    started_at integer,                -- UTC µs; null while queued
    finished_at integer,               -- UTC µs; null until it ended
    tries integer not null default 0   -- how often it was begun and neither ended nor was asked to stop
) strict;
create unique index jobs_by_lab_run on jobs (lab_run_id) where lab_run_id is not null;
create index jobs_by_state on jobs (state, created_at);

-- A walk worked out once more, beside its own track, which it leaves as it is. Its job says how far it has come.
create table lab_runs (
    id text not null primary key,
    session_id text not null references sessions (id) on delete cascade,
    name text not null,            -- as it is shown: of its set of parameters, or as whoever asked for it said
    parameter_set_id text references parameter_sets (id) on delete set null,
    parameters text not null,      -- JSON as in parameter_sets: as they were when it was asked for
    aids text,                     -- JSON list of words such as zupt and heading; null: all that the data allow
    solution text not null check (solution in ('filtered', 'smoothed')),
    created_at integer not null,   -- UTC µs
    created_by text,               -- who; null where nobody had to sign in
    figures text,                  -- JSON: what it came to; null until it has been computed
    -- JSON: engine, parameters, hashes of what it was computed from and of its track; null likewise
    provenance text
) strict;
create index lab_runs_by_session on lab_runs (session_id, created_at);

-- The points of a lab run, in one piece: they are read whole and never searched.
create table lab_tracks (
    run_id text not null primary key references lab_runs (id) on delete cascade,
    points integer not null,    -- how many, at the rate at which tracks are stored
    -- layout of the unpacked points: 1 = all values of a column, then of the next, little-endian: t_ns i64, then f64 ×
    -- 17: as the columns of track_points; NaN for null, 0 and 1 for the stances
    encoding integer not null,
    body blob not null,         -- the points in that layout, as one zstd frame
    checksum integer            -- The same of the packed points of a lab run, and of what a chart is drawn from.
) strict;

create table live_states (
    id integer not null primary key,
    session_id text not null references sessions (id) on delete cascade,
    t_ns integer not null,            -- since when the state knows its past, ns
    fits text not null,               -- hash of the program that saved it and of how the session was configured
    samples integer not null,         -- taken before, of all streams
    next_sequences text not null,     -- JSON by stream: the batches that were not taken yet begin here
    body blob not null                -- for that program alone
) strict;
create unique index live_states_of_session on live_states (session_id, t_ns);

-- One foot's log file as it is handed in at the dock. The bytes on their way lie in a file beside the database; once
-- accepted, the samples are in `raw_chunks` and the file is gone.
create table logs (
    id text not null primary key,
    session_id text not null references sessions (id) on delete cascade,
    stream text not null,                -- The name of the stream, where there was a foot.
    -- unchanged: the session already held these very bytes
    state text not null check (state in ('receiving', 'accepted', 'unchanged', 'failed')),
    file_name text,                      -- as the sender calls it; shown, never used as a path
    offset_bytes integer not null,       -- bytes received and on disk, as sent (compressed, when they are)
    size_bytes integer,                  -- bytes announced; null when the sender did not say
    sha256 text,                         -- of the bytes as sent, lower-case hex; null until announced or finished
    codec text check (codec in ('plain', 'gzip', 'zstd')),  -- how the bytes were packed; null until they were read
    samples integer not null default 0,  -- samples found in it
    t_first_ns integer,                  -- time of the first and last sample, ns
    t_last_ns integer,
    error text,                          -- why it failed, in a sentence
    created_at integer not null,         -- UTC µs
    finished_at integer,                 -- UTC µs; null while receiving
    -- as the engine names it (canonical, x_io, …); null until it was read, and for logs from before
    format text,
    -- JSON of what was said of it (mapping, rate_hz, field_ut_per_count, clock_zero_ns); null: nothing
    reading text
) strict;
create unique index logs_accepted_once on logs (session_id, stream, sha256) where state = 'accepted';
create index logs_by_session on logs (session_id, stream, created_at);

-- Which column of a table is which channel, in which unit, under a name.
create table mappings (
    id text not null primary key,
    name text not null unique,     -- as it is shown
    mapping text not null,         -- JSON, as reading.mapping
    created_at integer not null,   -- UTC µs
    updated_at integer not null,   -- UTC µs
    created_by text references accounts (id) on delete set null  -- null: nobody that is known
) strict;

-- The history of each marker: what it was and what it became. Never changed.
create table marker_changes (
    id integer not null primary key,                -- in the order in which they were made
    marker text not null,                           -- its name; no foreign key, for it outlives the marker
    revision integer not null,                      -- of the table, after this change
    changed_at integer not null,                    -- UTC µs
    changed_by text,                                -- who; null where nobody had to sign in
    reason text not null,                           -- why, as whoever changed it said; may be empty
    import_id text references marker_imports (id),  -- the file that it came with, or whose revert it is
    is_revert integer not null,                     -- whether it takes back what the file changed
    before_e_m real,                                -- where it stood; null: there was none
    before_n_m real,
    before_u_m real,                                -- null: its height was not surveyed
    after_e_m real,                                 -- where it stands now; null: it was removed
    after_n_m real,
    after_u_m real
) strict;
create index marker_changes_by_import on marker_changes (import_id);
create index marker_changes_by_marker on marker_changes (marker, id);

-- A file of markers on its way into the table: compared, then applied, then perhaps reverted.
create table marker_imports (
    id text not null primary key,
    state text not null check (state in ('compared', 'applied', 'reverted')),
    file_name text,                      -- as the sender calls it; shown, never used as a path
    file blob not null,                  -- the bytes as they were sent
    plan text not null,                  -- JSON: columns, mapping, findings and the exact difference
    whole_table integer not null,        -- whether markers that the file does not name are removed
    added integer not null,              -- how many markers were not there
    changed integer not null,            -- how many stand elsewhere
    removed integer not null,            -- how many the file lacks
    unchanged integer not null,          -- how many stand there already
    compared_revision integer not null,  -- the revision of the table that it was compared with
    applied_revision integer,            -- the revision that it made; null before, or where it changed nothing
    reverted_revision integer,           -- the revision that its revert made
    reason text not null default '',     -- why, as whoever applied it said
    created_at integer not null,         -- UTC µs
    created_by text,                     -- who; null where nobody had to sign in
    applied_at integer,                  -- UTC µs; null before
    applied_by text,
    reverted_at integer,                 -- UTC µs; null before
    reverted_by text
) strict;
create index marker_imports_by_time on marker_imports (created_at);

-- Counts the changes of the marker table, so that a page knows when to fetch it again. One row.
create table marker_revision (
    only integer not null primary key check (only = 1),
    revision integer not null
) strict;

-- Surveyed actuator anchors: the fixed points that a walk is tied to.
create table markers (
    name text not null primary key,      -- such as A17; case matters
    e_m real not null,
    n_m real not null,
    u_m real,                            -- null: its height was never surveyed
    created_at integer not null,         -- UTC µs
    updated_at integer not null,         -- UTC µs of the last change of a coordinate
    -- The table's revision at which the marker last changed. Who changes a marker names the version that he saw; as a
    -- revision never comes twice, a marker that was removed and added anew is not taken for the old one.
    version integer not null default 0
) strict;

-- Values for some parameters under a name.
create table parameter_sets (
    id text not null primary key,
    name text not null unique,           -- as it is shown
    about text not null default '',      -- what it is for; may be empty
    parameters text not null,            -- JSON: {"marker_sigma_m": 0.5, …}; only what differs from the default
    version integer not null default 1,  -- counts its changes: who changes it names the one that was seen
    created_at integer not null,         -- UTC µs
    created_by text,                     -- who; null where nobody had to sign in
    updated_at integer not null          -- UTC µs of the last change
) strict;

-- The samples as they were measured: the truth that every track is computed from. Written once, never changed, kept as
-- long as the session.
create table raw_chunks (
    id integer not null primary key,
    session_id text not null references sessions (id) on delete cascade,
    stream text not null,
    log_id text references logs (id) on delete cascade,  -- the log it came from; null: the live stream
    first_sequence integer not null,  -- stream: number of its first batch; log: number of the chunk in the log
    sequences integer not null,       -- how many batches (or chunks) it holds, at least 1
    t_first_ns integer not null,      -- time of its first sample, ns
    samples integer not null,         -- how many samples
    -- layout of the unpacked samples: 1 = 88 bytes each, little-endian: t_ns i64, then f64 × 10: gyr x y z rad/s, acc x
    -- y z m/s², mag x y z µT, pressure hPa; NaN for a missing mag or pressure
    encoding integer not null,
    body blob not null,               -- the samples in that layout, as one zstd frame
    -- CRC-32 of a chunk's session, place and bytes, as store/checksum.rs lays them out; null for what was written
    -- before.
    checksum integer
) strict;

-- What hangs on a session is found without reading all samples there are.
create index raw_chunks_by_session on raw_chunks (session_id);
create unique index raw_chunks_of_log on raw_chunks (log_id, first_sequence) where log_id is not null;

-- What the charts of a processed session are drawn from: each series as the smallest and largest value in every cell of
-- a grid in time. Made again with the track; the samples themselves stay in `raw_chunks`.
create table session_charts (
    session_id text not null references sessions (id) on delete cascade,
    chart text not null,                      -- which chart draws it, such as gyro_norm
    series text not null,                     -- which line of the chart, such as left
    cell_ns integer not null,                 -- length of a cell, ns
    first_cell integer not null,              -- number of the first cell: that cell begins at first_cell × cell_ns
    cells integer not null,                   -- how many
    -- one zstd frame: the smallest value of every cell, then the largest of every cell, f32 little-endian; NaN where a
    -- cell has none
    body blob not null,
    checksum integer,
    primary key (session_id, chart, series)
) strict, without rowid;

-- How a walk went by what the filter itself saw, of the main run: replaced whenever that is.
create table session_reports (
    session_id text not null primary key references sessions (id) on delete cascade,
    -- JSON: aids with their innovations and bounds, what was turned down and why, closure, sigmas, stance
    report text not null,
    figures text,          -- The same of the main run; null for what was computed before this was kept.
    provenance text
) strict;

-- One walk of one inspector, from the standing start to the end.
create table sessions (
    id text not null primary key,
    carrier_id text not null references carriers (id),
    title text not null default '',                     -- free words; may be empty
    -- how far it has come
    state text not null check (state in ('created', 'receiving', 'live', 'processing', 'finished', 'failed')),
    started_at integer not null,                        -- UTC µs of t_ns = 0
    ended_at integer,                                   -- UTC µs of its last point; null while it goes on
    -- name of the marker it started at; null when coordinates were given
    start_marker text,
    start_e_m real not null,                            -- where the middle of the feet stood at t_ns = 0, m
    start_n_m real not null,
    start_u_m real not null,
    -- heading of the first sensor's x axis, clockwise from true north, degrees; null: found from the magnetometer
    initial_heading_deg real,
    samples integer not null default 0,                 -- IMU samples processed, both feet
    epochs integer not null default 0,                  -- epochs the engine told (the stored track may keep fewer)
    duration_s real not null default 0,                 -- from the first to the last point, s
    distance_m real not null default 0,                 -- length of the path of the middle of the feet, m
    since_marker_s real not null default 0,             -- since the last accepted visit (or the start), s
    since_marker_m real not null default 0,             -- walked since then, m
    -- hash over every epoch of the main run, lower-case hex: two runs with the same hash gave the same bits
    track_sha256 text,
    error text,                                         -- why it failed, in a sentence; null otherwise
    created_at integer not null,                        -- UTC µs
    automatic_visits integer not null default 0,        -- Whether a stand that is nearly certain is taken for a visit.
    starred integer not null default 0,                 -- 1: somebody marked it
    note text not null default '',                      -- what somebody wrote of it
    noted_by text,                                      -- who marked it or wrote that; null: nobody
    noted_at integer,                                   -- UTC µs; null likewise
    -- its samples, packed, as they were when they were accepted or the walk was finished
    stored_bytes integer not null default 0,
    -- What a session's stream is computed with for as long as it goes on, so that a server that is started again makes
    -- the same of it; null: the defaults. A job takes what holds when it runs.
    site_parameters_id integer references site_parameters (id),
    system text not null default 'pedestrian',          -- Which system computes the session.
    -- TOML, as the system documents it; null where the system takes none
    instrument text,
    shown_result text not null default '',              -- what the names of the runs that are shown end with: '' or '~'
    removed_at integer,                                 -- UTC µs; null while it is there
    excluded integer not null default 0,                -- Left out of the statistics of markers.
    -- Whether a session's start was given. One that nobody gave was stored as the site's origin, where hardly anybody
    -- ever starts.
    start_known integer not null default 0
) strict;
create index sessions_by_inspector on sessions (carrier_id, started_at);
create index sessions_by_start on sessions (started_at);
create index sessions_by_state on sessions (state);
create index sessions_removed on sessions (removed_at) where removed_at is not null;

-- A browser in which somebody has signed in. The cookie's secret is not kept, only its hash.
create table sign_ins (
    id text not null primary key,
    account_id text not null references accounts (id) on delete cascade,
    secret_sha256 blob not null unique,
    address text not null,               -- from where, as the server or its proxy saw it
    agent text not null default '',      -- what the browser calls itself
    created_at integer not null,         -- UTC µs
    seen_at integer not null,            -- UTC µs, to a minute or so
    expires_at integer not null          -- UTC µs
) strict;
create index sign_ins_by_account on sign_ins (account_id);

-- What walks are computed with. Rows are only added, and the newest holds; before the first, every parameter is the
-- default.
create table site_parameters (
    id integer not null primary key autoincrement,
    -- the set that was made the site's; no foreign key, for it may be removed; null: back to the defaults
    set_id text,
    set_name text,                                  -- its name at that time
    set_version integer,                            -- its version at that time
    parameters text not null,                       -- JSON as in parameter_sets: as they were at that time
    chosen_at integer not null,                     -- UTC µs
    chosen_by text                                  -- who; null where nobody had to sign in
) strict;

-- Where inspectors stood, with the markers that it may have been; and visits that come from there.
create table stands (
    session_id text not null references sessions (id) on delete cascade,
    number integer not null,           -- counts the stands of a session from 1
    t_start_ns integer not null,       -- when the feet came to rest
    t_end_ns integer not null,         -- when the first foot lifted; the latest time known while it lasts
    lasts integer not null,            -- whether the inspector still stands there
    e_m real not null,                 -- where the track had it when it was first told
    n_m real not null,
    u_m real not null,
    candidates text not null,          -- JSON as in faults: likeliest first; marker null is "none of them"
    primary key (session_id, number)
) strict, without rowid;

-- The samples of live streams in a table of their own, in the order in which they were written, whosesoever they are.
-- Their index goes on at its end for all sessions together: by stretches of 4,096 chunks, in each by session. So a
-- commit of a thousand walks touches some dozens of its pages in place of one for each walk. `raw_chunks` keeps what
-- came in logs.
create table stream_chunks (
    id integer not null primary key,  -- in the order of writing
    session_id text not null,         -- no foreign key: stream_stretches has it, and takes the chunks along
    stream text not null,
    first_sequence integer not null,  -- number of its first batch
    sequences integer not null,       -- how many batches it holds, at least 1
    t_first_ns integer not null,      -- time of its first sample, ns
    samples integer not null,         -- how many samples
    encoding integer not null,        -- as in raw_chunks
    body blob not null,               -- the samples in that layout
    checksum integer
) strict;
create unique index stream_chunks_by_stretch on stream_chunks (id >> 12, session_id, first_sequence, stream);

-- In which parts of stream_chunks a session has chunks: parts of 1,048,576, each of 256 stretches.
create table stream_parts (
    session_id text not null references sessions (id) on delete cascade,
    part integer not null,           -- id >> 20 of its chunks
    primary key (session_id, part)
) strict, without rowid;
create trigger stream_chunks_go_with_their_session after delete on stream_parts begin
    delete from stream_chunks where session_id = old.session_id and id >> 12 in (
        with recursive stretch (n) as (
            select old.part << 8 union all select n + 1 from stretch where n < (old.part << 8) + 255
        ) select n from stretch);
end;

-- Visits that a device told while it streamed: at which point of the stream, and what the marker's coordinates were
-- then. A live session that is rebuilt after a restart replays samples and visits in the order in which they came, and
-- so arrives at the very state that was lost.
create table stream_visits (
    visit_id text not null primary key references visits (id) on delete cascade,
    session_id text not null references sessions (id) on delete cascade,
    after_samples integer not null,  -- samples of the stream, both feet, that had been taken before it
    e_m real not null,               -- the marker's coordinates at that time
    n_m real not null,
    u_m real                         -- null: its height was not surveyed
) strict;
create index stream_visits_by_session on stream_visits (session_id, after_samples);

-- A visit that is taken back is in every state that was saved since it was told: the session is then made from its
-- samples.
create trigger live_states_go_with_a_visit after delete on stream_visits begin
    delete from live_states where session_id = old.session_id;
end;

-- The streams of a session: what its readings come in.
create table streams (
    session_id text not null references sessions (id) on delete cascade,
    number integer not null,           -- within the session, as binary frames carry it
    name text not null,                -- within the session, as messages and the tables below spell it
    role text not null,                -- what it is to the system: one of the roles that the system declares
    kind text not null check (kind in ('imu', 'values')),  -- samples of an inertial sensor, or rows of numbers
    -- from the body's origin to where it measures, in b; null where the system needs none
    lever_arm_x_m real,
    lever_arm_y_m real,
    lever_arm_z_m real,
    primary key (session_id, number),
    unique (session_id, name)
) strict, without rowid;

-- A bearer token of a device or a script. Its secret was shown once; only its hash is kept.
create table tokens (
    id text not null primary key,
    -- who made it; it may never do more than its owner
    account_id text not null references accounts (id) on delete cascade,
    name text not null,                  -- what it is for
    secret_sha256 blob not null unique,
    rights text not null,                -- JSON list of words such as read and walk
    -- the one inspector whose walks it may write; null: those of its owner's rights
    inspector_id text references carriers (id) on delete cascade,
    created_at integer not null,         -- UTC µs
    expires_at integer,                  -- UTC µs; null: it does not expire
    used_at integer,                     -- UTC µs of its last use, to a minute or so; null: never
    revoked_at integer                   -- UTC µs; null while it is good
) strict;
create index tokens_by_account on tokens (account_id);

-- Where the inspector was. Points may be revised in hindsight: then the row is replaced, the newest knowledge stands
-- here. At most `track_rate_hz` rows a second (10 by default), a subset of the epochs.
create table track_points (
    session_id text not null references sessions (id) on delete cascade,
    -- with every aid, smoothed once finished; the same before smoothing; or with no visit used
    run text not null,
    t_ns integer not null,
    e_m real not null,                    -- the middle of the feet (the one foot, when there is one)
    n_m real not null,
    u_m real not null,
    heading_rad real not null,            -- clockwise from true north, in (−π, π]
    sigma_heading_rad real not null,
    sigma_e_m real not null,
    sigma_n_m real not null,
    sigma_u_m real not null,
    covariance_en_m2 real not null,       -- of east and north, m²
    -- The parts of a point, by number: the feet of a walk were the first two. Roll and pitch, where a system has them.
    part_0_e_m real,
    part_0_n_m real,
    part_0_u_m real,
    part_1_e_m real,                      -- the right sensor; null when that foot carries none
    part_1_n_m real,
    part_1_u_m real,
    part_0_stance integer,                -- whether that foot stands; null with its position
    part_1_stance integer,
    roll_rad real,
    pitch_rad real,
    sigma_roll_rad real,
    sigma_pitch_rad real,
    -- CRC-32 of a row's session, run and values, as store/track.rs lays them out; null for what was written before.
    checksum integer,
    primary key (session_id, run, t_ns)
) strict, without rowid;

-- Stands whose automatic visit was undone: they are left to people.
create table undone_stands (
    session_id text not null references sessions (id) on delete cascade,
    t_start_ns integer not null,
    primary key (session_id, t_start_ns)
) strict, without rowid;

-- An inspector stood at a marker: what was said, and what the filter made of it.
create table visits (
    id text not null primary key,
    session_id text not null references sessions (id) on delete cascade,
    -- its name at that time; no foreign key, for a marker may be renamed later
    marker text not null,
    t_start_ns integer not null,                -- when the inspector arrived
    t_end_ns integer not null,                  -- when the inspector left
    created_at integer not null,                -- UTC µs
    -- The outcome; null until a run has weighed it.
    t_applied_ns integer,                       -- the moment at which it was applied
    accepted integer,                           -- whether it was used
    nis real,                                   -- normalised innovation squared
    degrees_of_freedom integer,                 -- axes measured: 2 where the marker has no height
    before_e_m real,                            -- position before the correction minus the marker's, m
    before_n_m real,
    before_u_m real,
    after_e_m real,                             -- position after the correction minus the marker's, m
    after_n_m real,
    after_u_m real,
    reason text,                                -- why it was not used, in a sentence; empty when it was
    -- Who said that it was this marker: somebody keyed it in, chose it among a stand's candidates, or automatic mode
    -- was nearly certain.
    origin text not null default 'keyed' check (origin in ('keyed', 'chosen', 'automatic')),
    -- Where the marker stood when a visit was weighed, so that its residual can be told against the survey of today.
    -- Null: it was weighed before this was kept, or the marker was gone.
    marker_e_m real,
    marker_n_m real,
    marker_u_m real,
    -- What was added to a keyed visit's times to have the log's, ns; without it they are as they were keyed in.
    keyed_shift_ns integer not null default 0,
    unique (session_id, marker, t_start_ns)
) strict;
create index visits_by_marker on visits (marker);
create index visits_by_session on visits (session_id, t_start_ns);

-- The outbox, written in the transaction of the event: one row for each webhook that wants it.
create table webhook_deliveries (
    id integer not null primary key autoincrement,  -- in the order of the events
    webhook_id text not null references webhooks (id) on delete cascade,
    -- the same for every webhook and every try: who gets it twice knows it
    event_id text not null,
    event text not null,                            -- such as fault.reported
    body text not null,                             -- JSON, as it is signed and sent
    state text not null check (state in ('waiting', 'delivered', 'failed')),
    tries integer not null default 0,
    next_at integer,                                -- UTC µs of the next try; null when there is none
    tried_at integer,                               -- UTC µs of the last try; null before the first
    took_ms integer,                                -- how long that took
    status integer,                                 -- HTTP status of its answer; null where there was none
    answer text,                                    -- the first bytes of its answer, or why there was none
    created_at integer not null                     -- UTC µs
) strict;
create index webhook_deliveries_by_webhook on webhook_deliveries (webhook_id, id);
create index webhook_deliveries_due on webhook_deliveries (next_at) where state = 'waiting';

-- Other programs that want to hear of faults and anomalies, and what is on its way to them; and what staff say of
-- walks.
create table webhooks (
    id text not null primary key,
    name text not null,                  -- what it is for, as it is shown
    url text not null,                   -- http or https; where the events are posted to
    secret text not null,                -- the bodies are signed with it, so it is kept as it is; shown once
    events text not null,                -- JSON list of words such as fault.reported
    enabled integer not null default 1,  -- 0: nothing is sent; what waits goes on waiting
    -- in a sentence, where it was switched off because nothing arrived; null otherwise
    disabled_why text,
    -- UTC µs of the first try that failed since one that did not; null while all is well
    failing_since integer,
    version integer not null default 1,  -- counts its changes: who changes it names the one that was seen
    created_at integer not null,         -- UTC µs
    created_by text,                     -- who; null where nobody had to sign in
    updated_at integer not null          -- UTC µs of the last change
) strict;
